//! The models in `testdata`: of the paper's shape, with parameters from a generator, in every format.

use taxel_core::AlignedBytes;
use taxel_core::blob::{Front, Metadata, ModelParts, ModelShape, encode_to_vec};
use taxel_core::projection::Projection;
use taxel_core::rbf::fixed16::{
    CENTRES_AT_ONCE, DECAY_FRACTION_BITS, EXPONENT_FRACTION_BITS, EXPONENT_MARGIN,
};
use taxel_core::rbf::float32::Parameters;
use taxel_core::rbf::{Format, Network, Shape, fixed16, float32};
use taxel_core::reading_model::ReadingModel;
use taxel_core::scale::{HALF_RANGE, UNITS, UNITS_PER_STEP};
use taxel_core::touch::{Kind, Touch};

use crate::checks::{ARRAY_READINGS, ARRAY_ROWS, COLS, Numbers, OUTPUTS, write_reading_model};

/// Decay log₂e/(2σ²) for σ = 0.8.
const DECAY_PER_SPAN_SQUARED: f64 = core::f64::consts::LOG2_E / (2.0 * 0.8 * 0.8);

/// Function that makes a model's blob.
type Maker = fn() -> AlignedBytes;

/// Every model: the name of its file, and the function that makes it.
pub const FILES: [(&str, Maker); 8] = [
    ("hand-made.bin", hand_made),
    ("kernels-f32.bin", || of_format(Format::F32)),
    ("kernels-fixed16.bin", || of_format(Format::Fixed16)),
    ("array-f32.bin", || of_array(Format::F32, 17, true)),
    ("array-fixed16.bin", || of_array(Format::Fixed16, 33, true)),
    ("array-fixed16-no-tail.bin", || of_array(Format::Fixed16, 16, false)),
    ("array-fixed16-confidence.bin", of_readings),
    ("array-touch.bin", of_touch),
];

fn draw(numbers: &mut Numbers, count: usize, middle: f32, reach: f32) -> Vec<f32> {
    (0..count).map(|_| middle + reach * numbers.draw()).collect()
}

/// A model of two networks that the rows use in turn, with a width for every centre.
fn hand_made() -> AlignedBytes {
    let mut numbers = Numbers::new(0);
    let shape = row_shape(12);
    let mut words = || float32_words(&mut numbers, shape, true, 12);
    let (even, odd) = (words(), words());
    let networks = [&even, &odd].map(|words| network(Format::F32, shape, true, words));
    encoded("hand-made", &[], &networks, &[0, 1, 0, 1, 0, 1, 0, 1], None)
}

fn row_shape(centres: usize) -> Shape {
    Shape { inputs: COLS, centres, outputs: OUTPUTS }
}

/// A model of networks with an affine tail and without. K is no multiple of the centres that a routine takes at
/// once.
fn of_format(format: Format) -> AlignedBytes {
    let mut numbers = Numbers::new(5);
    let kinds = [(18, true), (17, false), (33, true)];
    let words =
        kinds.map(|(centres, affine)| words_of(format, &mut numbers, row_shape(centres), affine));
    let networks = [0, 1, 2].map(|index| {
        let (centres, affine) = kinds[index];
        network(format, row_shape(centres), affine, &words[index])
    });
    encoded(format.name(), &[], &networks, &[0, 1, 0, 1, 0, 1, 0, 2], None)
}

/// A model of one network for all rows behind a projection, whose features vary about as much as single readings.
fn of_array(format: Format, centres: usize, affine: bool) -> AlignedBytes {
    let mut numbers = Numbers::new(6);
    let readings = ARRAY_ROWS * COLS;
    let parts = draw(&mut numbers, readings * COLS, 0.0, 0.35);
    let block = projection_block(60.0, &parts);
    let projection = Projection::new(readings, COLS, &block).ok();
    let shape = Shape { inputs: COLS, centres, outputs: ARRAY_ROWS * OUTPUTS };
    let words = words_of(format, &mut numbers, shape, affine);
    let network = network(format, shape, affine, &words);
    let front = Front { outputs: shape.outputs, touch: None, projection };
    encoded(format.name(), &[front], &[network], &[0; ARRAY_ROWS], None)
}

/// The block of a projection with these `parts`, whose features are 60 where all inputs are the `middle`.
fn projection_block(middle: f32, parts: &[f32]) -> Vec<f32> {
    let sum = |feature: usize| parts.iter().skip(feature).step_by(COLS).sum::<f32>();
    let start = (0..COLS).map(|feature| 60.0 - middle * sum(feature));
    start.chain(parts.iter().copied()).collect()
}

/// A model of places in `fixed16`, whose touches move readings up, and of amounts in `f32`, whose touches move them either
/// way; both behind projections of the shape and the strength.
fn of_touch() -> AlignedBytes {
    let mut numbers = Numbers::new(9);
    let readings = ARRAY_ROWS * COLS;
    let [of_places, of_amounts] = [[10.0, 1.0], [3.0, 0.0]].map(|[least, side]| {
        let levels = draw(&mut numbers, readings, 60.0, 1.0);
        let thresholds = draw(&mut numbers, readings, 1.0, 0.5);
        let pairs = levels.into_iter().zip(thresholds).flat_map(|(level, it)| [level, it]);
        [1e-3, 0.5, least, 200.0, side].into_iter().chain(pairs).collect::<Vec<_>>()
    });
    let parts = draw(&mut numbers, (readings + 1) * COLS, 0.0, 10.0);
    let block = projection_block(0.0, &parts);
    let shape = row_shape(17);
    let formats = [Format::Fixed16, Format::F32];
    let words = formats.map(|format| words_of(format, &mut numbers, shape, true));
    let networks = [0, 1].map(|it| network(formats[it], shape, true, &words[it]));
    let kinds = [(Kind::Place, &of_places), (Kind::Amount, &of_amounts)];
    let fronts = kinds.map(|(kind, touch)| Front {
        outputs: OUTPUTS,
        touch: Touch::new(kind, touch).ok(),
        projection: Projection::new(readings + 1, COLS, &block).ok(),
    });
    encoded("touch", &fronts, &networks, &[0; ARRAY_ROWS], None)
}

