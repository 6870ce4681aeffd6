//! Scans of whole tables of readings, by the firmware's scanner on a virtual board.

use model_core::Frame;
use taxel_data::random::Stream;
use taxel_data::table::Table;

use super::board::VirtualBoard;
use super::scanner::SeriesResistance;
use super::{COLUMNS, ROWS};
use crate::error::Result;
use crate::synth::Synthesis;
use crate::world::World;

/// Ideal readings in Ω of all row-wires (`frames × 144`), whichever the world reads, without noise and drift: the
/// input of a board.
#[must_use]
pub fn all_readings(world: &World, frames: usize) -> Table {
    ideal(world).frames(Stream::Test, frames).inputs
}

/// Ideal readings in Ω of all row-wires of the untouched sensor, so many times (`frames × 144`).
#[must_use]
pub fn untouched_readings(world: &World, frames: usize) -> Table {
    ideal(world).untouched().frames(Stream::Test, frames).inputs
}

fn ideal(world: &World) -> Synthesis<'_> {
    Synthesis::of(world).ideal().drift(None).all_rows()
}

/// Scans every line of `readings` (Ω, all row-wires) by the firmware's scanner on `board`.
///
/// Returns the readings in Ω as the scanner computes them, one line a scan.
///
/// # Errors
/// [`Error::Board`](crate::Error::Board) if the board refused a transaction.
pub fn scan(board: &VirtualBoard, series: SeriesResistance, readings: &Table) -> Result<Table> {
    let mut scanner = board.scanner(series);
    let settings = board.scan_settings();
    let mut frame = Frame::<ROWS, COLUMNS>::missing();
    let mut values = Vec::with_capacity(readings.values.len());
    for line in readings.lines() {
        board.set_readings(line);
        scanner.scan(settings, &mut frame);
        let scanned = frame.row_column_resistance_ohm.as_flattened();
        values.extend(scanned.iter().map(|ohm| f64::from(*ohm)));
    }
    board.check()?;
    Ok(Table { names: readings.names.clone(), values })
}

/// Columns of `readings` of the row-wires that `world` reads: the inputs of its models.
#[must_use]
pub fn rows_read(world: &World, readings: &Table) -> Table {
    let columns = world.sensor.column_wires;
    let rows = |line: &[f64]| -> Vec<f64> {
        let row = |row: &usize| line[row * columns..(row + 1) * columns].to_vec();
        world.read_rows.iter().flat_map(row).collect()
    };
    Table { names: world.reading_names(), values: readings.lines().flat_map(rows).collect() }
}
