//! Forward model over a file: deformations in, ideal readings out.

use rayon::prelude::*;
use taxel_data::error::Problem;
use taxel_data::{DataFile, LANES, widest};

use crate::sensor::{LaneModel, Precision, Scratch};
use crate::world::World;

/// Ideal readings in Ω of the rows that `world` reads, for the deformations in `file`: `lines ×
/// readings`, line after line.
///
/// A missing deformation makes its row's readings NaN.
///
/// # Errors
/// [`Error::File`](taxel_data::Error::File) for a column that is missing, or a deformation for which the
/// model does not hold.
pub fn forward(world: &World, file: &DataFile) -> taxel_data::Result<Vec<f64>> {
    let sensor = &world.sensor;
    let mut columns = Vec::new();
    for row in &world.read_rows {
        let names = sensor.deformation_names(*row);
        columns.push(file.columns(names.iter().map(String::as_str))?);
    }
    let most_mm = sensor.largest_deformation_mm();
    for line in 0..file.lines() {
        for &column in columns.iter().flatten() {
            let value = file.value(line, column);
            // A missing deformation passes: its row's readings will be missing.
            if !value.is_nan() && !sensor.holds_for(value) {
                let problem = Problem::OutOfBound {
                    line: file.line_number(line),
                    column: file.header[column].clone(),
                    value,
                    bound: most_mm,
                    bound_of: "what the sensor model holds for, 20 % of the thickness",
                    unit: "mm",
                };
                return Err(taxel_data::Error::file(&file.path, problem));
            }
        }
    }
    let forward = Forward { world, file, columns: &columns, model: LaneModel::new(sensor) };
    let of_a_line = world.read_rows.len() * sensor.column_wires;
    let mut readings = vec![0.0; file.lines() * of_a_line];
    let pieces = readings.par_chunks_mut(LANES * of_a_line).enumerate();
    pieces.for_each_init(Scratch::default, |scratch, (piece, readings)| {
        let first = piece * LANES;
        widest!(forward.lines(scratch, first, readings));
    });
    Ok(readings)
}

struct Forward<'a> {
    world: &'a World,
    file: &'a DataFile,
    /// Indices in the file of each row's deformations, by electrode and axis.
    columns: &'a [Vec<usize>],
    model: LaneModel<'a>,
}

impl Forward<'_> {
    /// Computes the lines from number `first` on, at most [`LANES`].
    #[inline(always)]
    fn lines(&self, scratch: &mut Scratch, first: usize, readings: &mut [f64]) {
        let Self { world, file, columns, model } = self;
        let (rows, column_wires) = (world.read_rows.len(), world.sensor.column_wires);
        let lines = readings.len() / (rows * column_wires);
        let mut deformation_mm = vec![[[0.0; LANES]; 3]; columns[0].len() / 3];
        let mut resistance_ohm = vec![[0.0; LANES]; column_wires];
        for (place, (&row, columns)) in world.read_rows.iter().zip(*columns).enumerate() {
            for (lanes, column) in deformation_mm.as_flattened_mut().iter_mut().zip(columns) {
                for (line, value) in lanes[..lines].iter_mut().enumerate() {
                    *value = file.value(first + line, *column);
                }
            }
            model.row_column_resistance_ohm(
                row,
                Precision::F64,
                &deformation_mm,
                scratch,
                &mut resistance_ohm,
            );
            let of_lines = readings.chunks_exact_mut(column_wires).skip(place).step_by(rows);
            for (line, readings) in of_lines.enumerate() {
                for (place, lanes) in readings.iter_mut().zip(&resistance_ohm) {
                    *place = lanes[line];
                }
            }
        }
    }
}
