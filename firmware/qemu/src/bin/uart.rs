//! Bytes pass in both directions at once between the two UARTs, which `cargo xtask emulate` connects; none is
//! lost while the reader is slow.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use defmt::{assert_eq, info};
use qemu_image::{clock::Clock, exit, uart::Uart};

const BYTES: u32 = 1000;

#[derive(Default)]
struct Progress {
    steps: u32,
    sent: u32,
    received: u32,
}

/// Byte `n` of a sequence that repeats after 251 bytes.
fn byte(n: u32) -> u8 {
    (n % 251) as u8
}

/// Tries to send a byte, and every third time to receive one.
fn step(uart: &mut Uart, progress: &mut Progress) {
    progress.steps += 1;
    if progress.sent < BYTES && uart.try_write(byte(progress.sent)) {
        progress.sent += 1;
    }
    if !progress.steps.is_multiple_of(3) {
        return;
    }
    if let Some(received) = uart.try_read() {
        assert_eq!(received, byte(progress.received));
        progress.received += 1;
    }
}

#[entry]
fn main() -> ! {
    let (mut first, mut second) = (Uart::first(), Uart::second());
    let (mut one, mut other) = (Progress::default(), Progress::default());
    assert_eq!(first.try_read(), None);
    let mut clock = Clock::start();
    while one.received < BYTES || other.received < BYTES {
        step(&mut first, &mut one);
        step(&mut second, &mut other);
        if clock.now_us() > 60_000_000 {
            defmt::panic!("{} and {} bytes in a minute", one.received, other.received);
        }
    }
    info!("{=u32} bytes each way", BYTES);
    exit::success()
}
