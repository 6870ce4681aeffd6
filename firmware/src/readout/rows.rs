//! Three ways to select a row. An active pin is high; `docs/readout.md` shows what it switches.

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

/// One pin for each row, at the control input of the row's switch.
#[derive(Debug)]
pub struct DirectPins<P, const ROWS: usize> {
    /// The rows' pins.
    pub rows: [P; ROWS],
}

impl<P: OutputPin, const ROWS: usize> RowDrive for DirectPins<P, ROWS> {
    type Error = DriveError<P::Error>;

    fn drive(&mut self, row: RowWire) -> Result<(), Self::Error> {
        self.release()?;
        Ok(self.rows.get_mut(row.0).ok_or(DriveError::NotWired(row))?.set_high()?)
    }

    /// Lets all rows idle; tries every pin, even if one fails.
    fn release(&mut self) -> Result<(), Self::Error> {
        let mut outcome = Ok(());
        for pin in &mut self.rows {
            outcome = outcome.and(pin.set_low());
        }
        Ok(outcome?)
    }
}

/// A 74HC4051 multiplexer: selects one of eight rows by three address pins, and none while `enable` is high.
///
/// Switching breaks before it makes: disable, set the address, enable. The multiplexer's 70 Ω are too much for a
/// row of 3.3 Ω, so it must switch a logic level to the rows' switches.
#[derive(Debug)]
pub struct Multiplexer4051<P> {
    /// Address pins S0, S1, S2.
    pub address: [P; 3],
    /// Enable pin E̅, active low.
    pub enable: P,
}

impl<P: OutputPin> RowDrive for Multiplexer4051<P> {
    type Error = DriveError<P::Error>;

    fn drive(&mut self, row: RowWire) -> Result<(), Self::Error> {
        if row.0 >= 8 {
            return Err(DriveError::NotWired(row));
        }
        self.enable.set_high()?;
        set_address(&mut self.address, row.0)?;
        Ok(self.enable.set_low()?)
    }

    fn release(&mut self) -> Result<(), Self::Error> {
        Ok(self.enable.set_high()?)
    }
}

/// Sets `pins`, least significant first, to the bits of `address`.
pub(super) fn set_address<P: OutputPin>(pins: &mut [P], address: usize) -> Result<(), P::Error> {
    let mut bits = address;
    for pin in pins {
        pin.set_state((bits & 1 == 1).into())?;
        bits >>= 1;
    }
    Ok(())
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
