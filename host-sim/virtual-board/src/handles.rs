//! Handles for the firmware: pins, SPI devices, the converter and the delay.

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{self, OutputPin};
use embedded_hal::spi::{self, Operation, SpiDevice};
use taxel_firmware::readout::OnChipAdc;

use super::board::VirtualBoard;
use super::pin::Pin;
use super::violation::Violation;

impl VirtualBoard {
    /// Handle to a pin.
    pub fn pin(&self, pin: Pin) -> VirtualPin {
        VirtualPin { board: self.clone(), pin }
    }

    /// Handle to MCP3208 number `chip` as an SPI device.
    pub fn spi(&self, chip: usize) -> VirtualSpi {
        VirtualSpi::new(self.clone(), chip)
    }

    /// Handle to the microcontroller's own converter.
    pub fn adc(&self) -> VirtualAdc {
        VirtualAdc::new(self.clone())
    }

    /// Delay that advances the board's clock.
    pub fn delay(&self) -> VirtualDelay {
        VirtualDelay::new(self.clone())
    }
}

/// Pin of a virtual board.
#[derive(Debug, Clone)]
pub struct VirtualPin {
    board: VirtualBoard,
    pin: Pin,
}

impl digital::ErrorType for VirtualPin {
    type Error = Violation;
}

impl OutputPin for VirtualPin {
    fn set_low(&mut self) -> Result<(), Violation> {
        self.board.set_pin(self.pin, false)
    }

    fn set_high(&mut self) -> Result<(), Violation> {
        self.board.set_pin(self.pin, true)
    }
}

/// MCP3208 of a virtual board, as an SPI device.
#[derive(Debug, Clone)]
pub struct VirtualSpi {
    board: VirtualBoard,
    chip: usize,
}

impl VirtualSpi {
    pub(super) fn new(board: VirtualBoard, chip: usize) -> Self {
        Self { board, chip }
    }
}

impl spi::ErrorType for VirtualSpi {
    type Error = Violation;
}

impl SpiDevice for VirtualSpi {
    /// Chip select stays low throughout, so all operations together are one transfer.
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Violation> {
        let mut bytes = Vec::new();
        for operation in &*operations {
            match operation {
                Operation::Read(read) => bytes.resize(bytes.len() + read.len(), 0),
                Operation::Write(write) => bytes.extend_from_slice(write),
                Operation::Transfer(read, write) => {
                    let end = bytes.len() + read.len().max(write.len());
                    bytes.extend_from_slice(write);
                    bytes.resize(end, 0);
                }
                Operation::TransferInPlace(both) => bytes.extend_from_slice(both),
                Operation::DelayNs(ns) => self.board.wait_ns(*ns),
            }
        }
        self.board.transfer(self.chip, &mut bytes)?;
        let mut answer = &bytes[..];
        for operation in operations {
            let (clocked, read): (usize, &mut [u8]) = match operation {
                Operation::Read(read) => (read.len(), read),
                Operation::Write(write) => (write.len(), &mut []),
                Operation::Transfer(read, write) => (read.len().max(write.len()), read),
                Operation::TransferInPlace(both) => (both.len(), both),
                Operation::DelayNs(_) => (0, &mut []),
            };
            let (of_operation, rest) = answer.split_at(clocked);
            read.copy_from_slice(&of_operation[..read.len()]);
            answer = rest;
        }
        Ok(())
    }
}

/// Delay that advances a virtual board's clock.
#[derive(Debug, Clone)]
pub struct VirtualDelay(VirtualBoard);

impl VirtualDelay {
    pub(super) fn new(board: VirtualBoard) -> Self {
        Self(board)
    }
}

impl DelayNs for VirtualDelay {
    fn delay_ns(&mut self, ns: u32) {
        self.0.wait_ns(ns);
    }
}

/// Converter on the microcontroller of a virtual board.
#[derive(Debug, Clone)]
pub struct VirtualAdc(VirtualBoard);

impl VirtualAdc {
    pub(super) fn new(board: VirtualBoard) -> Self {
        Self(board)
    }
}

impl OnChipAdc for VirtualAdc {
    type Error = Violation;

    const FULL_SCALE_COUNTS: u16 = 4095;

    fn start(&mut self) -> Result<(), Violation> {
        self.0.start_conversion()
    }

    fn poll(&mut self) -> Result<Option<u16>, Violation> {
        self.0.poll_conversion()
    }
}
