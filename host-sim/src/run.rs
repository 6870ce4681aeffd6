//! Main job: synthesise, train, write the blob, read it back, decode, evaluate.

use serde::Serialize;
use taxel_data::columns;
use taxel_data::dataset::Dataset;
use taxel_data::progress::Progress;
use taxel_data::random::Stream;
use taxel_data::table::Table;
use taxel_learn::cost::{Cost, Design, Prices};
use taxel_learn::decoders::BASELINES;
use taxel_learn::{Decoder, Exponential, ModelBlob, PreparedModel};
use taxel_simulate::outputs::Outputs;
use taxel_simulate::{Synthesis, World};

use crate::by_depth::{DepthErrors, by_depth};
use crate::error::Result;
use crate::evaluate::table1::{self, Table1};
use crate::experiment::Experiment;
use crate::metrics::{self, DecoderErrors, Errors, LimitSummary, Measure};
use crate::training_set::TrainingSet;

/// Results of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunResult {
    /// Scene that was run.
    pub scene: SceneSummary,
    /// Model that was trained.
    pub model: ModelSummary,
    /// Errors on the test frames, by decoder and group.
    pub decoders: Vec<DecoderErrors>,
    /// Least possible errors, of a decoder that sees all readings of a frame.
    pub limit: LimitSummary,
    /// Errors of the network by the depth of the contact, if that is an output.
    pub by_depth: Vec<DepthErrors>,
    /// Errors of the network by row-wire; nothing for outputs that belong to no row-wire.
    pub rows: Vec<RowErrors>,
    /// One test frame, for a closer look.
    pub example: Example,
    /// Table 1, if the scene asks for it.
    pub table1: Option<Table1>,
}

/// Summary of the scene that was run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SceneSummary {
    /// Name of the scene.
    pub name: String,
    /// CRC-64/XZ of its text, in hexadecimal.
    pub digest: String,
    /// Seed of every random draw.
    pub seed: u64,
    /// Kind of noise: `relative` or `span`.
    pub noise_kind: String,
    /// Noise level p, as a fraction.
    pub noise_level: f64,
    /// Largest relative change of a drifting gain; 0 without drift.
    pub gain_drift: f64,
    /// Extent of the sensor in mm.
    pub size_mm: [f64; 3],
    /// Number of row-wires of the sensor, read or not.
    pub row_wires: usize,
}

/// Summary of the model that was trained.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelSummary {
    /// Number of frames trained on.
    pub training_frames: usize,
    /// Number of frames evaluated on.
    pub test_frames: usize,
    /// Number of networks in the blob.
    pub networks: usize,
    /// Number of inputs of each network: its row's readings, or features of all readings.
    pub inputs: usize,
    /// Number of readings that are projected to these features; 0 without a projection.
    pub projected_readings: usize,
    /// Whether inputs are readings relative to the baseline.
    pub relative_inputs: bool,
    /// Number of centres of each network (the largest).
    pub centres: usize,
    /// Number of outputs of each network: its row's outputs, those of all rows, or components of these.
    pub outputs: usize,
    /// Number of outputs that such components are expanded to; 0 without an expansion.
    pub expanded_outputs: usize,
    /// Width σ on scaled inputs; after refinement the mean over the networks.
    pub spread: f64,
    /// Whether centres, widths and the projection were refined after K-means.
    pub refined: bool,
    /// Whether the networks add an affine tail A·x.
    pub affine_tail: bool,
    /// Size of the blob.
    pub blob_bytes: usize,
    /// CRC-32 of the blob, in hexadecimal.
    pub blob_crc: String,
    /// What decoding a frame costs a Cortex-M4F, without a gate.
    pub frame: Cost,
}

/// Errors of the network on one row-wire.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RowErrors {
    /// Row-wire, from 1.
    pub row_wire: usize,
    /// Errors by group.
    pub errors: Vec<Errors>,
}

/// Example: the test frame with the largest output of all.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Example {
    /// Index of the frame (from 0) among the test frames.
    pub frame: usize,
    /// Position x and y at rest of every electrode that is decoded, in mm, row-wire after row-wire.
    pub electrodes_mm: Vec<[f64; 2]>,
    /// Number of row-wires that are read.
    pub row_wires: usize,
    /// Outputs of the frame by group.
    pub outputs: Vec<ExampleOutput>,
    /// Row-wire (from 1) whose readings are shown: that of the largest output, or else the one whose readings change
    /// most.
    pub reading_row_wire: usize,
    /// Readings of that row-wire without noise, in Ω, by column-wire.
    pub ideal_ohm: Vec<f64>,
    /// Readings of that row-wire as they were decoded, in Ω, by column-wire.
    pub noisy_ohm: Vec<f64>,
}

/// One component of the example's outputs, electrode after electrode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExampleOutput {
    /// Name of the group, such as `dz_mm`.
    pub group: String,
    /// Unit of the values.
    pub unit: String,
    /// True values.
    pub truth: Vec<f64>,
    /// Decoded values.
    pub estimate: Vec<f64>,
}

