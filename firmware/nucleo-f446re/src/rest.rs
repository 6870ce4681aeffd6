//! Rows at rest, whatever the program was doing.

use core::arch::naked_asm;

use cortex_m::asm;
use stm32f4xx_hal::pac::{GPIOC, RCC};

/// Pins of port C to the row registers: data, shift clock, storage clock.
const DATA: u32 = 1 << 6;
const CLOCK: u32 = 1 << 8;
const LATCH: u32 = 1 << 9;

/// Fields of these pins in the register of modes, and their value for an output.
const MODES: u32 = 3 << 12 | 3 << 16 | 3 << 18;
const OUTPUTS: u32 = 1 << 12 | 1 << 16 | 1 << 18;

/// Outputs of the row registers, of eight each.
const OUTPUTS_OF_ROWS: usize = board_common::CAPACITY.rows.next_multiple_of(8);

/// Cycles that each level lasts: 100 ns at 180 MHz.
const LEVEL_CYCLES: u32 = 18;

/// Takes every row from ground: shifts zeros into the row registers. It needs nothing but power, so it works before
/// anything is set up, and when nothing else works any more.
pub(crate) extern "C" fn rest_rows() {
    // SAFETY: whoever else uses these pins has not begun yet, or does not go on.
    let (rcc, port) = unsafe { (RCC::steal(), GPIOC::steal()) };
    let set = |pins: u32| {
        // SAFETY: every value is allowed.
        port.bsrr().write(|w| unsafe { w.bits(pins) });
        asm::delay(LEVEL_CYCLES);
    };
    let clear = |pins: u32| set(pins << 16);
    rcc.ahb1enr().modify(|_, w| w.gpiocen().set_bit());
    asm::dsb();
    clear(DATA | CLOCK | LATCH);
    // SAFETY: the other pins' fields stay as they are.
    port.moder().modify(|r, w| unsafe { w.bits(r.bits() & !MODES | OUTPUTS) });
    for _ in 0..OUTPUTS_OF_ROWS {
        set(CLOCK);
        clear(CLOCK);
    }
    set(LATCH);
    clear(LATCH);
}

/// What cortex-m-rt calls first: a row that was left at ground would stay there until the first scan. RAM is filled only
/// afterwards, which takes 2 ms, so no variable may be used.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn __pre_init() {
    naked_asm!("b {}", sym rest_rows)
}
