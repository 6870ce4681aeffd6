//! Comparison of batches with one line after the other, bit for bit.

use model_core::rbf::{Format, Shape, direct, expanded, fixed16};
use model_core::scale::{HALF_RANGE, UNITS, clamp_units};
use proptest::prelude::*;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::super::{Prepared, infer, infer_line};
use super::exponent::{Expanded, Exponent};
use super::*;

struct Draw(Xoshiro256PlusPlus);

impl Draw {
    fn one(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn floats(&mut self, count: usize, low: f64, high: f64) -> Vec<f32> {
        (0..count).map(|_| self.one(low, high) as f32).collect()
    }
}

/// Words of a network whose training range is about 40 to 80 Ω.
fn words(draw: &mut Draw, shape: Shape, format: Format, affine: bool, one_width: bool) -> Vec<u32> {
    match format {
        Format::F32Direct => direct_words(draw, shape, affine, one_width),
        Format::F32 => expanded_words(draw, shape, affine),
        Format::Fixed16 => fixed16_words(draw, shape, affine),
    }
}

fn direct_words(draw: &mut Draw, shape: Shape, affine: bool, one_width: bool) -> Vec<u32> {
    let Shape { inputs, centres, outputs } = shape;
    let affine = if affine { inputs * outputs } else { 0 };
    let parameters = direct::Parameters {
        input_minimum: &draw.floats(inputs, 40.0, 60.0),
        input_per_span: &draw.floats(inputs, 0.0, 0.2),
        centres: &draw.floats(centres * inputs, -0.1, 1.1),
        // Decays up to where activations vanish.
        decay: &draw.floats(if one_width { 1 } else { centres }, 0.01, 40.0),
        output_weights: &draw.floats(centres * outputs, -1e3, 1e3),
        bias: &draw.floats(outputs, -1.0, 1.0),
        affine: &draw.floats(affine, -1.0, 1.0),
    };
    parameters.words().collect()
}

fn expanded_words(draw: &mut Draw, shape: Shape, affine: bool) -> Vec<u32> {
    let Shape { inputs, centres, outputs } = shape;
    let affine = if affine { inputs * outputs } else { 0 };
    let unit = f64::from(HALF_RANGE / UNITS);
    let decay = draw.one(0.01, 10.0 / inputs as f64) * unit * unit;
    let stored = centres.next_multiple_of(expanded::CENTRES_AT_ONCE);
    let mut exponents = Vec::new();
    for k in 0..stored {
        let within = if k < centres { 0.5 / unit } else { 0.0 };
        let centre: Vec<f64> = (0..inputs).map(|_| draw.one(-within, within)).collect();
        exponents.push(-(decay * centre.iter().map(|c| c * c).sum::<f64>()) as f32);
        exponents.extend(centre.iter().map(|c| (2.0 * decay * c) as f32));
    }
    let parameters = expanded::Parameters {
        input_midpoint: &draw.floats(inputs, 50.0, 70.0),
        input_per_unit: &draw.floats(inputs, 0.0, 0.1 / unit),
        decay: decay as f32,
        bias: &draw.floats(outputs, -1.0, 1.0),
        affine: &draw.floats(affine, -unit, unit),
        exponents: &exponents,
        output_weights: &draw.floats(stored * outputs, -1e3, 1e3),
    };
    parameters.words().collect()
}

/// Words with weights of any bits: sums may wrap around, on the host like on the device.
fn fixed16_words(draw: &mut Draw, shape: Shape, affine: bool) -> Vec<u32> {
    let Shape { inputs, centres, outputs } = shape;
    let pairs = inputs.div_ceil(2);
    // Exponents reach up to 4·1.8² for each of up to four inputs, and for all together beyond four.
    let decay = draw.one(1.0, f64::from(u32::MAX) * (4.0 / inputs as f64).min(1.0)) as u32;
    let slope = f64::from(decay) / 2_f64.powi(33);
    let mut words = Vec::new();
    for _ in 0..centres.div_ceil(fixed16::CENTRES_AT_ONCE) {
        for _ in 0..fixed16::CENTRES_AT_ONCE {
            let mut a = vec![0_i16; 2 * pairs];
            let of_inputs = a[..inputs].iter_mut();
            of_inputs.for_each(|a| *a = (slope * draw.one(-26_214.0, 26_214.0)) as i16);
            let square: u64 = a.iter().map(|a| u64::from(a.unsigned_abs()).pow(2)).sum();
            let b = (square << 32).div_ceil(u64::from(decay)) as u32;
            words.push(b + fixed16::EXPONENT_MARGIN);
            words.extend_from_slice(bytemuck::cast_slice(&a));
        }
        words.extend((0..outputs * fixed16::CENTRES_AT_ONCE / 2).map(|_| draw.0.next_u64() as u32));
    }
    let tail = if affine { outputs * pairs } else { 0 };
    let parameters = fixed16::Parameters {
        input_midpoint: &draw.floats(inputs, 50.0, 70.0),
        input_per_unit: &draw.floats(inputs, 0.0, 0.1 * f64::from(UNITS / HALF_RANGE)),
        decay,
        bias: &(0..outputs).map(|_| draw.0.next_u64() as i32).collect::<Vec<_>>(),
        output_scale: &draw.floats(outputs, -1e-6, 1e-6),
        affine: &(0..tail).map(|_| draw.0.next_u64() as u32).collect::<Vec<_>>(),
        centres: &words,
    };
    parameters.words().collect()
}

fn reading(draw: &mut Draw) -> f64 {
    match draw.0.next_u64() % 400 {
        0 => f64::NAN,
        1 => f64::INFINITY,
        2 => 1e300, // beyond f32
        3 => -3e38,
        4 => 3e38,
        5 => draw.one(-1e6, 1e6),
        _ => draw.one(38.0, 82.0),
    }
}

/// Infers the same lines at once and one after the other, and compares the bits.
fn check(networks: &[Network<'_>], draw: &mut Draw, lines: usize) {
    let Shape { inputs, outputs, .. } = networks[0].shape();
    let columns = networks.len() * inputs;
    let values: Vec<f64> = (0..lines * columns).map(|_| reading(draw)).collect();
    let at_once = Prepared::new(networks, Exponential::Polynomial).infer(&values);
    let mut one_by_one = vec![0.0; at_once.len()];
    let rows = values.chunks_exact(inputs).zip(one_by_one.chunks_exact_mut(outputs));
    for ((readings, places), network) in rows.zip(networks.iter().cycle()) {
        // The fixed-point form needs AVX2.
        let vectorised = Batch::of(network, Exponential::Polynomial).is_some();
        assert!(vectorised || network.format() == Format::Fixed16);
        infer_line(network, Exponential::Polynomial, readings, places);
    }
    let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&at_once), bits(&one_by_one));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Networks of any shape, on tables of any length, with readings missing and beyond all bounds.
    #[test]
    fn lines_at_once_are_lines_one_by_one_bit_for_bit(
        (inputs, centres, outputs) in (1_usize..150, 1_usize..150, 1_usize..24),
        (networks, lines) in (1_usize..4, 0_usize..70),
        format in prop::sample::select(vec![Format::F32Direct, Format::F32, Format::Fixed16]),
        (affine, one_width) in (any::<bool>(), any::<bool>()),
        seed in any::<u64>(),
    ) {
        let mut draw = Draw(Xoshiro256PlusPlus::seed_from_u64(seed));
        let shape = Shape { inputs, centres, outputs };
        let words: Vec<Vec<u32>> =
            (0..networks).map(|_| words(&mut draw, shape, format, affine, one_width)).collect();
        let networks: Vec<Network<'_>> = words
            .iter()
            .map(|words| {
match format {
                    Format::F32Direct => {
                        direct::Network::of_words(shape, one_width, affine, words).unwrap().into()
                    }
                    Format::F32 => expanded::Network::try_new(shape, affine, words).unwrap().into(),
                    Format::Fixed16 => {
                        fixed16::Network::try_new(shape, affine, words).unwrap().into()
                    }
                }
            })
            .collect();
        check(&networks, &mut draw, lines);
    }

