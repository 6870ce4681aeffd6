//! Clock in microseconds, by CMSDK timer 0.

use crate::registers::Registers;

const CTRL: usize = 0x0;
const VALUE: usize = 0x4;
const RELOAD: usize = 0x8;

const TICKS_PER_US: u32 = 25;

/// Clock that counts microseconds. It must be read at least every 171 s, before the timer wraps around.
#[derive(Clone, Copy)]
pub struct Clock {
    timer: Registers,
    /// Count of the timer, which counts down, at the last whole microsecond.
    last: u32,
    now_us: u64,
}

impl Clock {
    /// Starts the timer.
    pub fn start() -> Self {
        // SAFETY: timer 0 lies at this address.
        let timer = unsafe { Registers::at(0x4000_0000) };
        timer.write(RELOAD, u32::MAX);
        timer.write(VALUE, u32::MAX);
        timer.write(CTRL, 1);
        Self { timer, last: u32::MAX, now_us: 0 }
    }

    /// Microseconds since the start.
    pub fn now_us(&mut self) -> u64 {
        let elapsed_us = self.last.wrapping_sub(self.timer.read(VALUE)) / TICKS_PER_US;
        self.last = self.last.wrapping_sub(elapsed_us * TICKS_PER_US);
        self.now_us += u64::from(elapsed_us);
        self.now_us
    }
}
