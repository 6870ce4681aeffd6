//! The watchdog restarts a program that does not feed it, and no other.
#![no_std]
#![no_main]

use core::mem::MaybeUninit;

use cortex_m_rt::entry;
use defmt::info;
use qemu_image::{clock::Clock, exit, watchdog::Watchdog};

const TIMEOUT_MS: u32 = 100;
const RESTARTING: u32 = 0x5EED_0001;

/// A mark that survives a restart, since no start-up code writes to it.
#[unsafe(link_section = ".uninit.MARK")]
static mut MARK: MaybeUninit<u32> = MaybeUninit::uninit();

#[entry]
fn main() -> ! {
    let mark = (&raw mut MARK).cast::<u32>();
    // SAFETY: there is one thread, and RAM holds some value, whichever it is.
    if unsafe { mark.read_volatile() } == RESTARTING {
        info!("restarted");
        exit::success();
    }

    let mut watchdog = Watchdog::start(TIMEOUT_MS);
    let mut clock = Clock::start();
    while clock.now_us() < u64::from(TIMEOUT_MS) * 5000 {
        watchdog.feed();
    }
    info!("fed for five times its limit");
    // SAFETY: there is one thread.
    unsafe { mark.write_volatile(RESTARTING) };
    loop {
        cortex_m::asm::nop();
    }
}