fn words_of(format: Format, numbers: &mut Numbers, shape: Shape, affine: bool) -> Vec<u32> {
    match format {
        Format::F32 => float32_words(numbers, shape, affine, 1),
        Format::Fixed16 => fixed16_words(numbers, shape, affine),
    }
}

fn network(format: Format, shape: Shape, affine: bool, words: &[u32]) -> Network<'_> {
    match format {
        Format::F32 => float32::Network::of_words(shape, affine, words).unwrap().into(),
        Format::Fixed16 => fixed16::Network::try_new(shape, affine, words).unwrap().into(),
    }
}

/// Parameters whose centres have so many different `widths`, in turn.
fn float32_words(numbers: &mut Numbers, shape: Shape, affine: bool, widths: usize) -> Vec<u32> {
    let Shape { centres, outputs, .. } = shape;
    let mut draw = |count, middle, reach| draw(numbers, count, middle, reach);
    let parameters = Parameters {
        input_minimum: &draw(COLS, 54.0, 1.0),
        input_per_span: &draw(COLS, 0.08, 0.01),
        centres: &draw(centres * COLS, 0.5, 0.5),
        decay: &draw(widths, 0.75, 0.5).repeat(centres / widths),
        output_weights: &draw(centres * outputs, 0.0, 1.0),
        bias: &draw(outputs, 0.0, 1.0),
        affine: &draw(if affine { COLS * outputs } else { 0 }, 0.0, 0.1),
    };
    parameters.words().collect()
}

fn fixed16_words(numbers: &mut Numbers, shape: Shape, affine: bool) -> Vec<u32> {
    let Shape { centres, outputs, .. } = shape;
    // Middles of the training range in Ω, and numbers of units in 1 Ω. One channel never changed.
    let midpoint = draw(numbers, COLS, 60.0, 1.0);
    let mut per_unit = draw(numbers, COLS, UNITS / 7.5, UNITS / 75.0);
    per_unit[COLS - 1] = 0.0;
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
            words.extend(pairs(&a));
        }
        // The scale leaves room for sums of at most 33 centres, the tail and the bias.
        for _ in 0..outputs {
            let mut weights = whole(numbers, here, 1200.0);
            weights.resize(CENTRES_AT_ONCE, 0);
            words.extend(pairs(&weights));
        }
    }
    let tail = whole(numbers, if affine { COLS * outputs } else { 0 }, 600.0);
    let parameters = fixed16::Parameters {
        input_midpoint: &midpoint,
        input_per_unit: &per_unit,
        decay,
        bias: &whole(numbers, outputs, 1e8),
        output_scale: &draw(numbers, outputs, 2e-8, 1e-8),
        affine: &pairs(&tail).collect::<Vec<_>>(),
        centres: &words,
    };
    parameters.words().collect()
}

fn whole(numbers: &mut Numbers, count: usize, reach: f32) -> Vec<i32> {
    draw(numbers, count, 0.0, reach).iter().map(|value| *value as i32).collect()
}

/// Numbers of 16 bits, two in each word.
fn pairs(numbers: &[i32]) -> impl Iterator<Item = u32> {
    let pairs = numbers.as_chunks::<2>().0.iter();
    pairs.map(|[low, high]| (*low as u32 & 0xFFFF) | (*high as u32) << 16)
}

/// A small model of the small sensor, with a reading model.
fn of_readings() -> AlignedBytes {
    let mut numbers = Numbers::new(8);
    let shape = row_shape(1);
    let words = words_of(Format::Fixed16, &mut numbers, shape, false);
    let network = network(Format::Fixed16, shape, false, &words);
    let mut block = vec![0.0; ARRAY_READINGS.block_floats()];
    write_reading_model(ARRAY_READINGS, &mut block, &mut numbers);
    let reading_model = ReadingModel::new(ARRAY_READINGS, &block).unwrap();
    encoded("reading model", &[], &[network], &[0; ARRAY_ROWS], Some(reading_model))
}

fn encoded(
    name: &str,
    fronts: &[Front<'_>],
    networks: &[Network<'_>],
    row_network: &[u8],
    reading_model: Option<ReadingModel<'_>>,
) -> AlignedBytes {
    let shape = ModelShape { rows: row_network.len(), inputs: COLS, outputs: OUTPUTS };
    let unnamed = Metadata::unnamed(shape);
    // In the files in testdata, the units have the same names as the columns.
    let (input_units, output_units) = (unnamed.input_names, unnamed.output_names);
    let metadata = Metadata { name, thickness_mm: 5.0, input_units, output_units, ..unnamed };
    let parts =
        ModelParts { fronts, reading_model, ..ModelParts::new(networks, row_network, metadata) };
    encode_to_vec(&parts).unwrap()
}
