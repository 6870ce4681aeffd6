//! Both number formats on readings that no sensor gives, against the formulas of docs/blob.md in f64.

use taxel_core::rbf::{Format, Network, Shape, fixed16, float32};
use taxel_core::{Decoder, Estimate, Frame, RowStatus};
use taxel_data::{Dataset, Purpose, Random, Silent, Stream};
use taxel_learn::train::train;
use taxel_learn::{ModelBlob, Options, Origin, pack};

use crate::table::hold;

/// Row-wires, inputs, outputs and centres: odd numbers of inputs, and centres beside those that are computed at once.
const SHAPES: [[usize; 4]; 6] =
    [[1, 18, 18, 24], [8, 18, 3, 1], [3, 7, 2, 16], [2, 1, 1, 5], [4, 33, 5, 64], [1, 2, 1, 47]];
const MOST_ROWS: usize = 8;
const FRAMES: usize = 64;

// The numbers of docs/blob.md, and not the product's own.

/// What scaled readings are clamped to, where 0 to 1 is the training range.
const CLAMP: [f64; 2] = [-0.125, 1.125];
/// Steps of fixed16 from the middle of the training range to a clamp, and 1 of an activation.
const ONE: f64 = 32_768.0;
/// Units of the scaling in a step.
const UNITS_PER_STEP: f64 = 65_536.0;
/// Fraction bits of an exponent, and of the decay.
const EXPONENT_BITS: i32 = 26;
const DECAY_BITS: i32 = 60;
/// Centres that stand together in a block of fixed16.
const CENTRES_AT_ONCE: usize = 16;
/// Largest error of an activation of fixed16 that training reckons with.
const ACTIVATION_ERROR: f64 = 2e-4;

/// `f32` is to lose nothing that anyone could measure: a hundredth of the error that training leaves.
#[test]
fn f32_decodes_any_reading_as_f64() {
    let models = models(Format::F32);
    hold("f32", 1.0, 400, |seed| Some(worst(&models, seed, |_, rmse| 0.01 * rmse)));
}

/// `fixed16` rounds activations, for which training reckons with so much, and inputs to a step.
#[test]
fn fixed16_decodes_any_reading_as_f64_with_rounded_activations() {
    let models = models(Format::Fixed16);
    hold("fixed16", 1.0, 400, |seed| Some(worst(&models, seed, |rounding, _| rounding)));
}

/// Models of every shape, of frames whose inputs have different ranges and whose outputs depend on all of them.
fn models(format: Format) -> Vec<ModelBlob> {
    let model = |[rows, inputs, outputs, centres]: [usize; 4]| {
        let names = |what: &str, count| (0..rows * count).map(|i| format!("{what}{i}")).collect();
        let mut data = Dataset::empty(names("in", inputs), names("out", outputs), rows, 300);
        let mut random =
            Random::new(9, Stream::Training, Purpose::Noise, rows as u64, inputs as u64);
        let lines = data.inputs.values.chunks_exact_mut(inputs);
        for (reads, outs) in lines.zip(data.outputs.values.chunks_exact_mut(outputs)) {
            let [a, b] = [random.unit(), random.unit()];
            for (i, reading) in reads.iter_mut().enumerate() {
                let place = i as f64 / inputs as f64;
                let change = a * (1.0 - place) + b * place + 0.1 * random.unit();
                *reading = 40.0 + (i % 5) as f64 * change + 3.0 * (a * b + place).sin();
            }
            for (i, output) in outs.iter_mut().enumerate() {
                *output = (3.0 * a + i as f64).sin() * (2.0 * b).cos() + 0.02 * random.normal();
            }
        }
        let options = Options { format, centres, ..Options::of_rows() };
        let trained = train(&data, &options, &Silent).unwrap();
        pack(&trained, &data, &Origin::of_data("shapes", 0, 1, &data)).unwrap()
    };
    SHAPES.into_iter().map(model).collect()
}

/// Largest error of an output of a model for some frames, in the `unit` that is made of what the format may round and of
/// the output's training RMSE.
fn worst(models: &[ModelBlob], seed: u64, unit: fn(f64, f64) -> f64) -> f64 {
    let blob = &models[seed as usize % models.len()];
    let mut random = Random::new(seed, Stream::Test, Purpose::Noise, 0, 0);
    (0..FRAMES).map(|_| frame(blob, &mut random, unit)).fold(0.0, f64::max)
}

