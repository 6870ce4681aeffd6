//! The CMSDK watchdog: restarts a program that has stopped feeding it.

use crate::registers::Registers;

const LOAD: usize = 0x000;
const CTRL: usize = 0x008;
const CLEAR: usize = 0x00C;
const LOCK: usize = 0xC00;

const TICKS_PER_MS: u32 = 25_000;
/// Interrupt at the first end of the count, reset at the second.
const INTERRUPT_AND_RESET: u32 = 3;
const UNLOCK: u32 = 0x1ACC_E551;

/// Once started, it runs on.
pub struct Watchdog(Registers);

impl Watchdog {
    /// Starts it. A program that does not feed it for `timeout_ms` is stopped by a non-maskable
    /// interrupt, and restarted after as long again. At most 171 s.
    #[must_use]
    pub fn start(timeout_ms: u32) -> Self {
        // SAFETY: the watchdog is there.
        let registers = unsafe { Registers::at(0x4000_8000) };
        registers.write(LOCK, UNLOCK);
        registers.write(LOAD, timeout_ms.saturating_mul(TICKS_PER_MS));
        registers.write(CTRL, INTERRUPT_AND_RESET);
        Self(registers)
    }

    /// Begins the count anew.
    pub fn feed(&mut self) {
        self.0.write(CLEAR, 1);
    }
}
