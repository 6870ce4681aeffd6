//! Inference in every number format, for shapes of every kind, at the corners of what it clamps to and far beyond,
//! against f64 by the formulas of docs/blob.md.

use std::sync::OnceLock;

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use taxel_core::rbf::{Format, Network, Shape, fixed16, float32};
use taxel_core::{Decoder, Estimate, Frame, RowStatus};
use taxel_data::dataset::Dataset;
use taxel_data::progress::Silent;
use taxel_data::random::{Purpose, Random, Stream};
use taxel_learn::train::train;
use taxel_learn::{ModelBlob, Options, Origin, pack};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;

pub const F32: Promise = Promise {
    name: "inference-f32",
    text: "f32, any reading: as f64, in training RMSEs",
    share: 1,
    check: |effort, _| inference(effort, &[Format::F32], 0.1),
};

pub const FIXED16: Promise = Promise {
    name: "inference-fixed16",
    text: "fixed16, any reading: as f64, in training RMSEs",
    share: 1,
    check: |effort, _| inference(effort, &[Format::Fixed16], 1.0),
};

/// Frames that a case decodes.
const FRAMES: usize = 64;
/// Row-wires, inputs, outputs and centres of the models: odd numbers of inputs, and numbers of centres beside those that
/// formats compute at once.
const SHAPES: [[usize; 4]; 6] =
    [[1, 18, 18, 24], [8, 18, 3, 1], [3, 7, 2, 16], [2, 1, 1, 5], [4, 33, 5, 64], [1, 2, 1, 47]];
const MOST_ROWS: usize = 8;

// The numbers of docs/blob.md, and not the product's own.

/// What scaled readings are clamped to, where 0 to 1 is the training range.
const CLAMP: [f64; 2] = [-0.125, 1.125];
/// Units to either side of the middle of the training range.
const UNITS: f64 = (1_u64 << 31) as f64;
/// Units in a step of `fixed16`.
const UNITS_PER_STEP: f64 = 65_536.0;
/// Fraction bits of an exponent of `fixed16`.
const EXPONENT_BITS: i32 = 26;
/// Fraction bits of the decay of `fixed16`, per step squared.
const DECAY_BITS: i32 = 60;
/// Centres that stand together in a block of `fixed16`.
const CENTRES_AT_ONCE: usize = 16;

fn inference(effort: &Effort, formats: &[Format], most: f64) -> Result<Found, String> {
    let models: Vec<&ModelBlob> =
        models().iter().filter(|(format, _)| formats.contains(format)).map(|(_, it)| it).collect();
    Ok(effort.worst((400, 1_000_000), (most, "RMSE"), |seed| {
        let blob = models[(seed % models.len() as u64) as usize];
        let mut random = Random::new(seed, Stream::Test, Purpose::Noise, 0, 0);
        (0..FRAMES).try_fold(0.0, |worst: f64, _| Ok(worst.max(frame(blob, &mut random)?)))
    }))
}

/// Models of every shape and format, with an affine tail and without.
fn models() -> &'static [(Format, ModelBlob)] {
    static MODELS: OnceLock<Vec<(Format, ModelBlob)>> = OnceLock::new();
    MODELS.get_or_init(|| {
        let kinds = SHAPES.into_iter().flat_map(|shape| {
            let each = Format::ALL.into_iter();
            each.flat_map(move |format| [(shape, format, true), (shape, format, false)])
        });
        let kinds: Vec<([usize; 4], Format, bool)> = kinds.collect();
        let model = |(shape, format, affine_tail): ([usize; 4], Format, bool)| {
            let frames = samples(shape);
            let [.., centres] = shape;
            let options = Options { format, affine_tail, centres, ..Options::default() };
            let trained = train(&frames, &options, &Silent).expect("a model of few frames");
            let origin = Origin::of_data("shapes", 0, 1, &frames);
            (format, pack(&trained, &frames, &origin).expect("a small model"))
        };
        kinds.into_par_iter().map(model).collect()
    })
}

