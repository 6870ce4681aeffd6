//! Scans of whole tables of readings, by the firmware's scanner on a virtual board.

use taxel_data::{Result, Stream, Table};

use super::board::VirtualBoard;
use super::scanner::SeriesResistance;
use taxel_simulate::synth::Synthesis;
use taxel_simulate::world::World;

/// Ideal readings in Ω of all row-wires of the sensor, whichever the world reads, without noise and drift: the input
/// of a board.
pub fn all_readings(world: &World, frames: usize) -> Table {
    Synthesis::new(world).ideal().drift(None).all_rows().frames(Stream::Test, frames).inputs
}

/// Scans every line of `readings` (Ω, all row-wires) by the firmware's scanner on `board`.
///
/// Returns the readings in Ω of the rows that the board's world reads, as the scanner computes them, one line a scan.
pub fn scan(board: &VirtualBoard, series: SeriesResistance, readings: &Table) -> Result<Table> {
    let mut scanner = board.scanner(series);
    let (settings, wires) = (board.scan_settings(), board.wires());
    let names = wires.rows.iter().flat_map(|row| {
        let of_row = &readings.names[row.0 * wires.columns.count()..];
        wires.columns.pick(of_row).cloned()
    });
    let names: Vec<String> = names.collect();
    let mut frame = vec![f32::NAN; names.len()];
    let mut values = Vec::with_capacity(readings.len() * frame.len());
    for line in readings.lines() {
        board.set_readings(line);
        scanner.scan(settings, wires, &mut frame);
        values.extend(frame.iter().map(|ohm| f64::from(*ohm)));
    }
    board.check()?;
    Ok(Table { names, values })
}
