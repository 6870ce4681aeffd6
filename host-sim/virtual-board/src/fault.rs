//! Faults of wires and converters, for boards that are to have some.

use super::network::Tie;
use super::{COLUMNS, ROWS};

/// Conductance between wires that touch, in S.
const TOUCH_S: f64 = 1e3;

/// What is wrong with a board's sensor or converters. Wires count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoardFault {
    /// A row-wire's lead is broken.
    RowOpen(usize),
    /// A column-wire's lead is broken.
    ColumnOpen(usize),
    /// A row-wire is connected to ground.
    RowAtGround(usize),
    /// A row-wire is connected to the supply.
    RowAtSupply(usize),
    /// A column-wire is connected to ground.
    ColumnAtGround(usize),
    /// A column-wire is connected to the supply.
    ColumnAtSupply(usize),
    /// A row-wire touches the next one. It shows where wires have a lead or a switch.
    RowsTouch(usize),
    /// A column-wire touches the next one. It shows where wires have a lead.
    ColumnsTouch(usize),
    /// The converter of columns `first` to `last` always gives its largest count, or 0.
    Stuck {
        /// First column of the converter.
        first: usize,
        /// Its last column.
        last: usize,
        /// Whether it gives its largest count.
        is_high: bool,
    },
}

impl BoardFault {
    /// Changes the ties of the wires, on a board with this supply.
    pub(super) fn change(
        self,
        supply_v: f64,
        rows: &mut [Tie; ROWS],
        columns: &mut [Tie; COLUMNS],
    ) {
        let held = |volt| Tie::Held { volt, through_ohm: 0.0 };
        match self {
            Self::RowOpen(row) => rows[row] = Tie::Floating,
            Self::RowAtGround(row) => rows[row] = held(0.0),
            Self::RowAtSupply(row) => rows[row] = held(supply_v),
            Self::ColumnOpen(column) => columns[column] = Tie::Floating,
            Self::ColumnAtGround(column) => columns[column] = held(0.0),
            Self::ColumnAtSupply(column) => columns[column] = held(supply_v),
            Self::RowsTouch(_) | Self::ColumnsTouch(_) | Self::Stuck { .. } => {}
        }
    }

    /// Wires that touch: rows, then columns behind them.
    pub(super) fn link(self) -> Option<([usize; 2], f64)> {
        match self {
            Self::RowsTouch(row) => Some(([row, row + 1], TOUCH_S)),
            Self::ColumnsTouch(column) => Some(([ROWS + column, ROWS + column + 1], TOUCH_S)),
            _ => None,
        }
    }

    /// Voltage at which the op-amp of `column` is stuck, because its wire is held at another than its own.
    pub(super) fn op_amp_v(self, column: usize, supply_v: f64) -> Option<f64> {
        match self {
            Self::ColumnAtGround(wire) if wire == column => Some(supply_v),
            Self::ColumnAtSupply(wire) if wire == column => Some(0.0),
            _ => None,
        }
    }

    /// Whether the converter of `column` is stuck at its largest count.
    pub(super) fn stuck_high(self, column: usize) -> Option<bool> {
        match self {
            Self::Stuck { first, last, is_high } if (first..=last).contains(&column) => {
                Some(is_high)
            }
            _ => None,
        }
    }
}