/// Frames of row-wires whose inputs have different ranges, and whose outputs depend on all of them.
fn samples([rows, inputs, outputs, _]: [usize; 4]) -> Dataset {
    let names =
        |what: &str, count: usize| (0..rows * count).map(|i| format!("{what}{i}")).collect();
    let mut data = Dataset::empty(names("in", inputs), names("out", outputs), rows, 300);
    let mut random = Random::new(9, Stream::Training, Purpose::Noise, rows as u64, inputs as u64);
    let lines = data.inputs.values.chunks_exact_mut(inputs);
    for (reads, outs) in lines.zip(data.outputs.values.chunks_exact_mut(outputs)) {
        let [a, b] = [random.unit(), random.unit()];
        for (i, reading) in reads.iter_mut().enumerate() {
            let place = i as f64 / inputs as f64;
            *reading = 40.0
                + (i % 5) as f64 * (a * (1.0 - place) + b * place + 0.1 * random.unit())
                + 3.0 * (a * b + place).sin();
        }
        for (i, output) in outs.iter_mut().enumerate() {
            *output = (3.0 * a + i as f64).sin() * (2.0 * b).cos() + 0.02 * random.normal();
        }
    }
    data
}

/// Largest error of an output for a frame of extremes, as a share of the output's training RMSE.
fn frame(blob: &ModelBlob, random: &mut Random) -> Result<f64, String> {
    let model = blob.parse();
    let networks: Vec<Network<'_>> = model.networks().collect();
    let Shape { inputs, outputs, .. } = networks[0].shape();
    let extremes = |network: &Network<'_>| -> Vec<f32> {
        (0..inputs).map(|i| extreme(network.training_range(i), random)).collect()
    };
    let readings: Vec<f32> = networks.iter().flat_map(extremes).collect();
    let (mut found, mut status) =
        (vec![0.0; outputs * networks.len()], vec![RowStatus::Decoded; networks.len()]);
    let rmse = model.metadata().training_rmse;
    let decoder = Decoder::<MOST_ROWS>::new(model).map_err(|cause| cause.to_string())?;
    let mut scratch = vec![0.0; decoder.scratch_floats()];
    let mut estimate = Estimate { outputs: &mut found, status: &mut status };
    let decoded = decoder.decode_into(Frame::from(&readings[..]), &mut scratch, &mut estimate);
    decoded.map_err(|cause| cause.to_string())?;
    let mut worst = 0.0_f64;
    for (row, network) in networks.iter().enumerate() {
        let (readings, found) =
            (&readings[row * inputs..][..inputs], &found[row * outputs..][..outputs]);
        let is_complete = readings.iter().all(|reading| reading.is_finite());
        let expected = if is_complete { RowStatus::Decoded } else { RowStatus::MissingReading };
        if status[row] != expected {
            return Err(format!("status {:?} of readings {readings:?}", status[row]));
        }
        if !is_complete {
            if found.iter().any(|y| !y.is_nan()) {
                return Err(format!("outputs {found:?} of a missing row"));
            }
            continue;
        }
        let rmse = rmse.iter().skip(row * outputs);
        for ((y, truth), rmse) in found.iter().zip(in_f64(network, readings)).zip(rmse) {
            let off = (f64::from(*y) - truth).abs() / f64::from(rmse);
            if off.is_nan() {
                return Err(format!("an output is {y}, and {truth} in f64"));
            }
            worst = worst.max(off);
        }
    }
    Ok(worst)
}

/// A reading as no sensor gives it, now and then one as it does.
fn extreme([low, high]: [f32; 2], random: &mut Random) -> f32 {
    let span = high - low;
    let clamp = CLAMP.map(|end| low + end as f32 * span);
    match random.below(1000) {
        0 => f32::NAN,
        1 => f32::INFINITY,
        2 => f32::NEG_INFINITY,
        any => match any % 12 {
            0 => f32::MAX,
            1 => -f32::MAX,
            2 => f32::from_bits(1 + random.below(0x7F_FFFF) as u32),
            3 => -0.0,
            4 => clamp[0],
            5 => clamp[1],
            6 => clamp[0].next_down(),
            7 => clamp[1].next_up(),
            8 => low,
            9 => high,
            _ => low + span * random.between([-0.2, 1.2]) as f32,
        },
    }
}

