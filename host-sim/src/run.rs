//! The main job: synthesise, train, write the blob, read it back, decode, evaluate.

use serde::Serialize;

use crate::columns;
use crate::dataset::{Dataset, Table};
use crate::error::Result;
use crate::evaluate::metrics::{self, Errors, Measure};
use crate::evaluate::table1::{self, Table1, side_by_side};
use crate::infer::Kernel;
use crate::model::{self, LoadedModel, Origin};
use crate::progress::Progress;
use crate::random::Stream;
use crate::scene::Scene;
use crate::synth;
use crate::train;
use crate::train::linear::LinearDecoder;

/// All that a run measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunResult {
    /// What was run.
    pub scene: SceneSummary,
    /// What was trained.
    pub model: ModelSummary,
    /// Errors on the test frames, by decoder and group.
    pub decoders: Vec<DecoderErrors>,
    /// The network's errors by row-wire.
    pub rows: Vec<RowErrors>,
    /// One test frame, for a closer look.
    pub example: Example,
    /// Table 1, if the scene asks for it.
    pub table1: Option<Table1>,
}

/// What was run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SceneSummary {
    /// Its name.
    pub name: String,
    /// CRC-64/XZ of its text, in hexadecimal.
    pub digest: String,
    /// Seed of every draw.
    pub seed: u64,
    /// `relative` or `span`.
    pub noise_kind: String,
    /// Level p, as a fraction.
    pub noise_level: f64,
    /// Extent of the sensor in mm.
    pub size_mm: [f64; 3],
    /// Row-wires of the sensor, read or not.
    pub row_wires: usize,
}

/// What was trained.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelSummary {
    /// Frames trained on.
    pub training_frames: usize,
    /// Frames evaluated on.
    pub test_frames: usize,
    /// Networks in the blob.
    pub networks: usize,
    /// Inputs of each network: its row's readings, or features of all readings.
    pub inputs: usize,
    /// Readings that are projected to these features; 0 without a projection.
    pub projected_readings: usize,
    /// Centres of each network (the largest).
    pub centres: usize,
    /// Outputs of each network.
    pub outputs: usize,
    /// Width σ on scaled inputs.
    pub spread: f64,
    /// Whether A·x is added.
    pub affine_tail: bool,
    /// Bytes of the blob.
    pub blob_bytes: usize,
    /// CRC-32 of the blob, in hexadecimal.
    pub blob_crc: String,
}

/// Errors of one decoder.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DecoderErrors {
    /// `network`, `linear` (best linear decoder) or `mean` (training mean).
    pub decoder: String,
    /// Errors by group.
    pub errors: Vec<Errors>,
}

/// Errors of the network on one row-wire.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RowErrors {
    /// Row-wire, from 1.
    pub row_wire: usize,
    /// Errors by group.
    pub errors: Vec<Errors>,
}

/// One test frame: the one with the largest output of all.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Example {
    /// Its number among the test frames.
    pub frame: usize,
    /// x and y at rest of every electrode that is decoded, in mm, row-wire after row-wire.
    pub electrodes_mm: Vec<[f64; 2]>,
    /// Row-wires that are read.
    pub row_wires: usize,
    /// One entry a group of outputs.
    pub outputs: Vec<ExampleOutput>,
    /// Row-wire (from 1) whose readings are shown: the most disturbed one.
    pub reading_row_wire: usize,
    /// Its readings without noise, in Ω, by column-wire.
    pub ideal_ohm: Vec<f64>,
    /// Its readings as they were decoded.
    pub noisy_ohm: Vec<f64>,
}

/// One component of the example's outputs, electrode after electrode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExampleOutput {
    /// `dz_mm` and the like.
    pub group: String,
    /// Unit of the values.
    pub unit: String,
    /// What was true.
    pub truth: Vec<f64>,
    /// What was decoded.
    pub estimate: Vec<f64>,
}

