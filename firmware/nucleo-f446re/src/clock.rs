//! Clock in microseconds, by timer 2.

use stm32f4xx_hal::pac::TIM2;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::timer::CounterUs;

/// Clock that counts microseconds.
pub struct Clock(CounterUs<TIM2>);

impl Clock {
    pub(crate) fn start(timer: TIM2, rcc: &mut Rcc) -> Option<Self> {
        let mut timer = timer.counter_us(rcc);
        timer.start(u32::MAX.micros()).ok()?;
        Some(Self(timer))
    }

    /// Microseconds since the start; it restarts from 0 every 71 minutes.
    #[must_use]
    pub fn now_us(&self) -> u32 {
        self.0.now().ticks()
    }
}
