//! Main job: synthesise or read frames, train, write the blob, read it back, decode, evaluate.

use serde::Serialize;
use taxel_core::rbf::Shape;
use taxel_data::dataset::{LeftOut, UnusedInputs};
use taxel_data::{Dataset, Progress, Stream, Table};
use taxel_learn::cost::{Cost, Design};
use taxel_learn::decoders::mean::Mean;
use taxel_learn::decoders::{BASELINES, centroid};
use taxel_learn::kinds::Choice;
use taxel_learn::outliers::Outliers;
use taxel_learn::{Decoder, ModelBlob, Options, PreparedModel};
use taxel_simulate::Synthesis;
use taxel_simulate::noise::NoiseKind;

use crate::by_load::{LoadErrors, by_load};
use crate::error::Result;
use crate::evaluate::device_cost::DeviceCost;
use crate::evaluate::distribution::{Distribution, Reference};
use crate::evaluate::moving_contacts::MovingContacts;
use crate::experiment::Experiment;
use crate::measurements::Measurements;
use crate::metrics::{self, DecoderErrors, Errors, LimitSummary, Measure};
use crate::others::{self, Others};
use crate::over_time::{Decoded, OverTime, RestOverTime, is_log};
use crate::subject::Subject;
use crate::table1::Table1;
use crate::training_set::TrainingSet;
use crate::verdict::{Verdict, Warning};

mod sketch;

pub use sketch::{RowWire, SensorSketch};

/// Results of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunResult {
    /// What the model is worth, in words.
    pub verdict: Verdict,
    /// Name of the scene or data set.
    pub subject: String,
    /// CRC-64/XZ of its file, in hexadecimal.
    pub scene_digest: String,
    /// Seed of every random draw.
    pub seed: u64,
    /// What only a scene knows; `None` for measurements.
    pub scene: Option<SceneSummary>,
    /// What only measurements have; `None` for a scene.
    pub data: Option<DataSummary>,
    pub model: ModelSummary,
    /// Features that training chose, and what it tried; `None` where there was no choice.
    pub features: Option<Choice>,
    /// What the model asks of a device.
    pub device_cost: DeviceCost,
    /// Errors on the test frames, by decoder and group.
    pub decoders: Vec<DecoderErrors>,
    /// Least possible errors, of a decoder that sees all readings of a frame.
    pub limit: LimitSummary,
    /// Errors by the depth of the contact, or of places by the force; empty for other outputs.
    pub by_load: Vec<LoadErrors>,
    /// Errors on contacts that the model was not trained on; `None` for a scene without a contact, and for measurements.
    pub others: Option<Others>,
    /// Errors of the network by row-wire; nothing for outputs that belong to no row-wire.
    pub by_row: Vec<RowErrors>,
    /// Errors on contacts that move, if the scene has any.
    pub moving: Option<MovingContacts>,
    /// Distribution of the network's errors on the test frames, and frames to look at.
    pub distribution: Distribution,
    /// Table 1, if the scene asks for it and it [was computed](crate::table1::compute).
    pub table1: Option<Table1>,
}

/// Summary of the measurements that were run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DataSummary {
    /// How the test frames were chosen, in words.
    pub test_choice: String,
    /// Values far from all others in their column.
    pub outliers: Outliers,
    /// Lines that lack a value.
    pub lines_left_out: LeftOut,
    /// Inputs that can tell nothing, and are left out.
    pub unused_inputs: UnusedInputs,
    /// Inputs that are left in and never change in training; a network cannot use them.
    pub constant_inputs: Vec<String>,
    /// Errors and readings at rest by time; `None` if lines are in no order of time.
    #[serde(skip)]
    pub over_time: Option<OverTime>,
}

/// Summary of the scene that was run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SceneSummary {
    pub noise_kind: NoiseKind,
    /// Noise level p: a fraction, or in Ω for absolute noise.
    pub noise_level: f64,
    /// Largest relative change of a drifting gain; 0 without drift.
    pub gain_drift: f64,
    /// Extent of the sensor in mm.
    pub size_mm: [f64; 3],
    /// Number of row-wires of the sensor, read or not.
    pub row_wires: usize,
    /// Wires and electrodes of the sensor; `None` for too many to draw.
    #[serde(skip)]
    pub sensor: Option<SensorSketch>,
}