/// Runs `scene`; also returns the blob.
///
/// # Errors
/// [`Error`](crate::Error) for a scene that asks for the impossible.
pub fn run(scene: &Scene, progress: &Progress) -> Result<(RunResult, Vec<u8>)> {
    let t = &scene.training;
    progress.stage("synthesise", 2);
    let training = synth::synthesise(scene, Stream::Training, t.frames);
    progress.step();
    let test = synth::synthesise(scene, Stream::Test, t.test_frames);
    progress.step();

    let options = model::options_of(scene);
    let trained = train::train(&training, &options, progress)?;

    let origin = Origin::of_scene(scene);
    let blob = model::encode(&trained, &training, &origin)?;
    let loaded = LoadedModel::from_bytes("model.bin".as_ref(), &blob)?;

    progress.stage("decode and evaluate", 1);
    let estimate = loaded.decode(Kernel::default(), &test.inputs);
    let measure = Measure { full_scale: origin.full_scale, thickness_mm: origin.thickness_mm };
    let baselines = [("linear", LinearDecoder::fit as fn(&_) -> _), ("mean", LinearDecoder::mean)];
    let mut decoders = vec![DecoderErrors {
        decoder: "network".into(),
        errors: metrics::by_group(&test.outputs, &estimate.values, &measure),
    }];
    for (name, fit) in baselines {
        let answers = baseline(fit, &training, &test);
        let errors = metrics::by_group(&test.outputs, &answers, &measure);
        decoders.push(DecoderErrors { decoder: name.into(), errors });
    }
    progress.step();

    let model = loaded.model();
    let shape = model.shape();
    let network = trained.networks[0].network().shape();
    let result = RunResult {
        scene: SceneSummary {
            name: scene.name.clone(),
            digest: format!("{:016x}", scene.digest),
            seed: scene.seed,
            noise_kind: format!("{:?}", scene.noise.kind).to_lowercase(),
            noise_level: scene.noise.level,
            size_mm: scene.sensor.size_mm,
            row_wires: scene.sensor.row_wires,
        },
        model: ModelSummary {
            training_frames: t.frames,
            test_frames: t.test_frames,
            networks: trained.networks.len(),
            inputs: network.inputs,
            projected_readings: model.projection().map_or(0, |_| shape.rows * shape.inputs),
            centres: model.networks().map(|n| n.shape().centres).max().unwrap_or(0),
            outputs: network.outputs,
            spread: t.spread,
            affine_tail: t.affine_tail,
            blob_bytes: blob.len(),
            blob_crc: format!("{:08x}", model.crc()),
        },
        decoders,
        rows: by_row(scene, &test, &estimate, &measure),
        example: example(scene, &test, &estimate),
        table1: scene.table1.is_some().then(|| table1::compute(scene, progress)).transpose()?,
    };
    Ok((result, blob))
}

fn baseline(
    fit: fn(&crate::dataset::Block) -> LinearDecoder,
    training: &Dataset,
    test: &Dataset,
) -> Vec<f64> {
    let rows = 0..training.rows;
    let answers: Vec<Vec<f64>> =
        rows.map(|row| fit(&training.block(row)).predict(&test.block(row))).collect();
    side_by_side(&answers.iter().map(Vec::as_slice).collect::<Vec<_>>(), test)
}

fn by_row(scene: &Scene, test: &Dataset, estimate: &Table, measure: &Measure) -> Vec<RowErrors> {
    let width = test.outputs.names.len() / test.rows;
    let errors = |row: usize| {
        let from = row * width;
        let measure = Measure {
            full_scale: measure.full_scale[from..from + width].to_vec(),
            ..measure.clone()
        };
        let estimate = estimate.columns(from, width).values;
        metrics::by_group(&test.outputs.columns(from, width), &estimate, &measure)
    };
    let rows = scene.read_rows.iter().enumerate();
    rows.map(|(row, wire)| RowErrors { row_wire: wire + 1, errors: errors(row) }).collect()
}

fn example(scene: &Scene, test: &Dataset, estimate: &Table) -> Example {
    let largest = |line: &[f64]| line.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    let frame = (0..test.frames())
        .max_by(|a, b| {
            let peak = |i: usize| largest(test.outputs.lines().nth(i).unwrap_or_default());
            peak(*a).total_cmp(&peak(*b))
        })
        .unwrap_or(0);
    let truth = test.outputs.lines().nth(frame).unwrap_or_default();
    let decoded = estimate.lines().nth(frame).unwrap_or_default();
    let groups = columns::groups(&test.outputs.names).into_iter();
    let outputs = groups.map(|(group, members)| ExampleOutput {
        group: group.into(),
        unit: columns::unit_of(group).into(),
        truth: members.iter().map(|column| truth[*column]).collect(),
        estimate: members.iter().map(|column| decoded[*column]).collect(),
    });
    let ideal = synth::ideal_readings(scene, Stream::Test, frame);
    let noisy = test.inputs.lines().nth(frame).unwrap_or_default();
    let column_wires = scene.sensor.column_wires;
    let of_row =
        |line: &[f64], row: usize| line[row * column_wires..(row + 1) * column_wires].to_vec();
    let width = truth.len() / scene.read_rows.len();
    let row = (0..scene.read_rows.len())
        .max_by(|a, b| {
            let peak = |row: usize| largest(&truth[row * width..(row + 1) * width]);
            peak(*a).total_cmp(&peak(*b))
        })
        .unwrap_or(0);
    Example {
        frame,
        electrodes_mm: scene
            .read_rows
            .iter()
            .flat_map(|row| scene.sensor.row_electrodes_mm(*row))
            .map(|[x, y, _]| [*x, *y])
            .collect(),
        row_wires: scene.read_rows.len(),
        outputs: outputs.collect(),
        reading_row_wire: scene.read_rows[row] + 1,
        ideal_ohm: of_row(&ideal, row),
        noisy_ohm: of_row(noisy, row),
    }
}
