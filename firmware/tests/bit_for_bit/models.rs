//! The models in `testdata`: of the paper's shape, with parameters from a generator, in every format.

use model_core::blob::{
    Columns, Floats, Metadata, ModelParts, NoiseKind, encode, encoded_length_bound,
};
use model_core::rbf::direct::Parameters;
use model_core::rbf::fixed16::{
    CENTRES_AT_ONCE, DECAY_FRACTION_BITS, EXPONENT_FRACTION_BITS, EXPONENT_MARGIN,
};
use model_core::rbf::{Format, Network, Shape, direct, expanded, fixed16};
use model_core::scale::{HALF_RANGE, UNITS, UNITS_PER_STEP};

use super::checks::{COLS, Numbers, OUTPUTS, ROWS};

/// log₂e/(2σ²) for σ = 0.8
const DECAY_PER_SPAN_SQUARED: f64 = core::f64::consts::LOG2_E / (2.0 * 0.8 * 0.8);

/// What makes a blob.
type Make = fn() -> Vec<u8>;

/// The models by the name of their file.
pub const FILES: [(&str, Make); 4] = [
    ("hand-made.bin", hand_made),
    ("kernels-f32.bin", || of_format(Format::F32)),
    ("kernels-fixed16.bin", || of_format(Format::Fixed16)),
    ("kernels-f32-direct.bin", || of_format(Format::F32Direct)),
];

/// The blob of the file of this name, at a multiple of four.
pub fn with_blob<T>(name: &str, work: impl FnOnce(&[u8]) -> T) -> T {
    let (_, blob) = FILES.iter().find(|(file, _)| *file == name).unwrap();
    let blob = blob();
    let mut room = vec![0; blob.len() + 3];
    let start = room.as_ptr().align_offset(4);
    room[start..start + blob.len()].copy_from_slice(&blob);
    work(&room[start..start + blob.len()])
}

fn draw(numbers: &mut Numbers, count: usize, middle: f32, reach: f32) -> Vec<f32> {
    (0..count).map(|_| middle + reach * numbers.draw()).collect()
}

/// Two networks, which the rows use in turn, with widths of their own for every centre.
fn hand_made() -> Vec<u8> {
    let mut numbers = Numbers::new(0);
    let mut words = || direct_words(&mut numbers, 12, true, 12);
    let (even, odd) = (words(), words());
    let networks = [&even, &odd].map(|words| network(Format::F32Direct, 12, false, true, words));
    encoded("hand-made", &networks, [0, 1, 0, 1, 0, 1, 0, 1])
}

/// Networks with tail and without. K is a multiple of nothing that a kernel takes at once; in f32, the last
/// row's is more than the assembly keeps activations of.
fn of_format(format: Format) -> Vec<u8> {
    let mut numbers = Numbers::new(5);
    let of_last_row = if format == Format::F32 { 131 } else { 33 };
    let kinds = [(18, true), (17, false), (of_last_row, true)];
    let mut words_of = |(centres, affine): (usize, bool)| match format {
        Format::F32Direct => direct_words(&mut numbers, centres, affine, 1),
        Format::F32 => expanded_words(&mut numbers, centres, affine),
        Format::Fixed16 => fixed16_words(&mut numbers, centres, affine),
    };
    let words = kinds.map(&mut words_of);
    let networks = [0, 1, 2].map(|index| {
        let (centres, affine) = kinds[index];
        network(format, centres, true, affine, &words[index])
    });
    encoded(format.name(), &networks, [0, 1, 0, 1, 0, 1, 0, 2])
}

fn network(
    format: Format,
    centres: usize,
    common_width: bool,
    affine: bool,
    words: &[u32],
) -> Network<'_> {
    let shape = Shape { inputs: COLS, centres, outputs: OUTPUTS };
    match format {
        Format::F32Direct => {
            direct::Network::of_words(shape, common_width, affine, words).unwrap().into()
        }
        Format::F32 => expanded::Network::try_new(shape, affine, words).unwrap().into(),
        Format::Fixed16 => fixed16::Network::try_new(shape, affine, words).unwrap().into(),
    }
}

fn direct_words(numbers: &mut Numbers, centres: usize, affine: bool, widths: usize) -> Vec<u32> {
    let mut draw = |count, middle, reach| draw(numbers, count, middle, reach);
    let parameters = Parameters {
        input_minimum: &draw(COLS, 54.0, 1.0),
        input_per_span: &draw(COLS, 0.08, 0.01),
        centres: &draw(centres * COLS, 0.5, 0.5),
        decay: &draw(widths, 0.75, 0.5),
        output_weights: &draw(centres * OUTPUTS, 0.0, 1.0),
        bias: &draw(OUTPUTS, 0.0, 1.0),
        affine: &draw(if affine { COLS * OUTPUTS } else { 0 }, 0.0, 0.1),
    };
    parameters.words().collect()
}

/// Middles of the training range, and units in an ohm.
fn scaling(numbers: &mut Numbers) -> [Vec<f32>; 2] {
    let midpoint = draw(numbers, COLS, 60.0, 1.0);
    let mut per_unit = draw(numbers, COLS, UNITS / 7.5, UNITS / 75.0);
    // A channel that never changed.
    per_unit[COLS - 1] = 0.0;
    [midpoint, per_unit]
}

