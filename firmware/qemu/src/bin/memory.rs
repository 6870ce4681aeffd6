//! The slots behave as flash does, and the reported sizes of memory are right.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use defmt::{assert, assert_eq, info};
use qemu_image::memory::{Sections, stack_bytes, stack_high_water_bytes};
use qemu_image::{exit, slot::Slot, slot::SlotError};

static mut WITH_A_VALUE: [u32; 3] = [1, 2, 3];
static mut ZEROED: [u32; 5] = [0; 5];

#[inline(never)]
fn take_a_kilobyte() {
    black_box([1_u8; 1024]);
}

fn slots() {
    // SAFETY: the slots are taken only here.
    let ([mut a, mut b], ..) = unsafe { Slot::take() };
    assert_eq!((a.bytes().len(), b.bytes().len()), (0x2_0000, 0x2_0000));
    assert_eq!(a.bytes().as_ptr_range().end, b.bytes().as_ptr_range().start);

    b.erase();
    a.erase();
    assert!(a.bytes().iter().all(|&byte| byte == 0xFF));
    assert_eq!(a.write(0x1_FFFE, &[0x12, 0xF0]), Ok(()));
    assert_eq!(a.write(0x1_FFFF, &[0x30]), Ok(())); // ones to zeros
    assert_eq!(a.bytes()[0x1_FFFE..], [0x12, 0x30]);
    assert_eq!(a.write(0x1_FFFF, &[0xCF]), Err(SlotError::NotErased));
    assert_eq!(a.bytes()[0x1_FFFF], 0x30 & 0xCF);
    assert_eq!(a.write(0x1_FFFF, &[0, 0]), Err(SlotError::OutOfRange));
    assert_eq!(a.write(usize::MAX, &[0]), Err(SlotError::OutOfRange));
    assert!(b.bytes().iter().all(|&byte| byte == 0xFF));
    a.erase();
    assert!(a.bytes().iter().all(|&byte| byte == 0xFF));
    info!("slots behave as flash does");
}

fn stack() {
    let before = stack_high_water_bytes();
    assert!(before > 0 && before <= stack_bytes() / 2, "{=usize}", before);
    take_a_kilobyte();
    let after = stack_high_water_bytes();
    assert!((before.max(1024)..=before + 1200).contains(&after), "{} to {}", before, after);
    info!("the stack's high-water mark rises with its use");
}

fn sections() {
    let sections = Sections::linked();
    // SAFETY: there is one thread, and no interrupt is enabled.
    let (data, bss) =
        unsafe { (black_box(&raw const WITH_A_VALUE).read(), black_box(&raw const ZEROED).read()) };
    assert_eq!((data, bss), ([1, 2, 3], [0; 5]));
    assert!(sections.data >= 12 && sections.bss >= 20 && sections.uninit == 0, "{}", sections);
    assert_eq!(sections.vector_table, 4 * (16 + 240));
    assert!(sections.text > 1000 && sections.rodata > 0, "{}", sections);
    let flash = sections.flash() - sections.vector_table - sections.text - sections.rodata;
    assert_eq!((flash, sections.ram()), (sections.data, sections.data + sections.bss));
    info!("sections are where the linker put them");
}

#[entry]
fn main() -> ! {
    stack();
    slots();
    sections();
    exit::success()
}
