//! The supply: whether it allows to change flash.

use cortex_m::asm;
use stm32f4xx_hal::pac::{PWR, RCC};

/// Level 6 of the voltage detector, 2.85 to 2.99 V while the supply falls (DS10693): writing 32 bits at once needs 2.7 V, to
/// the end of an erase of 2 s. Level 7 would refuse a supply of 3.05 V.
const DETECTOR_LEVEL: u8 = 6;

/// Cycles after which the detector is sure to work: 100 µs at 16 MHz.
const DETECTOR_CYCLES: u32 = 1600;

/// Turns the voltage detector on.
pub(crate) fn watch(rcc: &RCC, pwr: &PWR) {
    rcc.apb1enr().modify(|_, w| w.pwren().set_bit());
    // A write that follows at once may be lost (ES0298).
    asm::dsb();
    // SAFETY: the level fits its field.
    pwr.cr().modify(|_, w| unsafe { w.pls().bits(DETECTOR_LEVEL) }.pvde().set_bit());
    asm::delay(DETECTOR_CYCLES);
}

/// Whether the supply is too low to change flash.
pub(crate) fn is_low() -> bool {
    // SAFETY: the register is only read.
    unsafe { PWR::steal() }.csr().read().pvdo().bit()
}
