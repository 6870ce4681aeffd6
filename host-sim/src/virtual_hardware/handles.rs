//! What the firmware gets hold of: pins, SPI devices, the converter and the delay.

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{self, OutputPin};
use embedded_hal::spi::{self, Operation, SpiDevice};
use firmware::readout::OnChipAdc;

use super::board::{Violation, VirtualBoard};

/// The board's pins. Which of them are there depends on the scene's parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pin {
    /// Control line of a row, from 0.
    Row(u8),
    /// Address line of the rows' 74HC4051, S0 first.
    RowAddress(u8),
    /// E̅ of the rows' 74HC4051.
    RowEnable,
    /// SER of the rows' 74HC595.
    RowData,
    /// SRCLK of the rows' 74HC595.
    RowClock,
    /// RCLK of the rows' 74HC595.
    RowLatch,
    /// Address line of the columns' 74HC4051s, S0 first.
    ColumnAddress(u8),
    /// E̅ of one of the columns' 74HC4051s.
    ColumnEnable(u8),
}

impl Pin {
    /// All pins; a pin's place here is its number.
    pub const ALL: [Self; 21] = [
        Self::Row(0),
        Self::Row(1),
        Self::Row(2),
        Self::Row(3),
        Self::Row(4),
        Self::Row(5),
        Self::Row(6),
        Self::Row(7),
        Self::RowAddress(0),
        Self::RowAddress(1),
        Self::RowAddress(2),
        Self::RowEnable,
        Self::RowData,
        Self::RowClock,
        Self::RowLatch,
        Self::ColumnAddress(0),
        Self::ColumnAddress(1),
        Self::ColumnAddress(2),
        Self::ColumnEnable(0),
        Self::ColumnEnable(1),
        Self::ColumnEnable(2),
    ];

    /// The pin of a number, for callers that send numbers.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.get(usize::from(number)).copied()
    }
}

impl digital::Error for Violation {
    fn kind(&self) -> digital::ErrorKind {
        digital::ErrorKind::Other
    }
}

impl spi::Error for Violation {
    fn kind(&self) -> spi::ErrorKind {
        spi::ErrorKind::Other
    }
}

/// A pin of a virtual board.
#[derive(Debug, Clone)]
pub struct VirtualPin {
    board: VirtualBoard,
    pin: Pin,
}

impl VirtualPin {
    pub(super) fn new(board: VirtualBoard, pin: Pin) -> Self {
        Self { board, pin }
    }
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

/// The SPI device of one MCP3208 of a virtual board.
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

/// The delay of a virtual board: moves its clock.
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

/// The converter on the microcontroller of a virtual board.
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