/// Runs `experiment` and returns its results and the blob.
///
/// # Errors
/// [`Error`](crate::Error) for an experiment whose model cannot be trained or packed.
pub fn run(experiment: &Experiment, progress: &dyn Progress) -> Result<(RunResult, ModelBlob)> {
    let (world, t) = (&experiment.world, &experiment.training);
    progress.stage("synthesise", 2);
    let synthesis = Synthesis::of(world);
    let training = TrainingSet::of_scene(experiment, synthesis.clone());
    progress.step();
    let test = experiment.dataset(&synthesis, Stream::Test, t.test_frames);
    progress.step();

    let blob = training.blob(&experiment.options(), progress)?;
    let network = blob.prepare(Exponential::default()).of_inputs();

    let (measure, limit) =
        experiment.measure_beside_limit(world.noise.level, t.test_frames, progress);
    progress.stage("decode and evaluate", 1);
    let baselines: Vec<Box<dyn Decoder>> =
        BASELINES.iter().map(|b| b.fit(&training.frames)).collect();
    let decoders = std::iter::once(&network as &dyn Decoder)
        .chain(baselines.iter().map(AsRef::as_ref))
        .map(|decoder| metrics::judge(decoder, &test, &measure))
        .collect();
    let estimate = network.decode_table(&test.inputs);
    progress.step();

    let result = RunResult {
        scene: scene_summary(experiment),
        model: model_summary(experiment, &network, &blob)?,
        decoders,
        limit,
        by_depth: by_depth(&test.outputs, &estimate.values, &measure),
        rows: by_row(world, &test, &estimate, &measure),
        example: example(world, &test, &estimate),
        table1: match experiment.table1 {
            Some(_) => Some(table1::compute(experiment, progress)?),
            None => None,
        },
    };
    drop(network);
    Ok((result, blob))
}

fn scene_summary(experiment: &Experiment) -> SceneSummary {
    let world = &experiment.world;
    SceneSummary {
        name: experiment.name.clone(),
        digest: format!("{:016x}", experiment.digest),
        seed: world.seed,
        noise_kind: world.noise.kind.name().into(),
        noise_level: world.noise.level,
        gain_drift: world.drift.map_or(0.0, |drift| drift.gain),
        size_mm: world.sensor.size_mm,
        row_wires: world.sensor.row_wires,
    }
}

fn model_summary(
    experiment: &Experiment,
    prepared: &PreparedModel<'_>,
    blob: &ModelBlob,
) -> Result<ModelSummary> {
    let (model, t) = (prepared.model(), &experiment.training);
    let shape = model.shape();
    let frames = Prices::accepted()?.frames(&Design::of(blob), Exponential::default())?;
    Ok(ModelSummary {
        training_frames: t.frames,
        test_frames: t.test_frames,
        networks: model.networks().count(),
        inputs: model.projection().map_or(shape.inputs, |it| it.features()),
        projected_readings: model.projection().map_or(0, |_| shape.rows * shape.inputs),
        relative_inputs: model.metadata().relative_inputs,
        centres: model.networks().map(|n| n.shape().centres).max().unwrap_or(0),
        outputs: model.networks().next().map_or(0, |n| n.shape().outputs),
        expanded_outputs: model.expansion().map_or(0, |expansion| expansion.outputs()),
        spread: if t.refine { blob.spread() } else { t.spread },
        refined: t.refine,
        affine_tail: t.affine_tail,
        blob_bytes: blob.bytes().len(),
        blob_crc: format!("{:08x}", model.crc()),
        frame: frames.ungated,
    })
}

fn by_row(world: &World, test: &Dataset, estimate: &Table, measure: &Measure) -> Vec<RowErrors> {
    if let Outputs::Contact(_) = world.outputs {
        return vec![];
    }
    let width = test.outputs.names.len() / test.rows;
    let errors = |row: usize| {
        let from = row * width;
        let measure = Measure {
            full_scale: measure.full_scale[from..from + width].to_vec(),
            limit: measure.limit.as_ref().map(|limit| limit.columns(from, width)),
            ..measure.clone()
        };
        let estimate = estimate.columns(from, width).values;
        metrics::by_group(&test.outputs.columns(from, width), &estimate, &measure)
    };
    let rows = world.read_rows.iter().enumerate();
    rows.map(|(row, wire)| RowErrors { row_wire: wire + 1, errors: errors(row) }).collect()
}

/// Row (from 0, of those that are read) with the largest of the `truth` of a frame. Where outputs belong to no row, it
/// is the one whose `ideal` readings differ most from the `untouched` ones.
fn most_disturbed_row(world: &World, truth: &[f64], [ideal, untouched]: [&[f64]; 2]) -> usize {
    let rows = world.read_rows.len();
    let changes: Vec<f64> = ideal.iter().zip(untouched).map(|(a, b)| a / b - 1.0).collect();
    let by_row = match world.outputs {
        Outputs::Electrodes(_) => truth,
        Outputs::Contact(_) => &changes,
    };
    let peak = |row: &usize| {
        let width = by_row.len() / rows;
        largest(&by_row[row * width..(row + 1) * width])
    };
    (0..rows).max_by(|a, b| peak(a).total_cmp(&peak(b))).unwrap_or(0)
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0_f64, |a, b| a.max(b.abs()))
}

fn example(world: &World, test: &Dataset, estimate: &Table) -> Example {
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
    let synthesis = Synthesis::of(world);
    let noisy = synthesis.readings_of(Stream::Test, frame);
    let synthesis = synthesis.ideal();
    let ideal = synthesis.readings_of(Stream::Test, frame);
    let column_wires = world.sensor.column_wires;
    let of_row =
        |line: &[f64], row: usize| line[row * column_wires..(row + 1) * column_wires].to_vec();
    let untouched = synthesis.untouched().readings_of(Stream::Test, frame);
    let row = most_disturbed_row(world, truth, [&ideal, &untouched]);
    Example {
        frame,
        electrodes_mm: world
            .read_rows
            .iter()
            .flat_map(|row| world.sensor.row_electrodes_mm(*row))
            .map(|[x, y, _]| [*x, *y])
            .collect(),
        row_wires: world.read_rows.len(),
        outputs: outputs.collect(),
        reading_row_wire: world.read_rows[row] + 1,
        ideal_ohm: of_row(&ideal, row),
        noisy_ohm: of_row(&noisy, row),
    }
}
