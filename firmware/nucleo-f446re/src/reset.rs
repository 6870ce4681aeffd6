//! Cause of a reset, and restarting the program.

use cortex_m::peripheral::SCB;
use stm32f4xx_hal::pac::RCC;

use crate::fault::{self, Fault};

/// Cause of the microcontroller's last reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum ResetCause {
    /// Power was switched on.
    Power,
    /// Power was too low.
    BrownOut,
    /// The program could not go on.
    Fault(Fault),
    /// The program had stopped feeding the watchdog.
    Watchdog,
    /// The program restarted itself ([`restart`]), or a debugger did.
    Software,
    /// The black button was pressed.
    Pin,
}

impl ResetCause {
    /// Reads the reset flags and clears them, so that they show one reset only.
    pub(crate) fn read(rcc: &RCC) -> Self {
        let flags = rcc.csr().read();
        rcc.csr().modify(|_, w| w.rmvf().set_bit());
        let fault = fault::take();
        // Every reset sets the pin's flag as well, and a loss of power sets several flags.
        if flags.porrstf().bit() {
            Self::Power
        } else if flags.borrstf().bit() {
            Self::BrownOut
        } else if flags.wdgrstf().bit() || flags.wwdgrstf().bit() {
            Self::Watchdog
        } else if flags.sftrstf().bit() {
            fault.map_or(Self::Software, Self::Fault)
        } else {
            Self::Pin
        }
    }
}

/// Restarts the program.
pub fn restart() -> ! {
    SCB::sys_reset()
}
