//! Cause of a reset, and restarting the program.

use cortex_m::peripheral::SCB;
use stm32f4xx_hal::pac::RCC;

/// Cause of the microcontroller's last reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum ResetCause {
    /// Power was switched on, or was too low for a moment.
    Power,
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
        // Every reset sets the pin's flag as well, and a loss of power sets several flags.
        if flags.porrstf().bit() || flags.borrstf().bit() {
            Self::Power
        } else if flags.wdgrstf().bit() || flags.wwdgrstf().bit() {
            Self::Watchdog
        } else if flags.sftrstf().bit() {
            Self::Software
        } else {
            Self::Pin
        }
    }
}

/// Restarts the program.
pub fn restart() -> ! {
    SCB::sys_reset()
}