/// Outputs of `network` in f64 by the formulas of its format, without any rounding but that of its parameters and, in
/// fixed16, its inputs.
fn in_f64(network: &Network<'_>, readings: &[f32]) -> Vec<f64> {
    match network {
        Network::F32(network) => float(network, readings),
        Network::Fixed16(network) => fixed(network, readings),
    }
}

fn add(outputs: &mut [f64], factor: f64, weights: impl Iterator<Item = f64>) {
    outputs.iter_mut().zip(weights).for_each(|(y, w)| *y += factor * w);
}

fn wide(values: &[f32]) -> impl Iterator<Item = f64> {
    values.iter().copied().map(f64::from)
}

fn float(network: &float32::Network<'_>, readings: &[f32]) -> Vec<f64> {
    let p = network.parameters();
    let scales = wide(p.input_minimum).zip(wide(p.input_per_span));
    let x = wide(readings)
        .zip(scales)
        .map(|(r, (minimum, per_span))| ((r - minimum) * per_span).clamp(CLAMP[0], CLAMP[1]));
    let x: Vec<f64> = x.collect();
    let mut outputs: Vec<f64> = wide(p.bias).collect();
    let count = outputs.len();
    for (x, row) in x.iter().zip(p.affine.chunks_exact(count)) {
        add(&mut outputs, *x, wide(row));
    }
    let weights = p.output_weights.chunks_exact(count);
    for ((centre, decay), weights) in p.centres.chunks_exact(x.len()).zip(p.decay).zip(weights) {
        let square: f64 = x.iter().zip(wide(centre)).map(|(x, c)| (x - c) * (x - c)).sum();
        add(&mut outputs, (-f64::from(*decay) * square).exp(), wide(weights));
    }
    outputs
}

/// Inputs in units about the middle of the training range, clamped.
fn units(midpoint: &[f32], per_unit: &[f32], readings: &[f32]) -> Vec<f64> {
    let scales = wide(midpoint).zip(wide(per_unit));
    let of =
        |(r, (middle, per_unit)): (f64, (f64, f64))| ((r - middle) * per_unit).clamp(-UNITS, UNITS);
    wide(readings).zip(scales).map(of).collect()
}

fn fixed(network: &fixed16::Network<'_>, readings: &[f32]) -> Vec<f64> {
    let Shape { inputs, centres, outputs: count } = network.shape();
    let p = network.parameters();
    let half = |words: &[u32], place: usize| {
        let word = words[place / 2] >> (16 * (place % 2));
        f64::from((word as u16).cast_signed())
    };
    // Readings are rounded down to a step.
    let most = UNITS / UNITS_PER_STEP;
    let steps = units(p.input_midpoint, p.input_per_unit, readings).into_iter();
    let x = steps.map(|x| (x / UNITS_PER_STEP).floor().min(most - 1.0));
    let x: Vec<f64> = x.collect();
    let decay = f64::from(p.decay) / 2_f64.powi(DECAY_BITS);
    let per_a = 2_f64.powi(EXPONENT_BITS) * decay;
    let mut sums: Vec<f64> = p.bias.iter().copied().map(f64::from).collect();
    let pairs = inputs.div_ceil(2);
    for (output, row) in p.affine.chunks_exact(pairs).enumerate() {
        sums[output] += x.iter().enumerate().map(|(i, x)| half(row, i) * x).sum::<f64>();
    }
    let at_once = CENTRES_AT_ONCE;
    let line = 1 + pairs;
    let group_words = at_once * line + count * at_once / 2;
    for (group, words) in p.centres.chunks_exact(group_words).enumerate() {
        let (lines, weights) = words.split_at(at_once * line);
        for (k, line) in lines.chunks_exact(line).enumerate() {
            if group * at_once + k >= centres {
                continue;
            }
            // a = −2g·c in units of the exponent.
            let from_centre = |(i, x): (usize, &f64)| x + half(&line[1..], i) / (2.0 * per_a);
            let square: f64 = x.iter().enumerate().map(from_centre).map(|d| d * d).sum();
            let activation = 32_768.0 * (-decay * square).exp2();
            let of_output = |output: usize| half(&weights[output * at_once / 2..], k);
            add(&mut sums, activation, (0..count).map(of_output));
        }
    }
    sums.iter().zip(wide(p.output_scale)).map(|(sum, scale)| sum * scale).collect()
}
