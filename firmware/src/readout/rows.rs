//! Shift registers that select a row. An active output is high; `docs/board.md` shows what it switches.

use embedded_hal::digital::OutputPin;
use taxel_core::RowWire;

use super::RowDrive;

/// Why a row could not be selected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriveError<E> {
    /// There is no such row.
    NotWired(RowWire),
    /// A pin failed.
    Pin(E),
}

impl<E> From<E> for DriveError<E> {
    fn from(cause: E) -> Self {
        Self::Pin(cause)
    }
}

/// 74HC595 shift registers in series, with one output for each row: row 0 is QA of the first chip.
///
/// All rows change at once when the latch rises. If `ROWS` is not a multiple of eight, the last outputs of the
/// last chip stay low.
#[derive(Debug)]
pub struct ShiftRegister595<P, const ROWS: usize> {
    /// Data pin SER.
    pub data: P,
    /// Shift clock pin SRCLK.
    pub clock: P,
    /// Latch pin RCLK.
    pub latch: P,
}

impl<P: OutputPin, const ROWS: usize> ShiftRegister595<P, ROWS> {
    /// Shifts one bit for each output, the last output's first, and latches them.
    fn shift(&mut self, active: Option<usize>) -> Result<(), P::Error> {
        self.latch.set_low()?;
        for output in (0..ROWS.div_ceil(8) * 8).rev() {
            self.clock.set_low()?;
            self.data.set_state((Some(output) == active).into())?;
            self.clock.set_high()?;
        }
        self.latch.set_high()
    }
}

impl<P: OutputPin, const ROWS: usize> RowDrive for ShiftRegister595<P, ROWS> {
    type Error = DriveError<P::Error>;

    fn drive(&mut self, row: RowWire) -> Result<(), Self::Error> {
        if row.0 >= ROWS {
            return Err(DriveError::NotWired(row));
        }
        Ok(self.shift(Some(row.0))?)
    }

    fn release(&mut self) -> Result<(), Self::Error> {
        Ok(self.shift(None)?)
    }
}
