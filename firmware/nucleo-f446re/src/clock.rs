//! Clock in microseconds, by timer 2, and in cycles of the processor.

use cortex_m::peripheral::DWT;
use stm32f4xx_hal::pac::TIM2;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::timer::CounterUs;

/// Clock that counts microseconds and cycles. The processor's counter of cycles must be on.
pub struct Clock(CounterUs<TIM2>);

impl Clock {
    pub(crate) fn start(timer: TIM2, rcc: &mut Rcc) -> Option<Self> {
        let mut timer = timer.counter_us(rcc);
        timer.start(u32::MAX.micros()).ok()?;
        // The HAL lets the counter end one too early, at 2³² − 2.
        // SAFETY: every value of this register is valid, and `timer`, which owns it, is not used meanwhile.
        unsafe { TIM2::steal() }.arr().write(|w| unsafe { w.bits(u32::MAX) });
        Some(Self(timer))
    }

    /// Microseconds since the start; it restarts from 0 every 71 minutes.
    pub fn now_us(&self) -> u32 {
        self.0.now().ticks()
    }

    /// Cycles of the processor since the start; it restarts from 0 every 24 s.
    pub fn cycles(&self) -> u32 {
        DWT::cycle_count()
    }
}
