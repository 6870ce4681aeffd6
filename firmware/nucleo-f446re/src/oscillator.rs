//! What the processor's clock is made of.

use cortex_m::asm;
use cortex_m::peripheral::DWT;
use stm32f4xx_hal::pac::RCC;

/// Longest time to wait for the external clock, in cycles: 100 ms at 16 MHz, at which the processor starts.
const PATIENCE_CYCLES: u32 = 1_600_000;

/// Cycles from one look to the next, at least.
const PAUSE_CYCLES: u32 = 100;

/// The processor's frequency in MHz from each source. The internal oscillator may be 4 % too fast: with them, 158 MHz
/// stay below 168, which need no over-drive. And of the frequencies up to there it suits the serial line best, which is
/// 0.3 % too slow.
pub(crate) const EXTERNAL_MHZ: u32 = 180;
pub(crate) const INTERNAL_MHZ: u32 = 158;

/// Source of the processor's clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum Oscillator {
    /// 8 MHz from the ST-LINK. If they stop, the program restarts.
    External,
    /// The microcontroller's own 16 MHz, within 1 % at 25 °C and 4 % from −10 to 85 °C: the ST-LINK's clock does not
    /// come.
    Internal,
}

impl Oscillator {
    /// Turns the external clock on, and waits until it is ready, 100 ms at most. The counter of cycles must be on.
    pub(crate) fn find(rcc: &RCC) -> Self {
        rcc.cr().modify(|_, w| w.hsebyp().set_bit());
        rcc.cr().modify(|_, w| w.hseon().set_bit());
        let start = DWT::cycle_count();
        while DWT::cycle_count().wrapping_sub(start) < PATIENCE_CYCLES {
            if rcc.cr().read().hserdy().bit() {
                return Self::External;
            }
            asm::delay(PAUSE_CYCLES);
        }
        rcc.cr().modify(|_, w| w.hseon().clear_bit());
        Self::Internal
    }
}
