//! Inference in every number format, at the corners of what it clamps to and far beyond, against f64.

use std::sync::OnceLock;

use model_core::rbf::{Format, Network, Shape, direct, expanded, fixed16};
use model_core::scale::{CLAMP, UNITS, UNITS_PER_STEP};
use model_core::{Decoder, Estimate, Frame, RowStatus};
use taxel_data::progress::Silent;
use taxel_data::random::{Purpose, Random, Stream};
use taxel_learn::train::train;
use taxel_learn::{ModelBlob, Options, Origin, pack};
use taxel_simulate::{Synthesis, World};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;

pub const F32: Promise = Promise {
    name: "inference-f32",
    text: "f32, any reading: f64 within 0.1 of the training RMSE",
    share: 1,
    check: |effort, _| inference(effort, &[Format::F32, Format::F32Direct], 0.1),
};

pub const FIXED16: Promise = Promise {
    name: "inference-fixed16",
    text: "fixed16, any reading: f64 within 0.1 of training RMSE",
    share: 1,
    check: |effort, _| inference(effort, &[Format::Fixed16], 0.1),
};

/// Frames that a case decodes.
const FRAMES: usize = 64;

fn inference(effort: &Effort, formats: &[Format], bound: f64) -> Result<Found, String> {
    let planted = effort.is_planted();
    Ok(effort.worst((400, 1_000_000), (bound, "RMSE"), |seed| {
        let models = models();
        let of_format = models.iter().filter(|(format, _)| formats.contains(format));
        let of_format: Vec<&ModelBlob> = of_format.map(|(_, blob)| blob).collect();
        let blob = of_format[(seed % of_format.len() as u64) as usize];
        let mut random = Random::new(seed, Stream::Test, Purpose::Noise, 0, 0);
        (0..FRAMES).try_fold(0.0, |worst: f64, _| Ok(worst.max(frame(blob, &mut random, planted)?)))
    }))
}

/// Models of one row-wire, in every format, with an affine tail and without.
fn models() -> &'static [(Format, ModelBlob)] {
    static MODELS: OnceLock<Vec<(Format, ModelBlob)>> = OnceLock::new();
    MODELS.get_or_init(|| {
        let world = World { read_rows: vec![3], ..World::press() };
        let frames = Synthesis::new(&world).noise_level(0.05).frames(Stream::Training, 800);
        let each = Format::ALL.into_iter().flat_map(|format| [(format, true), (format, false)]);
        each.map(|(format, affine_tail)| {
            let options = Options { format, affine_tail, centres: 24, ..Options::default() };
            let trained = train(&frames, &options, &Silent).expect("a model of few frames");
            let origin = Origin::of_data("row 4", 0, 1, &frames);
            (format, pack(&trained, &frames, &origin).expect("a small model"))
        })
        .collect()
    })
}

/// Largest error of an output for a frame of extremes, as a share of the output's training RMSE.
fn frame(blob: &ModelBlob, random: &mut Random, planted: bool) -> Result<f64, String> {
    let model = blob.parse();
    let network = model.networks().next().expect("one network");
    let Shape { inputs, outputs, .. } = network.shape();
    let readings: Vec<f32> =
        (0..inputs).map(|i| extreme(network.training_range(i), random)).collect();
    let is_complete = readings.iter().all(|reading| reading.is_finite());
    // Planted: a clamp at the training range, and a NaN that becomes a number.
    let given: Vec<f32> = readings
        .iter()
        .enumerate()
        .map(|(i, reading)| {
            let [low, high] = network.training_range(i);
            if planted { reading.max(low).min(high) } else { *reading }
        })
        .collect();
    let (mut found, mut status) = (vec![0.0; outputs], [RowStatus::Decoded]);
    let decoder = Decoder::<1>::new(model).map_err(|cause| cause.to_string())?;
    let mut scratch = vec![0.0; decoder.scratch_floats()];
    let mut estimate = Estimate { outputs: &mut found, status: &mut status };
    let decoded = decoder.decode_into(Frame::from(&given[..]), &mut scratch, &mut estimate);
    decoded.map_err(|cause| cause.to_string())?;
    let expected = if is_complete { RowStatus::Decoded } else { RowStatus::MissingReading };
    if status[0] != expected {
        return Err(format!("status {:?} of readings {readings:?}", status[0]));
    }
    if !is_complete {
        let all_nan = found.iter().all(|y| y.is_nan());
        return if all_nan { Ok(0.0) } else { Err(format!("outputs {found:?} of a missing row")) };
    }
    let truth = in_f64(&network, &readings);
    let rmse = model.metadata().training_rmse.iter();
    let off = found.iter().zip(&truth).zip(rmse);
    let off = off.map(|((y, truth), rmse)| (f64::from(*y) - truth).abs() / f64::from(rmse));
    Ok(off.fold(0.0, |worst, off| if off.is_nan() { f64::NAN } else { worst.max(off) }))
}