/// Summary of the model that was trained.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelSummary {
    pub training_frames: usize,
    pub test_frames: usize,
    pub networks: usize,
    /// Numbers of inputs of the networks: of readings of a row, or of features of all readings. One number if all have it.
    pub inputs_per_network: Vec<usize>,
    /// Number of readings that are projected to these features; 0 without a projection.
    pub projected_readings: usize,
    /// Whether inputs are readings relative to the baseline.
    pub relative_inputs: bool,
    /// Number of centres of each network (the largest).
    pub centres: usize,
    /// Numbers of outputs of the networks, of a row or of all rows. One number if all have it.
    pub outputs_per_network: Vec<usize>,
    /// Width σ on scaled inputs; after refinement the mean over the networks.
    pub spread: f64,
    /// Whether centres, widths and the projection were refined after K-means.
    pub refined: bool,
    pub blob_bytes: usize,
    /// CRC-32 of the blob, in hexadecimal.
    pub model_crc: String,
    /// What decoding a frame costs a Cortex-M4F.
    pub frame_cost: Cost,
}

/// Errors of the network on one row-wire.
#[derive(Debug, Clone, PartialEq)]
pub struct RowErrors {
    /// Row-wire, from 1.
    pub row_wire: usize,
    pub errors: Vec<Errors>,
}

/// Trains on `subject` with `options`, judges the model and returns its results and the blob. The limit of contacts that move is
/// computed on so many trajectories if it is asked for.
pub fn run(
    subject: &Subject,
    options: &Options,
    limit_frames: Option<usize>,
    progress: &dyn Progress,
) -> Result<(RunResult, ModelBlob)> {
    progress.stage("read or synthesise", 1);
    let (training, test) = subject.sets();
    progress.step();

    let mut options = *options;
    let features = training.choose(&mut options, progress);
    let options = &options;
    let blob = training.blob(options, progress)?;
    let network = blob.prepare().of_inputs();

    let (measure, limit) = subject.measure(limit_frames, progress);
    progress.stage("decode and evaluate", 1);
    let baselines: Vec<Box<dyn Decoder>> =
        BASELINES.iter().filter_map(|b| b.fit(&training.frames)).collect();
    let decoders = std::iter::once(&network as &dyn Decoder)
        .chain(baselines.iter().map(AsRef::as_ref))
        .map(|decoder| metrics::judge(decoder, &test, &measure));
    let decoders: Vec<DecoderErrors> = decoders.collect();
    let estimate = network.decode_table(&test.inputs);
    let of_mean = Mean::fit(&training.frames);
    let of_centroid = baselines.iter().find(|it| it.name() == centroid::NAME);
    let of_centroid = of_centroid.map(|it| it.decode_all(&test.inputs.values, 1).values);
    let others = others::frames(subject);
    let others = Others::new(&others, (&network, &of_mean), &test, &measure);
    progress.step();

    let at_rest = readings_at_rest(subject);
    let reference = match &at_rest {
        _ if test.relative_inputs => Reference::Relative,
        Some(at_rest) => Reference::Rest(at_rest),
        None => Reference::Median,
    };
    let distribution = Distribution::new(&test.outputs, &estimate, &test.inputs, reference);
    let mut verdict = Verdict::new(&decoders, &limit)
        .of_blob(&blob, training.frames.frames())
        .of_frames(subject.measurements().map(|data| &data.outliers), test.frames())
        .with(subject.scene().and_then(|_| Warning::not_positive(&test.inputs)))
        .with(others.as_ref().and_then(|it| it.warning(&decoders)));
    let mut over_time = None;
    if let Subject::Measured(data) = subject {
        let at_rest = RestOverTime::of_data(data);
        verdict = verdict.of_data(data, at_rest.as_ref());
        over_time = of_log(data, &network, &estimate, at_rest);
        let last_lines = data.log.lines.last() < data.test_log.lines.first();
        if over_time.is_some() && last_lines && data.is_one_log {
            let rest = data.test_rest.as_ref().filter(|_| data.training.relative_inputs);
            verdict = verdict.at_the_end_of_a_log(rest.is_some_and(|rest| rest.lines.is_some()));
        }
    }
    let mut result = RunResult {
        verdict,
        subject: subject.name().into(),
        scene_digest: format!("{:016x}", training.origin.digest),
        seed: training.origin.seed,
        scene: None,
        data: None,
        model: model_summary(&training, (options, test.frames()), &network, &blob),
        features,
        device_cost: DeviceCost::new(&blob),
        decoders,
        limit,
        by_load: by_load(&test.outputs, &estimate.values, of_centroid.as_deref(), &measure),
        others,
        by_row: by_row(subject, &test, &estimate, &measure),
        moving: None,
        distribution,
        table1: None,
    };
    match subject {
        Subject::Scene(scene) => {
            result.moving = MovingContacts::new(scene, &blob, &baselines, limit_frames)?;
            result.scene = Some(scene_summary(scene));
        }
        Subject::Measured(data) => {
            result.data = Some(DataSummary {
                test_choice: data.test_choice.clone(),
                outliers: data.outliers.clone(),
                lines_left_out: data.left_out.clone(),
                unused_inputs: data.unused.clone(),
                constant_inputs: data.constant_inputs(),
                over_time,
            });
        }
    }
    Ok((result, blob))
}

