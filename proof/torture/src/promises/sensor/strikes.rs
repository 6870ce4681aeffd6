//! What strikes a sensor, and how it should be named.

use taxel_data::table::Table;
use taxel_simulate::virtual_board::BoardFault;

use super::{COLUMNS, ROWS, draws};

/// Noise of a struck reading: a hundred times the usual one.
const NOISE: f64 = 0.5;
/// A loose lead is open in one of so many frames.
const LOOSE_ONE_IN: usize = 5;
/// Columns of one converter.
const CHANNELS: usize = 8;

/// A fault of the sensor.
#[derive(Debug, Clone)]
pub enum Strike {
    /// One of the board's wires or converters.
    Board([BoardFault; 1], Vec<String>),
    /// A lead of the board that is open in every fifth frame.
    Loose([BoardFault; 1], String),
    /// A reading with a hundred times the noise; wires count from 0.
    Noisy { row: usize, column: usize },
}

impl Strike {
    /// Faults of the board.
    pub fn faults(&self) -> &[BoardFault] {
        match self {
            Self::Board(fault, _) | Self::Loose(fault, _) => fault,
            Self::Noisy { .. } => &[],
        }
    }

    /// Number of frames of which one is struck.
    pub fn one_in(&self) -> usize {
        if matches!(self, Self::Loose(..)) { LOOSE_ONE_IN } else { 1 }
    }

    /// Names that the diagnosis should give; none where any will do.
    pub fn names(&self) -> Vec<String> {
        match self {
            Self::Board(_, names) => names.clone(),
            Self::Loose(_, name) => vec![name.clone()],
            Self::Noisy { row, column } => vec![format!("r{}c{} noisy", row + 1, column + 1)],
        }
    }

    /// Adds the noise to `readings` in Ω, if that is the fault. No resistance is negative.
    pub fn add_noise(&self, seed: u64, readings: &mut Table) {
        let Self::Noisy { row, column } = self else { return };
        let mut noise = draws(seed);
        for frame in readings.values.chunks_exact_mut(ROWS * COLUMNS) {
            let reading = &mut frame[row * COLUMNS + column];
            *reading = (*reading * (1.0 + NOISE * noise.normal())).max(0.0);
        }
    }
}

/// Every fault of one wire, two neighbours, one converter or one reading that readings can tell.
pub fn all() -> Vec<Strike> {
    let one = |fault, name: String| Strike::Board([fault], vec![name]);
    let loose = |fault, wire: &str, number| {
        Strike::Loose([fault], format!("{wire} {number} intermittently open"))
    };
    let mut strikes = Vec::new();
    for row in 0..ROWS {
        let wire = row + 1;
        strikes.push(one(BoardFault::RowOpen(row), format!("row-wire {wire} open")));
        strikes.push(loose(BoardFault::RowOpen(row), "row-wire", wire));
        strikes
            .push(one(BoardFault::RowAtGround(row), format!("row-wire {wire} shorted to ground")));
        if wire < ROWS {
            let name = format!("row-wires {wire} and {} shorted together", wire + 1);
            strikes.push(one(BoardFault::RowsTouch(row), name));
        }
    }
    for column in 0..COLUMNS {
        let wire = column + 1;
        strikes.push(one(BoardFault::ColumnOpen(column), format!("column-wire {wire} open")));
        strikes.push(loose(BoardFault::ColumnOpen(column), "column-wire", wire));
        let name = format!("column-wire {wire} shorted");
        strikes.push(one(BoardFault::ColumnAtGround(column), name));
        if wire < COLUMNS {
            let name = format!("column-wires {wire} and {} shorted together", wire + 1);
            strikes.push(one(BoardFault::ColumnsTouch(column), name));
        }
    }
    // One input of a converter, or all of one.
    let inputs = (0..COLUMNS).map(|column| (column, column));
    let all = (0..COLUMNS).step_by(CHANNELS);
    let all = all.map(|first| (first, (first + CHANNELS).min(COLUMNS) - 1));
    for (first, last) in inputs.chain(all) {
        for (is_high, what) in [(true, "shorted"), (false, "open")] {
            let names = (first..=last).map(|column| format!("column-wire {} {what}", column + 1));
            strikes
                .push(Strike::Board([BoardFault::Stuck { first, last, is_high }], names.collect()));
        }
    }
    // A wire at the supply saturates all columns: which one it is, readings do not tell.
    let rows = (0..ROWS).map(BoardFault::RowAtSupply);
    let at_supply = rows.chain((0..COLUMNS).map(BoardFault::ColumnAtSupply));
    strikes.extend(at_supply.map(|fault| Strike::Board([fault], vec![])));
    let noisy = |at| Strike::Noisy { row: at / COLUMNS, column: at % COLUMNS };
    strikes.extend((0..ROWS * COLUMNS).map(noisy));
    strikes
}
