//! The example `minimal` as an image: what a scan and an estimate take, which `cargo xtask size` measures without the
//! weights. Its pins and buses are registers at made-up addresses; a board's own drivers come on top. It is not run.
#![no_std]
#![no_main]

use core::convert::Infallible;
use core::ptr;

use cortex_m_rt::entry;
use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{self, OutputPin};
use embedded_hal::spi::{self, Operation, SpiDevice};

#[path = "../../examples/minimal.rs"]
mod example;

/// A register of a port, a bus or a timer.
struct Register(*mut u32);

impl Register {
    fn set(&mut self, value: u32) {
        // SAFETY: a write to the machine's peripherals, which nothing else uses.
        unsafe { ptr::write_volatile(self.0, value) }
    }

    fn get(&self) -> u32 {
        // SAFETY: as for a write.
        unsafe { ptr::read_volatile(self.0) }
    }
}

impl digital::ErrorType for Register {
    type Error = Infallible;
}

impl OutputPin for Register {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.set(0);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.set(1);
        Ok(())
    }
}

impl spi::ErrorType for Register {
    type Error = spi::ErrorKind;
}

impl SpiDevice for Register {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), spi::ErrorKind> {
        for operation in operations {
            let Operation::TransferInPlace(bytes) = operation else {
                return Err(spi::ErrorKind::Other);
            };
            for byte in bytes.iter_mut() {
                self.set(u32::from(*byte));
                *byte = self.get() as u8;
            }
        }
        Ok(())
    }
}

impl DelayNs for Register {
    fn delay_ns(&mut self, ns: u32) {
        self.set(ns);
        while self.get() > 0 {}
    }
}

/// The machine's peripherals begin here.
const PERIPHERALS: usize = 0x4000_0000;

#[entry]
fn main() -> ! {
    let register = |word: usize| Register(ptr::with_exposed_provenance_mut(PERIPHERALS + 4 * word));
    let (pins, chips) = ([0, 1, 2].map(register), [3, 4, 5].map(register));
    let mut sensor = example::Sensor::new(pins, chips, register(6));
    let mut outputs = [7, 8, 9, 10, 11, 12].map(register);
    loop {
        let estimate = sensor.estimate_dz_mm();
        outputs.iter_mut().zip(estimate).for_each(|(output, mm)| output.set(mm.to_bits()));
    }
}

#[cfg(not(feature = "no-panic"))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

#[cfg(feature = "no-panic")]
use qemu_image as _; // its panic handler
