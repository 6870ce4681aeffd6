//! Frames for a model, ordinary and hostile, and what taxel-core makes of each: the file that the harness reads.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use taxel_core::blob::ModelShape;
use taxel_core::health::{Health, Limits};
use taxel_core::relative::reciprocal;
use taxel_core::{Decoder, Frame, OwnedEstimate, RowStatus};

use super::models::Model;
use crate::process::Outcome;

/// Most rows of a model.
const MOST_ROWS: usize = 255;

/// Frames for each baseline.
const GROUP: usize = 1000;

/// Numbers that a reading may be instead of what it was.
const HOSTILE: [f32; 16] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    f32::MIN_POSITIVE,
    1e-45,
    0.0,
    -0.0,
    -60.0,
    1e10,
    3e20,
    4.999_999_5,
    5.0,
    1_000.0,
    1_000.000_1,
];

/// Numbers without order, by a linear congruence.
struct Draw(u64);

impl Draw {
    fn below(&mut self, bound: usize) -> usize {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % bound
    }
}

/// Writes the first `count` frames of `model` to `path`, with what is expected of each. If they are to be `hostile`, about
/// half of them are changed.
pub fn write(model: &Model, count: usize, hostile: bool, path: &Path) -> Outcome {
    let failed = |cause: std::io::Error| format!("{}: {cause}", path.display());
    let mut file = BufWriter::new(File::create(path).map_err(failed)?);
    let readings = model.baseline.len();
    let frames: Vec<&[f64]> = model.frames.chunks_exact(readings).take(count).collect();
    let mut draw = hostile.then_some(Draw(1));
    for (group, frames) in frames.chunks(GROUP).enumerate() {
        let mut baseline: Vec<f32> = model.baseline.iter().map(|it| *it as f32).collect();
        if let Some(draw) = draw.as_mut().filter(|_| group % 3 == 2) {
            // Some channels without a baseline.
            for unusable in [f32::NAN, 0.0, -60.0, 1e-45, f32::INFINITY].iter().take(group % 6) {
                baseline[draw.below(readings)] = *unusable;
            }
        }
        let bytes = group_bytes(model, &baseline, frames, draw.as_mut())?;
        file.write_all(&bytes).map_err(failed)?;
    }
    let end: Vec<u8> = [0, frames.len() as u32].into_iter().flat_map(u32::to_le_bytes).collect();
    file.write_all(&end).and_then(|()| file.flush()).map_err(failed)
}

/// A baseline, and frames with what is expected of each.
fn group_bytes(
    model: &Model,
    baseline: &[f32],
    frames: &[&[f64]],
    mut draw: Option<&mut Draw>,
) -> Outcome<Vec<u8>> {
    let model = model.blob.parse();
    let decoder = Decoder::<MOST_ROWS>::new(model).map_err(|cause| cause.to_string())?;
    let mut believed = baseline.to_vec();
    Health::new(&mut believed, baseline.len(), Limits::USUAL, &mut []);
    let reciprocals: Vec<f32> = believed.iter().map(|it| reciprocal(*it)).collect();
    let mut scratch = vec![0.0; decoder.scratch_floats()];
    let ModelShape { rows, outputs, .. } = decoder.shape();
    let mut estimate = OwnedEstimate {
        outputs: vec![0.0; rows * outputs],
        status: vec![RowStatus::Decoded; rows],
    };

    let mut bytes = (frames.len() as u32).to_le_bytes().to_vec();
    put(&mut bytes, baseline);
    for frame in frames {
        let mut readings: Vec<f32> = frame.iter().map(|reading| *reading as f32).collect();
        if let Some(draw) = draw.as_deref_mut() {
            disturb(&mut readings, draw);
        }
        put(&mut bytes, &readings);
        Health::new(&mut readings, baseline.len(), Limits::USUAL, &mut []);
        let given = Frame { readings_ohm: &readings, reciprocals: &reciprocals };
        let clamped = decoder.decode_into(given, &mut scratch, &mut estimate.borrowed());
        bytes.extend(u32::from(clamped.map_err(|cause| cause.to_string())?).to_le_bytes());
        put(&mut bytes, &estimate.outputs);
        bytes.extend(estimate.status.iter().map(|status| *status as u8));
        let mut deviations = vec![0.0; rows * outputs];
        let novelty = decoder.assess_into(given, &mut scratch, &mut deviations);
        if let Some(novelty) = novelty.map_err(|cause| cause.to_string())? {
            put(&mut bytes, &[novelty]);
            put(&mut bytes, &deviations);
        }
        if model.reading_model().is_some() {
            let filled = decoder.fill(&mut readings, &reciprocals, &mut scratch) as u32;
            bytes.extend(filled.to_le_bytes());
            // Which of all NaN comes out is the processor's choice.
            readings.iter_mut().filter(|it| it.is_nan()).for_each(|it| *it = f32::NAN);
            put(&mut bytes, &readings);
        }
    }
    Ok(bytes)
}

fn put(bytes: &mut Vec<u8>, values: &[f32]) {
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
}

/// Changes about half of all frames: readings missing, hostile or far beyond training.
fn disturb(readings: &mut [f32], draw: &mut Draw) {
    let count = readings.len();
    match draw.below(8) {
        0 => readings[draw.below(count)] = HOSTILE[draw.below(HOSTILE.len())],
        1 => {
            for _ in 0..=draw.below(count) / 3 {
                readings[draw.below(count)] = HOSTILE[draw.below(HOSTILE.len())];
            }
        }
        2 => {
            let factor = [0.01, 0.5, 0.9, 1.2, 3.0, 100.0][draw.below(6)];
            readings[draw.below(count)] *= factor;
        }
        3 => {
            let factor = [0.8, 0.95, 1.05, 1.3][draw.below(4)];
            readings.iter_mut().for_each(|reading| *reading *= factor);
        }
        _ => {}
    }
}