/// A reading as no sensor gives it, now and then one as it does.
pub fn extreme([low, high]: [f32; 2], random: &mut Random) -> f32 {
    let span = high - low;
    match random.below(1000) {
        0 => f32::NAN,
        1 => f32::INFINITY,
        2 => f32::NEG_INFINITY,
        any => match any % 12 {
            0 => f32::MAX,
            1 => -f32::MAX,
            2 => f32::from_bits(1 + random.below(0x7F_FFFF) as u32),
            3 => -0.0,
            4 => low + CLAMP[0] * span,
            5 => low + CLAMP[1] * span,
            6 => (low + CLAMP[0] * span).next_down(),
            7 => (low + CLAMP[1] * span).next_up(),
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
        Network::F32Direct(network) => direct(network, readings),
        Network::F32(network) => expanded(network, readings),
        Network::Fixed16(network) => fixed(network, readings),
    }
}

fn add(outputs: &mut [f64], factor: f64, weights: impl Iterator<Item = f64>) {
    outputs.iter_mut().zip(weights).for_each(|(y, w)| *y += factor * w);
}

fn wide(values: &[f32]) -> impl Iterator<Item = f64> {
    values.iter().copied().map(f64::from)
}

fn direct(network: &direct::Network<'_>, readings: &[f32]) -> Vec<f64> {
    let p = network.parameters();
    let scales = wide(p.input_minimum).zip(wide(p.input_per_span));
    let x = wide(readings).zip(scales).map(|(r, (minimum, per_span))| {
        ((r - minimum) * per_span).clamp(CLAMP[0].into(), CLAMP[1].into())
    });
    let x: Vec<f64> = x.collect();
    let mut outputs: Vec<f64> = wide(p.bias).collect();
    let count = outputs.len();
    for (x, row) in x.iter().zip(p.affine.chunks_exact(count)) {
        add(&mut outputs, *x, wide(row));
    }
    let weights = p.output_weights.chunks_exact(count);
    for ((k, centre), weights) in p.centres.chunks_exact(x.len()).enumerate().zip(weights) {
        let square: f64 = x.iter().zip(wide(centre)).map(|(x, c)| (x - c) * (x - c)).sum();
        let decay = f64::from(*p.decay.get(k).unwrap_or(&p.decay[0]));
        add(&mut outputs, (-decay * square).exp(), wide(weights));
    }
    outputs
}

/// Inputs in units about the middle of the training range, clamped.
fn units(midpoint: &[f32], per_unit: &[f32], readings: &[f32]) -> Vec<f64> {
    let scales = wide(midpoint).zip(wide(per_unit));
    let of = |(r, (middle, per_unit)): (f64, (f64, f64))| {
        ((r - middle) * per_unit).clamp(-f64::from(UNITS), f64::from(UNITS))
    };
    wide(readings).zip(scales).map(of).collect()
}

fn expanded(network: &expanded::Network<'_>, readings: &[f32]) -> Vec<f64> {
    let p = network.parameters();
    let x = units(p.input_midpoint, p.input_per_unit, readings);
    let mut outputs: Vec<f64> = wide(p.bias).collect();
    let count = outputs.len();
    for (x, row) in x.iter().zip(p.affine.chunks_exact(count)) {
        add(&mut outputs, *x, wide(row));
    }
    let square: f64 = x.iter().map(|x| x * x).sum();
    let lines = p.exponents.chunks_exact(1 + x.len());
    for (line, weights) in lines.zip(p.output_weights.chunks_exact(count)) {
        let products: f64 = wide(&line[1..]).zip(&x).map(|(a, x)| a * x).sum();
        let exponent = f64::from(line[0]) + products - f64::from(p.decay) * square;
        add(&mut outputs, exponent.exp2(), wide(weights));
    }
    outputs
}

fn fixed(network: &fixed16::Network<'_>, readings: &[f32]) -> Vec<f64> {
    let Shape { inputs, centres, outputs: count } = network.shape();
    let p = network.parameters();
    let half = |words: &[u32], place: usize| {
        let word = words[place / 2] >> (16 * (place % 2));
        f64::from((word as u16).cast_signed())
    };
    // Readings are rounded down to a step.
    let most = f64::from(UNITS / UNITS_PER_STEP);
    let steps = units(p.input_midpoint, p.input_per_unit, readings).into_iter();
    let x = steps.map(|x| (x / f64::from(UNITS_PER_STEP)).floor().min(most - 1.0));
    let x: Vec<f64> = x.collect();
    let bits = fixed16::EXPONENT_FRACTION_BITS + fixed16::DECAY_FRACTION_BITS;
    let decay = f64::from(p.decay) / 2_f64.powi(bits.cast_signed());
    let per_a = f64::from(1 << fixed16::EXPONENT_FRACTION_BITS) * decay;
    let mut sums: Vec<f64> = p.bias.iter().copied().map(f64::from).collect();
    let pairs = inputs.div_ceil(2);
    for (output, row) in p.affine.chunks_exact(pairs).enumerate() {
        sums[output] += x.iter().enumerate().map(|(i, x)| half(row, i) * x).sum::<f64>();
    }
    let at_once = fixed16::CENTRES_AT_ONCE;
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
