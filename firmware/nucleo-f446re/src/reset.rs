//! Why the program starts, and how to start it anew.

use cortex_m::peripheral::SCB;
use stm32f4xx_hal::pac::RCC;

/// What made the microcontroller start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum ResetCause {
    /// Power came, or was too low for a moment.
    Power,
    /// The program had stopped feeding the watchdog.
    Watchdog,
    /// The program asked for it ([`restart`]), or a debugger.
    Software,
    /// The black button.
    Pin,
}

impl ResetCause {
    /// Reads the flags and clears them, so that they tell of one reset alone.
    pub(crate) fn read(rcc: &RCC) -> Self {
        let flags = rcc.csr().read();
        rcc.csr().modify(|_, w| w.rmvf().set_bit());
        // Every reset pulls the pin as well, and a loss of power sets all that it can.
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

/// Starts the program anew.
pub fn restart() -> ! {
    SCB::sys_reset()
}
