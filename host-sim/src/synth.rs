//! Synthesis: frames of a scene, seeded, the same on any number of threads.

use rayon::prelude::*;

use crate::data_file::DataFile;
use crate::dataset::Dataset;
use crate::error::{Error, Result};
use crate::random::Stream;
use crate::scene::{NoiseKind, Scene, deformation_names};
use crate::sensor::{BlockModel, Scratch};
use crate::simd::{self, LANES};

mod block;

use block::Synthesis;

/// Frames that measure a channel's maximum and minimum over the scene, for `span` noise.
const SPAN_FRAMES: usize = 4096;

/// Synthesises `frames` of `stream`: noisy readings and true outputs, of the rows and axes that
/// the scene asks for.
///
/// Frame n is the same however many frames are asked for.
#[must_use]
pub fn synthesise(scene: &Scene, stream: Stream, frames: usize) -> Dataset {
    let mut dataset =
        Dataset::empty(scene.reading_names(), scene.output_names(), scene.read_rows.len(), frames);
    let (n, o) = (dataset.inputs.names.len(), dataset.outputs.names.len());
    let synthesis = Synthesis::new(scene, stream, noise_span_ohm(scene));
    let readings = dataset.inputs.values.par_chunks_mut(LANES * n);
    let blocks = readings.zip(dataset.outputs.values.par_chunks_mut(LANES * o)).enumerate();
    blocks.for_each_init(
        || synthesis.workspace(),
        |workspace, (block, (readings, outputs))| {
            synthesis.fill(workspace, block * LANES, readings, outputs);
        },
    );
    dataset
}

/// Span of every channel over the scene in Ω, if its noise is measured by that.
fn noise_span_ohm(scene: &Scene) -> Vec<f64> {
    if scene.noise.kind == NoiseKind::Relative || scene.noise.level == 0.0 {
        return Vec::new();
    }
    let ideal = synthesise_ideal(scene, Stream::Span, SPAN_FRAMES);
    ideal.inputs.ranges().into_iter().map(|[low, high]| high - low).collect()
}

/// Synthesises as [`synthesise`] does, without noise.
#[must_use]
pub fn synthesise_ideal(scene: &Scene, stream: Stream, frames: usize) -> Dataset {
    let mut ideal = scene.clone();
    ideal.noise.level = 0.0;
    synthesise(&ideal, stream, frames)
}

/// The ideal readings of one `frame`, by row-wire that is read and column-wire.
#[must_use]
pub fn ideal_readings(scene: &Scene, stream: Stream, frame: usize) -> Vec<f64> {
    let mut ideal = scene.clone();
    ideal.noise.level = 0.0;
    let mut readings = vec![0.0; scene.reading_names().len()];
    let mut outputs = vec![0.0; scene.output_names().len()];
    let synthesis = Synthesis::new(&ideal, stream, Vec::new());
    synthesis.fill(&mut synthesis.workspace(), frame, &mut readings, &mut outputs);
    readings
}

/// Ideal readings of the rows that `scene` reads, for the deformations in `file`, line after line;
/// a missing deformation makes its row's readings NaN.
///
/// # Errors
/// [`Error::Data`] for a column that is missing, or a deformation that the model does not hold for.
pub fn forward(scene: &Scene, file: &DataFile) -> Result<Vec<f64>> {
    let sensor = &scene.sensor;
    let electrodes = sensor.electrodes_per_row_wire;
    let mut columns = Vec::new();
    for row in &scene.read_rows {
        let names = deformation_names(*row, electrodes);
        columns.push(file.columns(names.iter().map(String::as_str))?);
    }
    let most_mm = sensor.largest_deformation_mm();
    for line in 0..file.lines() {
        for &column in columns.iter().flatten() {
            let value = file.value(line, column);
            // A missing one is let pass: its row's readings will be missing.
            if !value.is_nan() && !sensor.holds_for(value) {
                let message = format!(
                    "line {}, column {:?}: {value} mm is beyond what the sensor model holds for, \
                     20 % of the thickness ({most_mm} mm)",
                    file.line_number(line),
                    file.header[column]
                );
                return Err(Error::data(&file.path, message));
            }
        }
    }
    let forward = Forward { scene, file, columns: &columns, model: BlockModel::new(sensor) };
    let of_a_line = scene.read_rows.len() * sensor.column_wires;
    let mut readings = vec![0.0; file.lines() * of_a_line];
    let blocks = readings.par_chunks_mut(LANES * of_a_line).enumerate();
    blocks.for_each_init(Scratch::default, |scratch, (block, readings)| {
        let first = block * LANES;
        simd::widest(
            #[inline(always)]
            || forward.block(scratch, first, readings),
        );
    });
    Ok(readings)
}

struct Forward<'a> {
    scene: &'a Scene,
    file: &'a DataFile,
    /// Where each row's deformations stand in the file, by electrode and axis.
    columns: &'a [Vec<usize>],
    model: BlockModel<'a>,
}

impl Forward<'_> {
    /// The lines from number `first` on, at most [`LANES`].
    #[inline(always)]
    fn block(&self, scratch: &mut Scratch, first: usize, readings: &mut [f64]) {
        let Self { scene, file, columns, model } = self;
        let (rows, column_wires) = (scene.read_rows.len(), scene.sensor.column_wires);
        let lines = readings.len() / (rows * column_wires);
        let mut deformation_mm = vec![[[0.0; LANES]; 3]; columns[0].len() / 3];
        let mut resistance_ohm = vec![[0.0; LANES]; column_wires];
        for (place, (&row, columns)) in scene.read_rows.iter().zip(*columns).enumerate() {
            for (lanes, column) in deformation_mm.as_flattened_mut().iter_mut().zip(columns) {
                for (line, value) in lanes[..lines].iter_mut().enumerate() {
                    *value = file.value(first + line, *column);
                }
            }
            model.row_column_resistance_ohm(
                row,
                scene.precision,
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

#[cfg(test)]
mod tests;