    #[test]
    fn the_clamp_is_the_saturating_conversion(bits in any::<u32>()) {
        let scaled = f32::from_bits(bits);
        let clamped = Expanded { decay: 0.0 }.clamp(scaled);
        prop_assert_eq!(clamped.to_bits(), clamp_units(scaled).to_bits());
    }
}

/// All inputs at the end of the range where a sum of squares is largest.
#[test]
fn many_inputs_at_their_lowest_are_as_one_by_one() {
    let mut draw = Draw(Xoshiro256PlusPlus::seed_from_u64(3));
    for inputs in [63, 64, 127, 128, 144, 1000] {
        let shape = Shape { inputs, centres: 20, outputs: 3 };
        let words = fixed16_words(&mut draw, shape, true);
        let network = Network::from(fixed16::Network::try_new(shape, true, &words).unwrap());
        let values = vec![-1e6; 20 * shape.inputs];
        let at_once = infer(&network, Exponential::Polynomial, &values);
        let mut first = vec![0.0; shape.outputs];
        infer_line(&network, Exponential::Polynomial, &values[..shape.inputs], &mut first);
        assert!(at_once.chunks_exact(shape.outputs).all(|line| line == first), "{first:?}");
    }
}

/// Vectors of 1, 4 and 16 numbers, as other machines have.
#[test]
fn vectors_of_any_width_give_the_same_bits() {
    let mut draw = Draw(Xoshiro256PlusPlus::seed_from_u64(2));
    let shape = Shape { inputs: 7, centres: 70, outputs: 5 };
    let words = expanded_words(&mut draw, shape, true);
    let network = Network::from(expanded::Network::try_new(shape, true, &words).unwrap());
    let Some(Batch::Floats(batch)) = Batch::of(&network, Exponential::Polynomial) else { panic!() };
    let readings: Vec<f64> = (0..45 * shape.inputs).map(|_| reading(&mut draw)).collect();
    let expected = infer(&network, Exponential::Polynomial, &readings);
    let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    let check = |infer_in: &dyn Fn(Lines<'_>)| {
        let mut outputs = vec![0.0; expected.len()];
        infer_in(Lines {
            readings: &readings,
            readings_step: shape.inputs,
            outputs: &mut outputs,
            outputs_step: shape.outputs,
        });
        assert_eq!(bits(&outputs), bits(&expected));
    };
    check(&|lines| batch.infer_in(pulp::Scalar, lines));
    check(&|lines| batch.infer_in(pulp::Scalar128b, lines));
    check(&|lines| batch.infer_in(pulp::Scalar512b, lines));
}