/// Errors of the `network` on the frames of `data` by time, of which it has the test frames' `estimate`.
fn of_log(
    data: &Measurements,
    network: &PreparedModel<'_>,
    estimate: &Table,
    at_rest: Option<RestOverTime>,
) -> Option<OverTime> {
    if !is_log(&data.test_log, &data.test.outputs) {
        return None;
    }
    let of_training = network.decode_table(&data.training.inputs).values;
    let trained =
        Decoded { log: &data.log, outputs: &data.training.outputs, estimates: &of_training };
    let judged =
        Decoded { log: &data.test_log, outputs: &data.test.outputs, estimates: &estimate.values };
    // Times of another file say nothing beside those of the frames to judge by.
    if data.is_one_log {
        OverTime::new(Some(&trained), &judged, at_rest)
    } else {
        OverTime::new(None, &judged, None)
    }
}

/// Inputs of the untouched sensor, as far as they are known and not zero. A scene gives them without noise and drift;
/// measurements give the mean of their frames at rest.
fn readings_at_rest(subject: &Subject) -> Option<Vec<f64>> {
    match subject {
        Subject::Scene(scene) => {
            let at_rest = Synthesis::new(&scene.world).ideal().drift(None).untouched();
            Some(at_rest.readings_of(Stream::Test, 0))
        }
        Subject::Measured(data) => data.baseline().map(|baseline| baseline.values.into_vec()),
    }
}

fn scene_summary(scene: &Experiment) -> SceneSummary {
    let world = &scene.world;
    SceneSummary {
        noise_kind: world.noise.kind,
        noise_level: world.noise.total_level(),
        gain_drift: world.drift.map_or(0.0, |drift| drift.gain),
        size_mm: world.sensor.size_mm,
        row_wires: world.sensor.row_wires,
        sensor: SensorSketch::new(world),
    }
}

impl ModelSummary {
    /// Inputs of the networks, and their outputs, in words.
    pub fn ends(&self, arrow: &str) -> [String; 2] {
        let of_each = |numbers: &[usize]| {
            numbers.iter().map(usize::to_string).collect::<Vec<_>>().join(" and ")
        };
        let readings = if self.relative_inputs { "relative readings" } else { "readings" };
        let inputs = of_each(&self.inputs_per_network);
        let inputs = match self.projected_readings {
            0 => format!("{inputs} {readings}"),
            count => format!("{count} {readings} {arrow} {inputs} features"),
        };
        [inputs, format!("{} outputs", of_each(&self.outputs_per_network))]
    }
}

fn model_summary(
    training: &TrainingSet<'_>,
    (options, test_frames): (&Options, usize),
    prepared: &PreparedModel<'_>,
    blob: &ModelBlob,
) -> ModelSummary {
    let model = prepared.model();
    let shape = model.shape();
    let frame_cost = Cost::of_frame(&Design::new(blob));
    let numbers = |of: fn(Shape) -> usize| {
        let mut all: Vec<usize> = model.networks().map(|it| of(it.shape())).collect();
        if all.iter().all(|it| *it == all[0]) {
            all.truncate(1);
        }
        all
    };
    ModelSummary {
        training_frames: training.frames.frames(),
        test_frames,
        networks: model.networks().count(),
        inputs_per_network: numbers(|shape| shape.inputs),
        projected_readings: if model.whole_frames() { shape.rows * shape.inputs } else { 0 },
        relative_inputs: model.metadata().relative_inputs,
        centres: model.networks().map(|n| n.shape().centres).max().unwrap_or(0),
        outputs_per_network: numbers(|shape| shape.outputs),
        spread: if training.refine { blob.spread() } else { options.spread },
        refined: training.refine,
        blob_bytes: blob.bytes().len(),
        model_crc: format!("{:08x}", model.crc()),
        frame_cost,
    }
}

fn by_row(
    subject: &Subject,
    test: &Dataset,
    estimate: &Table,
    measure: &Measure,
) -> Vec<RowErrors> {
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
    let rows = subject.row_wires().into_iter().enumerate();
    rows.map(|(row, row_wire)| RowErrors { row_wire, errors: errors(row) }).collect()
}