/// Largest error of an output for a frame of extremes. A row with a missing reading has no outputs, and says so.
fn frame(blob: &ModelBlob, random: &mut Random, unit: fn(f64, f64) -> f64) -> f64 {
    let model = blob.parse();
    let networks: Vec<Network<'_>> = model.networks().collect();
    let Shape { inputs, outputs, .. } = networks[0].shape();
    let mut readings = Vec::new();
    for network in &networks {
        readings.extend((0..inputs).map(|i| extreme(network.training_range(i), random)));
    }
    let mut found = vec![0.0; outputs * networks.len()];
    let mut status = vec![RowStatus::Decoded; networks.len()];
    let rmse: Vec<f64> = model.metadata().training_rmse.iter().map(f64::from).collect();
    let decoder = Decoder::<MOST_ROWS>::new(model).unwrap();
    let mut scratch = vec![0.0; decoder.scratch_floats()];
    let mut estimate = Estimate { outputs: &mut found, status: &mut status };
    decoder.decode_into(Frame::from(&readings[..]), &mut scratch, &mut estimate).unwrap();
    let mut worst = 0.0_f64;
    for (row, network) in networks.iter().enumerate() {
        let readings = &readings[row * inputs..][..inputs];
        let found = &found[row * outputs..][..outputs];
        if readings.iter().any(|reading| !reading.is_finite()) {
            assert_eq!(status[row], RowStatus::MissingReading);
            assert!(found.iter().all(|y| y.is_nan()), "{found:?} of a missing row");
            continue;
        }
        assert_eq!(status[row], RowStatus::Decoded, "{readings:?}");
        let (truth, rounding) = in_f64(network, readings);
        for (output, y) in found.iter().enumerate() {
            let unit = unit(rounding[output], rmse[row * outputs + output]);
            let off = (f64::from(*y) - truth[output]).abs() / unit;
            assert!(!off.is_nan(), "an output is {y}, and {} in f64", truth[output]);
            worst = worst.max(off);
        }
    }
    worst
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

/// Outputs in f64 by the formulas of the format, without any rounding but that of parameters and, in fixed16, of inputs;
/// and for each output how much fixed16 may round.
fn in_f64(network: &Network<'_>, readings: &[f32]) -> (Vec<f64>, Vec<f64>) {
    match network {
        Network::F32(network) => floating(network, readings),
        Network::Fixed16(network) => fixed(network, readings),
    }
}

fn add(outputs: &mut [f64], factor: f64, weights: impl Iterator<Item = f64>) {
    outputs.iter_mut().zip(weights).for_each(|(y, w)| *y += factor * w);
}

fn wide(values: &[f32]) -> impl Iterator<Item = f64> {
    values.iter().copied().map(f64::from)
}

fn floating(network: &float32::Network<'_>, readings: &[f32]) -> (Vec<f64>, Vec<f64>) {
    let p = network.parameters();
    let scaled = wide(readings).zip(wide(p.input_minimum).zip(wide(p.input_per_span)));
    let scaled = scaled.map(|(r, (minimum, per_span))| (r - minimum) * per_span);
    let x: Vec<f64> = scaled.map(|x| x.clamp(CLAMP[0], CLAMP[1])).collect();
    let mut outputs: Vec<f64> = wide(p.bias).collect();
    let count = outputs.len();
    for (x, row) in x.iter().zip(p.affine.chunks_exact(count)) {
        add(&mut outputs, *x, wide(row));
    }
    let weights = p.output_weights.chunks_exact(count);
    for ((k, centre), weights) in p.centres.chunks_exact(x.len()).enumerate().zip(weights) {
        let square: f64 = x.iter().zip(wide(centre)).map(|(x, c)| (x - c).powi(2)).sum();
        let decay = f64::from(*p.decay.get(k).unwrap_or(&p.decay[0]));
        add(&mut outputs, (-decay * square).exp(), wide(weights));
    }
    (outputs, vec![0.0; count])
}

fn fixed(network: &fixed16::Network<'_>, readings: &[f32]) -> (Vec<f64>, Vec<f64>) {
    let Shape { inputs, centres, outputs: count } = network.shape();
    let p = network.parameters();
    let half = |words: &[u32], place: usize| {
        f64::from(((words[place / 2] >> (16 * (place % 2))) as u16).cast_signed())
    };
    // Readings are rounded down to a step.
    let scaled = wide(readings).zip(wide(p.input_midpoint).zip(wide(p.input_per_unit)));
    let steps = scaled.map(|(r, (middle, per_unit))| (r - middle) * per_unit / UNITS_PER_STEP);
    let x: Vec<f64> = steps.map(|x| x.clamp(-ONE, ONE).floor().min(ONE - 1.0)).collect();
    let decay = f64::from(p.decay) / 2_f64.powi(DECAY_BITS);
    let mut outputs: Vec<f64> = p.bias.iter().copied().map(f64::from).collect();
    let mut rounding = vec![0.0; count];
    let pairs = inputs.div_ceil(2);
    for (output, row) in p.affine.chunks_exact(pairs).enumerate() {
        for (i, x) in x.iter().enumerate() {
            outputs[output] += half(row, i) * x;
            rounding[output] += half(row, i).abs();
        }
    }
    let group_words = CENTRES_AT_ONCE * (1 + pairs) + count * CENTRES_AT_ONCE / 2;
    for (group, words) in p.centres.chunks_exact(group_words).enumerate() {
        let (lines, weights) = words.split_at(CENTRES_AT_ONCE * (1 + pairs));
        let lines = lines.chunks_exact(1 + pairs).take(centres - group * CENTRES_AT_ONCE);
        for (k, line) in lines.enumerate() {
            // a = −2g·c in units of the exponent.
            let per_a = 2.0 * 2_f64.powi(EXPONENT_BITS) * decay;
            let from_centre = |(i, x): (usize, &f64)| (x + half(&line[1..], i) / per_a).powi(2);
            let square: f64 = x.iter().enumerate().map(from_centre).sum();
            let weights =
                (0..count).map(|output| half(&weights[output * CENTRES_AT_ONCE / 2..], k) * ONE);
            add(&mut rounding, ACTIVATION_ERROR, weights.clone().map(f64::abs));
            add(&mut outputs, (-decay * square).exp2(), weights);
        }
    }
    for (values, scale) in outputs.iter_mut().zip(&mut rounding).zip(wide(p.output_scale)) {
        *values.0 *= scale;
        *values.1 *= scale.abs();
    }
    (outputs, rounding)
}