#[test]
fn an_output_that_overflows_makes_its_line_nan() {
    let mut draw = Draw(Xoshiro256PlusPlus::seed_from_u64(1));
    let shape = Shape { inputs: 2, centres: 3, outputs: 2 };
    let parameters = direct::Parameters {
        input_minimum: &[40.0; 2],
        input_per_span: &[0.025; 2],
        centres: &[0.5; 6],
        decay: &[5.0],
        output_weights: &[3e38, 1.0, 3e38, 1.0, 3e38, 1.0],
        bias: &[0.0; 2],
        affine: &[],
    };
    let network = Network::from(direct::Network::try_new(shape, parameters).unwrap());
    check(&[network], &mut draw, 50);
    let outputs = infer(&network, Exponential::Polynomial, &[60.0, 60.0, 1e4, -1e4]);
    assert!(outputs[..2].iter().all(|y| y.is_nan()) && outputs[2..].iter().all(|y| y.is_finite()));
}

#[test]
fn special_inputs_are_clamped_as_by_conversion() {
    for scaled in [0.0, -0.0, -0.5, 0.5, UNITS, -UNITS, UNITS.next_down(), f32::MAX, f32::MIN] {
        for scaled in [scaled, scaled.next_up(), f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let clamped = Expanded { decay: 0.0 }.clamp(scaled);
            assert_eq!(clamped.to_bits(), clamp_units(scaled).to_bits(), "{scaled}");
        }
    }
}
