//! Logs the core's identification at every level, and checks that the clock runs.
#![no_std]
#![no_main]

use cortex_m::peripheral::{CPUID, FPU};
use cortex_m_rt::entry;
use defmt::{debug, error, info, warn};
use qemu_image::{clock::Clock, exit, memory};

#[entry]
fn main() -> ! {
    // SAFETY: reading these registers has no effect.
    let (cpuid, mvfr0) = unsafe { ((*CPUID::PTR).base.read(), (*FPU::PTR).mvfr[0].read()) };
    info!("CPUID {=u32:#010x}, MVFR0 {=u32:#010x}", cpuid, mvfr0);
    warn!("{=usize} bytes of stack", memory::stack_bytes());
    error!("nothing is wrong");
    debug!("below the level that .cargo/config.toml sets");

    let mut clock = Clock::start();
    let start = clock.now_us();
    while clock.now_us() < start + 1000 {}
    info!("a millisecond went by");
    exit::success()
}