fn expanded_words(numbers: &mut Numbers, centres: usize, affine: bool) -> Vec<u32> {
    let [midpoint, per_unit] = scaling(numbers);
    let unit = f64::from(HALF_RANGE) / f64::from(UNITS);
    let decay = DECAY_PER_SPAN_SQUARED * unit * unit;
    let stored = centres.next_multiple_of(expanded::CENTRES_AT_ONCE);
    let mut exponents = Vec::new();
    for _ in 0..centres {
        let centre: Vec<f64> =
            draw(numbers, COLS, 0.0, 0.5).iter().map(|c| f64::from(*c) / unit).collect();
        exponents.push(-(decay * centre.iter().map(|c| c * c).sum::<f64>()) as f32);
        exponents.extend(centre.iter().map(|c| (2.0 * decay * c) as f32));
    }
    exponents.resize(stored * (1 + COLS), 0.0);
    let mut weights = draw(numbers, centres * OUTPUTS, 0.0, 1.0);
    weights.resize(stored * OUTPUTS, 0.0);
    let parameters = expanded::Parameters {
        input_midpoint: &midpoint,
        input_per_unit: &per_unit,
        decay: decay as f32,
        bias: &draw(numbers, OUTPUTS, 0.0, 1.0),
        affine: &draw(numbers, if affine { COLS * OUTPUTS } else { 0 }, 0.0, 0.1 / UNITS),
        exponents: &exponents,
        output_weights: &weights,
    };
    parameters.words().collect()
}

fn fixed16_words(numbers: &mut Numbers, centres: usize, affine: bool) -> Vec<u32> {
    let [midpoint, per_unit] = scaling(numbers);
    let step = f64::from(HALF_RANGE) / f64::from(UNITS) * f64::from(UNITS_PER_STEP);
    let bits = EXPONENT_FRACTION_BITS + DECAY_FRACTION_BITS;
    let decay = (DECAY_PER_SPAN_SQUARED * step * step * 2_f64.powi(bits.cast_signed())) as u32;
    let per_step = f64::from(decay) / 2_f64.powi(DECAY_FRACTION_BITS.cast_signed());
    let mut words = Vec::new();
    for first in (0..centres).step_by(CENTRES_AT_ONCE) {
        let here = (centres - first).min(CENTRES_AT_ONCE);
        for k in 0..CENTRES_AT_ONCE {
            let reach = if k < here { 0.5 } else { 0.0 };
            let centre = draw(numbers, COLS, 0.0, reach);
            let a: Vec<i32> =
                centre.iter().map(|c| (-2.0 * per_step * f64::from(*c) / step) as i32).collect();
            let square: u64 = a.iter().map(|a| u64::from(a.unsigned_abs()).pow(2)).sum();
            words.push(((square << 32) / u64::from(decay)) as u32 + EXPONENT_MARGIN + 1);
            words.extend(a.as_chunks::<2>().0.iter().map(|[low, high]| pair(*low, *high)));
        }
        // What sums of at most 33 centres, the tail and the bias can hold.
        for _ in 0..OUTPUTS {
            let mut weights = whole(numbers, here, 1200.0);
            weights.resize(CENTRES_AT_ONCE, 0);
            words.extend(weights.as_chunks::<2>().0.iter().map(|[low, high]| pair(*low, *high)));
        }
    }
    let tail = whole(numbers, if affine { COLS * OUTPUTS } else { 0 }, 600.0);
    let parameters = fixed16::Parameters {
        input_midpoint: &midpoint,
        input_per_unit: &per_unit,
        decay,
        bias: &whole(numbers, OUTPUTS, 1e8),
        output_scale: &draw(numbers, OUTPUTS, 2e-8, 1e-8),
        affine: &tail.as_chunks::<2>().0.iter().map(|[l, h]| pair(*l, *h)).collect::<Vec<_>>(),
        centres: &words,
    };
    parameters.words().collect()
}

fn whole(numbers: &mut Numbers, count: usize, reach: f32) -> Vec<i32> {
    draw(numbers, count, 0.0, reach).iter().map(|value| *value as i32).collect()
}

fn pair(low: i32, high: i32) -> u32 {
    (low as u32 & 0xFFFF) | (high as u32) << 16
}

fn encoded(name: &str, networks: &[Network<'_>], row_network: [u8; ROWS]) -> Vec<u8> {
    let (inputs, outputs) = (["x"; ROWS * COLS].join("\n"), ["y"; ROWS * OUTPUTS].join("\n"));
    let zeros = [0; ROWS * OUTPUTS * 4];
    let metadata = Metadata {
        name,
        scene_digest: 0,
        noise_kind: NoiseKind::None,
        noise_level: 0.0,
        seed: 0,
        training_frames: 0,
        thickness_mm: 5.0,
        input_names: Columns(&inputs),
        input_units: Columns(&inputs),
        output_names: Columns(&outputs),
        output_units: Columns(&outputs),
        training_rmse: Floats(&zeros),
        full_scale: Floats(&zeros),
    };
    let parts = ModelParts { networks, row_network: &row_network, metadata };
    // Padding in a blob is counted from its start, which must lie at a multiple of four.
    let mut room = vec![0; encoded_length_bound(&parts) + 3];
    let start = room.as_ptr().align_offset(4);
    encode(&parts, &mut room[start..]).unwrap().to_vec()
}
