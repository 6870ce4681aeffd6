//! Synthesis: frames of a scene, seeded, the same on any number of threads.

use rayon::prelude::*;

use crate::data_file::DataFile;
use crate::dataset::Dataset;
use crate::error::{Error, Result};
use crate::random::{Purpose, Random, Stream};
use crate::scene::{Deformation, NoiseKind, Scene, deformation_names};
use crate::sensor::Vector3;

/// Frames that measure a channel's maximum and minimum over the scene, for `span` noise.
const SPAN_FRAMES: usize = 4096;

/// Synthesises `frames` of `stream`: noisy readings and true outputs, of the rows and axes that
/// the scene asks for.
///
/// Frame n is the same however many frames are asked for.
#[must_use]
pub fn synthesise(scene: &Scene, stream: Stream, frames: usize) -> Dataset {
    let noise = NoiseSource::new(scene);
    let mut dataset =
        Dataset::empty(scene.reading_names(), scene.output_names(), scene.read_rows.len(), frames);
    let (n, o) = (dataset.inputs.names.len(), dataset.outputs.names.len());
    let (inputs, outputs) = (&mut dataset.inputs.values, &mut dataset.outputs.values);
    let places = inputs.par_chunks_exact_mut(n).zip(outputs.par_chunks_exact_mut(o));
    places.enumerate().for_each(|(frame, (readings, outputs))| {
        ideal_frame(scene, stream, frame, readings, outputs);
        noise.disturb(scene, stream, frame, readings);
    });
    dataset
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
    let rows = scene.read_rows.len();
    let outputs = rows * scene.sensor.electrodes_per_row_wire * scene.outputs.axes.len();
    let mut readings = vec![0.0; rows * scene.sensor.column_wires];
    ideal_frame(scene, stream, frame, &mut readings, &mut vec![0.0; outputs]);
    readings
}

fn ideal_frame(
    scene: &Scene,
    stream: Stream,
    frame: usize,
    readings: &mut [f64],
    outputs: &mut [f64],
) {
    let sensor = &scene.sensor;
    let contact = Contact::draw(scene, stream, frame);
    let mut deformation_mm = vec![[0.0; 3]; sensor.electrodes_per_row_wire];
    let per_row = sensor.electrodes_per_row_wire * scene.outputs.axes.len();
    let places = readings
        .chunks_exact_mut(sensor.column_wires)
        .zip(outputs.chunks_exact_mut(per_row))
        .zip(&scene.read_rows);
    for ((readings, outputs), &row) in places {
        match (&contact, &scene.deformation) {
            (Some(contact), _) => {
                contact.deform(sensor.row_electrodes_mm(row), &mut deformation_mm);
            }
            (None, Deformation::Independent { dx_mm, dy_mm, dz_mm }) => {
                let mut random = source(scene, stream, Purpose::Deformation, frame, row);
                deformation_mm
                    .fill_with(|| [dx_mm, dy_mm, dz_mm].map(|range| random.between(*range)));
            }
            (None, Deformation::Press { .. }) => unreachable!("a press has a contact"),
        }
        sensor.row_column_resistance_ohm(row, &deformation_mm, readings);
        let values = deformation_mm.iter().flat_map(|delta| scene.electrode_outputs(*delta));
        outputs.iter_mut().zip(values).for_each(|(place, value)| *place = value);
    }
}

fn source(scene: &Scene, stream: Stream, purpose: Purpose, frame: usize, row: usize) -> Random {
    Random::new(scene.seed, stream, purpose, frame as u64, row as u64)
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
    let mut readings = vec![0.0; file.lines() * scene.read_rows.len() * sensor.column_wires];
    let lines = readings.par_chunks_exact_mut(scene.read_rows.len() * sensor.column_wires);
    lines.enumerate().for_each(|(line, readings)| {
        let rows = readings.chunks_exact_mut(sensor.column_wires).zip(&scene.read_rows);
        for ((readings, &row), columns) in rows.zip(&columns) {
            let component = |i: usize| file.value(line, columns[i]);
            let deformation_mm: Vec<Vector3> =
                (0..electrodes).map(|e| [0, 1, 2].map(|axis| component(3 * e + axis))).collect();
            sensor.row_column_resistance_ohm(row, &deformation_mm, readings);
        }
    });
    Ok(readings)
}

/// One contact pressed into the face.
struct Contact {
    centre_mm: [f64; 2],
    dent_radius_mm: f64,
    dent_depth_mm: f64,
    /// Δx/Δz and Δy/Δz.
    shear: [f64; 2],
}

impl Contact {
    fn draw(scene: &Scene, stream: Stream, frame: usize) -> Option<Self> {
        let Deformation::Press { dent_radius_mm, dent_depth_mm, shear_ratio } = scene.deformation
        else {
            return None;
        };
        let mut random = source(scene, stream, Purpose::Contact, frame, 0);
        let [x_mm, y_mm, _] = scene.sensor.size_mm;
        let centre_mm = [random.between([0.0, x_mm]), random.between([0.0, y_mm])];
        let dent_radius_mm = random.between(dent_radius_mm);
        let dent_depth_mm = random.between(dent_depth_mm);
        let ratio = random.between(shear_ratio);
        let angle_rad = random.between([0.0, std::f64::consts::TAU]);
        let shear = [ratio * libm::cos(angle_rad), ratio * libm::sin(angle_rad)];
        Some(Self { centre_mm, dent_radius_mm, dent_depth_mm, shear })
    }

    fn deform(&self, electrodes_mm: &[Vector3], deformation_mm: &mut [Vector3]) {
        for (delta, [x, y, _]) in deformation_mm.iter_mut().zip(electrodes_mm) {
            let squared = (x - self.centre_mm[0]).powi(2) + (y - self.centre_mm[1]).powi(2);
            let dz = self.dent_depth_mm
                * libm::exp(-squared / (2.0 * self.dent_radius_mm * self.dent_radius_mm));
            *delta = [self.shear[0] * dz, self.shear[1] * dz, dz];
        }
    }
}

/// Adds a scene's noise to ideal readings.
struct NoiseSource {
    /// Span of every channel that is read, in Ω; empty for relative noise.
    span_ohm: Vec<f64>,
}

impl NoiseSource {
    fn new(scene: &Scene) -> Self {
        let span_ohm = match scene.noise.kind {
            NoiseKind::Span if scene.noise.level > 0.0 => {
                let ideal = synthesise_ideal(scene, Stream::Span, SPAN_FRAMES);
                ideal.inputs.ranges().into_iter().map(|[low, high]| high - low).collect()
            }
            _ => Vec::new(),
        };
        Self { span_ohm }
    }

    fn disturb(&self, scene: &Scene, stream: Stream, frame: usize, readings: &mut [f64]) {
        let level = scene.noise.level;
        if level == 0.0 {
            return;
        }
        let columns = scene.sensor.column_wires;
        for (place, (&row, readings)) in
            scene.read_rows.iter().zip(readings.chunks_exact_mut(columns)).enumerate()
        {
            let mut random = source(scene, stream, Purpose::Noise, frame, row);
            for (column, reading) in readings.iter_mut().enumerate() {
                let scale_ohm = match self.span_ohm.get(place * columns + column) {
                    Some(span) => *span,
                    None => *reading,
                };
                *reading += level * scale_ohm * random.normal();
            }
        }
    }
}

#[cfg(test)]
mod tests;
