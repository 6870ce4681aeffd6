//! The CMSDK watchdog: restarts a program that has stopped feeding it.

use crate::registers::Registers;

const LOAD: usize = 0x000;
const CTRL: usize = 0x008;
const CLEAR: usize = 0x00C;
const LOCK: usize = 0xC00;

const TICKS_PER_MS: u32 = 25_000;
/// Control bits: interrupt when the count ends first, reset when it ends again.
const INTERRUPT_AND_RESET: u32 = 3;
const UNLOCK: u32 = 0x1ACC_E551;

/// The watchdog, which cannot be stopped once it is started.
pub struct Watchdog(Registers);

impl Watchdog {
    /// Starts the watchdog. A program that does not feed it for `timeout_ms` (at most 171 s) is stopped by a
    /// non-maskable interrupt, and restarted after as long again.
    pub fn start(timeout_ms: u32) -> Self {
        // SAFETY: the watchdog lies at this address.
        let registers = unsafe { Registers::at(0x4000_8000) };
        registers.write(LOCK, UNLOCK);
        registers.write(LOAD, timeout_ms.saturating_mul(TICKS_PER_MS));
        registers.write(CTRL, INTERRUPT_AND_RESET);
        Self(registers)
    }

    /// Feeds the watchdog: its count starts again.
    pub fn feed(&mut self) {
        self.0.write(CLEAR, 1);
    }
}
