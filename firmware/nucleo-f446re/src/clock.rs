//! Microseconds since the start, from timer 2.

use stm32f4xx_hal::pac::TIM2;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::timer::CounterUs;

/// Counts microseconds. To be read at least every 71 minutes, when the timer has gone round once.
pub struct Clock {
    timer: CounterUs<TIM2>,
    last: u32,
    now_us: u64,
}

impl Clock {
    pub(crate) fn start(timer: TIM2, rcc: &mut Rcc) -> Option<Self> {
        let mut timer = timer.counter_us(rcc);
        timer.start(u32::MAX.micros()).ok()?;
        Some(Self { timer, last: 0, now_us: 0 })
    }

    /// Microseconds since the start.
    pub fn now_us(&mut self) -> u64 {
        let now = self.timer.now().ticks();
        self.now_us += u64::from(now.wrapping_sub(self.last));
        self.last = now;
        self.now_us
    }
}
