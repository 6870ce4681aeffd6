//! Panics, faults and stack overflows: each is logged, and ends QEMU with a failure.

#[cfg(not(feature = "no-panic"))]
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::peripheral::SCB;
#[cfg(not(feature = "no-panic"))]
use defmt_semihosting as _;

use crate::exit;

/// Largest number of bytes that one instruction pushes. A push that fails is undone, so that the stack pointer
/// still lies within the stack.
const LARGEST_PUSH_BYTES: usize = 128;

unsafe extern "C" {
    static _stack_end: u32;
}

/// Ends QEMU without logging anything if reporting itself fails.
fn report_once() {
    static REPORTING: AtomicBool = AtomicBool::new(false);
    if REPORTING.swap(true, Ordering::Relaxed) {
        exit::failure();
    }
}

#[cfg(not(feature = "no-panic"))]
#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    report_once();
    defmt::error!("{}", defmt::Display2Format(info));
    exit::failure()
}

/// Ends a program whose `defmt::panic!` or `defmt::assert!` has logged its message.
#[defmt::panic_handler]
fn panicked() -> ! {
    exit::failure()
}

/// Denies all access to the 256 MB below the RAM, so that a stack overflow faults at once, and to what lies behind the
/// 128 KB that a board has, up to the PSRAM. This machine, unlike a microcontroller, would let every read there give zero.
/// Runs before anything else.
#[unsafe(no_mangle)]
#[unsafe(naked)]
extern "C" fn __pre_init() {
    core::arch::naked_asm!(
        "ldr r0, =0xE000ED9C", // MPU_RBAR, MPU_RASR: a region, and what holds in it
        "ldr r1, =0x10000010", // region 0: no access to 256 MB
        "ldr r2, =0x10000037",
        "stm r0, {{r1, r2}}",
        "ldr r1, =0x20000011", // region 1: no access to 16 MB
        "ldr r2, =0x1000002F",
        "stm r0, {{r1, r2}}",
        "ldr r1, =0x20000012", // region 2, which wins: all access to 128 KB
        "ldr r2, =0x03030021",
        "stm r0, {{r1, r2}}",
        "ldr r0, =0xE000ED94", // MPU_CTRL: on, with the default map everywhere else
        "movs r1, #5",
        "str r1, [r0]",
        "dsb",
        "isb",
        "bx lr",
    )
}

/// Calls [`report`] on a fresh stack: after an overflow the old one has no room, and its contents are no longer
/// needed.
#[unsafe(no_mangle)]
#[unsafe(naked)]
extern "C" fn HardFault() -> ! {
    core::arch::naked_asm!(
        "mov r0, sp",
        "ldr r1, =_stack_end",
        "cmp r0, r1",
        "blo 1f",
        "ldr r1, [r0, #24]", // the program counter, in the frame that the processor pushed
        "1:",
        "ldr r2, =_stack_start",
        "mov sp, r2",
        "b {report}",
        report = sym report,
    )
}

/// Logs the fault, and ends QEMU with a failure. `program_counter` is valid only if `stack_pointer` lies within
/// the stack.
extern "C" fn report(stack_pointer: usize, program_counter: u32) -> ! {
    report_once();
    if stack_pointer < (&raw const _stack_end).addr() + LARGEST_PUSH_BYTES {
        defmt::error!("stack overflow");
    } else {
        // SAFETY: reading the fault status has no effect.
        let status = unsafe { (*SCB::PTR).cfsr.read() };
        defmt::error!("hard fault at {=u32:#010x}, CFSR {=u32:#010x}", program_counter, status);
    }
    exit::failure()
}
