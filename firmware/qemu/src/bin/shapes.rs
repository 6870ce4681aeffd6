//! Infers by networks of many shapes and projects, by assembly and by its compiled twins, which must give the
//! same bits. Nothing may be read or written beyond what a shape has.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use defmt::{info, unwrap};
use qemu_image::exit;
use qemu_image::shapes::{self, Comparison, Memory};

fn log(what: &str, comparison: Comparison) {
    let Comparison { compared, different } = comparison;
    info!("{=str}: {=usize} of {=usize} differ from the twin's", what, different, compared);
}

#[entry]
fn main() -> ! {
    let peripherals = unwrap!(cortex_m::Peripherals::take());
    // SAFETY: the memory and the MPU are used here only.
    let mut memory = unsafe { Memory::take(&peripherals.MPU) };
    log("fixed16", unwrap!(shapes::networks(&mut memory)));
    log("projection", unwrap!(shapes::projections(&mut memory)));
    log("touch", unwrap!(shapes::touches(&mut memory)));
    exit::success()
}
