//! Parts that select a row, as strict as the real ones.

use super::ROWS;
use super::pin::Pin;
use taxel_simulate::readout::Drive;

/// Row selector, with the levels of its pins.
#[derive(Debug)]
pub(super) enum RowSelector {
    Pins { high: [bool; ROWS] },
    Multiplexer { address: [bool; 3], disabled: bool },
    ShiftRegister(ShiftRegister),
}

#[derive(Debug, Default)]
pub(super) struct ShiftRegister {
    data: bool,
    clock: bool,
    latch: bool,
    /// The eight stages, QA first.
    stages: [bool; ROWS],
    /// Levels at the outputs, QA first.
    latched: [bool; ROWS],
    clocks_since_latch: usize,
}

impl RowSelector {
    /// Selector at power-up: no row active.
    pub(super) fn new(drive: Drive) -> Self {
        match drive {
            Drive::Pins => Self::Pins { high: [false; ROWS] },
            Drive::Multiplexer => Self::Multiplexer { address: [false; 3], disabled: true },
            Drive::ShiftRegister => Self::ShiftRegister(ShiftRegister::default()),
        }
    }

    /// Row (from 0) that is active, if any.
    pub(super) fn active(&self) -> Option<usize> {
        match self {
            Self::Pins { high } => high.iter().position(|high| *high),
            Self::Multiplexer { disabled: true, .. } => None,
            Self::Multiplexer { address, .. } => Some(number(address)),
            Self::ShiftRegister(register) => register.latched.iter().position(|high| *high),
        }
    }

    /// Sets one of the selector's pins; `None` if it has no such pin, otherwise whether the part accepts
    /// it.
    pub(super) fn set(&mut self, pin: Pin, high: bool) -> Option<Result<(), String>> {
        let outcome = match (self, pin) {
            (Self::Pins { high: rows }, Pin::Row(row)) => {
                *rows.get_mut(usize::from(row))? = high;
                one_active(rows)
            }
            (Self::Multiplexer { address, disabled }, Pin::RowAddress(bit)) => {
                set_address(address.get_mut(usize::from(bit))?, high, !*disabled, "row")
            }
            (Self::Multiplexer { disabled, .. }, Pin::RowEnable) => {
                *disabled = high;
                Ok(())
            }
            (Self::ShiftRegister(register), Pin::RowData) => {
                register.data = high;
                Ok(())
            }
            (Self::ShiftRegister(register), Pin::RowClock) => {
                register.set_clock(high);
                Ok(())
            }
            (Self::ShiftRegister(register), Pin::RowLatch) => register.set_latch(high),
            _ => return None,
        };
        Some(outcome)
    }
}

impl ShiftRegister {
    fn set_clock(&mut self, high: bool) {
        if high && !self.clock {
            self.stages.rotate_right(1);
            self.stages[0] = self.data;
            self.clocks_since_latch += 1;
        }
        self.clock = high;
    }

    fn set_latch(&mut self, high: bool) -> Result<(), String> {
        let rises = high && !self.latch;
        self.latch = high;
        if !rises {
            return Ok(());
        }
        let clocks = std::mem::take(&mut self.clocks_since_latch);
        self.latched = self.stages;
        if clocks != ROWS {
            return Err(format!(
                "the shift register was latched after {clocks} clocks, not {ROWS}"
            ));
        }
        one_active(&self.latched)
    }
}

/// Number whose bits, least significant first, are `address`.
pub(super) fn number(address: &[bool]) -> usize {
    address.iter().rev().fold(0, |number, bit| number << 1 | usize::from(*bit))
}

/// Sets an address pin of a multiplexer.
pub(super) fn set_address(
    pin: &mut bool,
    high: bool,
    enabled: bool,
    what: &str,
) -> Result<(), String> {
    let changes = *pin != high;
    *pin = high;
    if changes && enabled {
        return Err(format!("the {what} multiplexer's address changed while it was enabled"));
    }
    Ok(())
}

fn one_active(rows: &[bool]) -> Result<(), String> {
    let active: Vec<usize> = (0..rows.len()).filter(|row| rows[*row]).collect();
    if active.len() > 1 {
        return Err(format!("rows {active:?} (from 0) were driven at once"));
    }
    Ok(())
}
