//! The end of a program that cannot go on: the cause kept in RAM, and a reset at once, which makes inputs of the rows' pins:
//! their resistors let all rows idle.

use core::arch::naked_asm;
use core::panic::{Location, PanicInfo};
use core::ptr;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::interrupt;
use cortex_m::peripheral::SCB;
use cortex_m_rt::exception;

/// What ended the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum Fault {
    /// A panic, in this line of this file.
    Panic(&'static str, u32),
    /// An exception that nobody handles: an access or instruction that faults, or a stack that overflowed.
    Exception,
    /// The clock from the ST-LINK has stopped.
    Clock,
}

const PANIC: u32 = 1;
const EXCEPTION: u32 = 2;
const CLOCK: u32 = 3;

/// Marks a note: the three words of one are this, combined by exclusive or.
const MARK: u32 = 0x5441_584C;

/// Cause, place of a panic, and check word, in RAM that a start leaves as it is.
#[unsafe(link_section = ".uninit.fault")]
static NOTE: [AtomicU32; 3] = [const { AtomicU32::new(0) }; 3];

/// Takes the note of the program that ran before the reset.
pub(crate) fn take() -> Option<Fault> {
    let [cause, place, check] = NOTE.each_ref().map(|word| word.swap(0, Ordering::Relaxed));
    if cause ^ place ^ check != MARK {
        return None;
    }
    match cause {
        PANIC if place != 0 => {
            // SAFETY: `panic` left the address of a constant of this image, which is in flash.
            let place = unsafe { &*ptr::with_exposed_provenance::<Location>(place as usize) };
            Some(Fault::Panic(place.file(), place.line()))
        }
        EXCEPTION => Some(Fault::Exception),
        CLOCK => Some(Fault::Clock),
        _ => None,
    }
}

fn stop(cause: u32, place: u32) -> ! {
    interrupt::disable();
    for (word, value) in NOTE.iter().zip([cause, place, cause ^ place ^ MARK]) {
        word.store(value, Ordering::Relaxed);
    }
    SCB::sys_reset()
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    stop(PANIC, info.location().map_or(0, |place| ptr::from_ref(place).expose_provenance()) as u32)
}

/// Takes a new stack: the old one may be what faulted.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn HardFault() -> ! {
    naked_asm!("ldr r0, =_stack_start", "msr msp, r0", "b {}", sym faulted)
}

extern "C" fn faulted() -> ! {
    stop(EXCEPTION, 0)
}

#[exception]
unsafe fn DefaultHandler(_: i16) -> ! {
    stop(EXCEPTION, 0)
}

/// The clock security system has turned the processor to its own oscillator. The next start finds out what is left.
#[exception]
unsafe fn NonMaskableInt() -> ! {
    stop(CLOCK, 0)
}
