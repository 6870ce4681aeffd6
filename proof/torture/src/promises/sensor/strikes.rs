//! What strikes a sensor, and how it should be named.

use taxel_data::random::{Purpose, Random, Stream};
use taxel_data::table::Table;
use taxel_virtual_board::BoardFault;

use super::{COLUMNS, ROWS};

/// Noise of a struck reading: a hundred times the usual one.
const NOISE: f64 = 0.5;
/// A loose lead is open in one of so many frames.
const LOOSE_ONE_IN: usize = 5;
/// Columns of one converter.
const CHANNELS: usize = 8;

/// A fault of the sensor.
#[derive(Debug, Clone)]
pub struct Strike {
    /// What strikes the board, if anything does.
    pub fault: Option<BoardFault>,
    /// Number of frames of which one is struck.
    pub one_in: usize,
    /// Row and column, from 0, of a reading with a hundred times the noise.
    noisy: Option<(usize, usize)>,
    /// Names that the diagnosis should give; none where any will do.
    pub names: Vec<String>,
}

impl Strike {
    /// One of the board's wires or converters.
    fn new(fault: BoardFault, names: Vec<String>) -> Self {
        Self { fault: Some(fault), one_in: 1, noisy: None, names }
    }

    /// Adds the noise to `readings` in Ω, if that is the fault. No resistance is negative.
    pub fn add_noise(&self, seed: u64, readings: &mut Table) {
        let Some((row, column)) = self.noisy else { return };
        let mut noise = Random::new(seed, Stream::Test, Purpose::AdcNoise, 0, 0);
        for frame in readings.values.chunks_exact_mut(ROWS * COLUMNS) {
            let reading = &mut frame[row * COLUMNS + column];
            *reading = (*reading * (1.0 + NOISE * noise.normal())).max(0.0);
        }
    }
}

/// Every fault of one wire, two neighbours, one converter or one reading that readings can tell.
pub fn all() -> Vec<Strike> {
    let one = |fault, name: String| Strike::new(fault, vec![name]);
    let loose = |fault, wire: &str, number| {
        let strike = one(fault, format!("{wire} {number} intermittently open"));
        Strike { one_in: LOOSE_ONE_IN, ..strike }
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
            let fault = BoardFault::Stuck { first, last, is_high };
            strikes.push(Strike::new(fault, names.collect()));
        }
    }
    // A wire at the supply saturates all columns: which one it is, readings do not tell.
    let rows = (0..ROWS).map(BoardFault::RowAtSupply);
    let at_supply = rows.chain((0..COLUMNS).map(BoardFault::ColumnAtSupply));
    strikes.extend(at_supply.map(|fault| Strike::new(fault, vec![])));
    let noisy = |at: usize| {
        let (row, column) = (at / COLUMNS, at % COLUMNS);
        let names = vec![format!("r{}c{} noisy", row + 1, column + 1)];
        Strike { fault: None, one_in: 1, noisy: Some((row, column)), names }
    };
    strikes.extend((0..ROWS * COLUMNS).map(noisy));
    strikes
}
