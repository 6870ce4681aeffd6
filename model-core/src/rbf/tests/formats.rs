//! Values that networks in fixed point may have, and how activations fall. Their formula in f64:
//! `host-sim/learn/tests/all/extremes/formats.rs`.

use super::super::*;
use crate::scale::{HALF_RANGE, UNITS};

const SHAPE: Shape = Shape { inputs: 3, centres: 2, outputs: 2 };
/// Decay of σ = 0.8.
const DECAY: u32 = 472_742_311;
/// Factors −2g·c of the inputs, for each centre.
const A: [[i16; 3]; 2] = [[-865, 400, 10], [300, 0, -1000]];
/// Weights of the centres, bias and affine tail of each output.
const WEIGHTS: [[i16; 2]; 2] = [[30_000, -12_000], [-7, 20_000]];
const BIAS: [i32; 2] = [10_000_000, -90_000_000];
const TAIL: [[i16; 3]; 2] = [[900, -4000, 1200], [0, 3, -2000]];
const SCALE: [f32; 2] = [1e-9, 3e-9];
/// Place of the first scale, and of the first b.
const SCALE_AT: usize = 9;
const B_AT: usize = 15;

fn pair(low: i16, high: i16) -> u32 {
    u32::from(low.cast_unsigned()) | u32::from(high.cast_unsigned()) << 16
}

/// b of a centre with these a, as low as it may be.
fn start(a: &[i16], decay: u32) -> u32 {
    let square: u64 = a.iter().map(|a| u64::from(a.unsigned_abs()).pow(2)).sum();
    ((square << 32) / u64::from(decay)) as u32 + fixed16::EXPONENT_MARGIN + 1
}

/// Network of those numbers, for readings from 50 to 58.
fn words() -> Vec<u32> {
    let mut group = Vec::new();
    for k in 0..fixed16::CENTRES_AT_ONCE {
        let a = A.get(k).unwrap_or(&[0; 3]);
        group.extend([start(a, DECAY), pair(a[0], a[1]), pair(a[2], 0)]);
    }
    for [first, second] in WEIGHTS {
        group.push(pair(first, second));
        group.extend([0; 7]);
    }
    let affine = TAIL.map(|[a, b, c]| [pair(a, b), pair(c, 0)]);
    let parameters = fixed16::Parameters {
        input_midpoint: &[54.0; 3],
        input_per_unit: &[UNITS / HALF_RANGE / 8.0; 3],
        decay: DECAY,
        bias: &BIAS,
        output_scale: &SCALE,
        affine: affine.as_flattened(),
        centres: &group,
    };
    parameters.words().collect()
}

#[test]
fn exponents_beyond_their_range_are_refused() {
    for b in [words()[B_AT] - 2, u32::MAX, 0] {
        let mut words = words();
        words[B_AT] = b;
        let refused = fixed16::Network::try_new(SHAPE, true, &words);
        assert_eq!(refused, Err(NetworkError::ExponentOutOfRange { centre: 0 }), "{b}");
    }
    let wide = Shape { inputs: 65_536, centres: 1, outputs: 1 };
    let refused = fixed16::Network::try_new(wide, false, &[]);
    assert_eq!(refused, Err(NetworkError::TooManyInputs { most: 65_535, found: 65_536 }));
}

#[test]
fn numbers_that_could_overflow_an_output_are_refused() {
    let mut words = words();
    words[SCALE_AT] = 1e30_f32.to_bits();
    let refused = fixed16::Network::try_new(SHAPE, true, &words);
    assert_eq!(refused, Err(NetworkError::NotFinite { what: "the largest output" }));
}

/// One input, one centre and one output.
const SMALLEST: Shape = Shape { inputs: 1, centres: 1, outputs: 1 };

/// Network whose centres have this b and a.
fn smallest(decay: u32, line: [u32; 2]) -> Vec<u32> {
    let mut group = vec![0; fixed16::words_at_once(SMALLEST)];
    group[..32].chunks_exact_mut(2).for_each(|place| place.copy_from_slice(&line));
    let parameters = fixed16::Parameters {
        input_midpoint: &[60.0],
        input_per_unit: &[1.0],
        decay,
        bias: &[0],
        output_scale: &[1.0],
        affine: &[],
        centres: &group,
    };
    parameters.words().collect()
}

#[test]
fn activations_are_continuous_and_fall_with_distance() {
    // σ = 0.27, and the centre at the lower end of the training range: at step −26,214.
    let (decay, a) = (4_150_275_433, 12_666);
    let words = smallest(decay, [start(&[a], decay), pair(a, 0)]);
    let network = fixed16::Network::try_new(SMALLEST, false, &words).unwrap();
    let mut before = network.activations(&[-26_214]).next().unwrap()[0];
    // The margin in the exponent may change the last place.
    assert!((0..=1).contains(&(fixed16::HIGHEST_ACTIVATION - before)), "{before}");
    for x in -26_213..=32_767 {
        let activation = network.activations(&[x]).next().unwrap()[0];
        assert!((0..=8).contains(&(before - activation)), "{x}: {before} to {activation}");
        before = activation;
    }
    assert!(before < 40, "{before}"); // nearly ten octaves below
}

#[test]
fn exponents_beyond_their_range_are_refused_by_the_decay_alone() {
    let refused = Err(NetworkError::ExponentOutOfRange { centre: 0 });
    // What the input adds is 2^28 here, a step less.
    let most = u32::MAX - ((1 << 28) - 1);
    let found = [most, most + 1].map(|b| {
        let words = smallest(u32::MAX, [b, 0]);
        fixed16::Network::try_new(SMALLEST, false, &words).map(|_| ())
    });
    assert_eq!(found, [Ok(()), refused]);
}

#[test]
fn a_network_tells_its_training_range_and_its_width() {
    let words = words();
    let network = fixed16::Network::try_new(SHAPE, true, &words).unwrap();
    assert!((network.width() - 0.8).abs() < 1e-4);
    assert_eq!(Network::from(network).training_range(0), [50.0, 58.0]);
    let parameters = float32::Parameters {
        input_minimum: &[50.0],
        input_per_span: &[0.125],
        centres: &[0.5],
        decay: &[2.0],
        output_weights: &[-1.0],
        bias: &[2.0],
        affine: &[3.0],
    };
    let network = Network::from(float32::Network::try_new(SMALLEST, parameters).unwrap());
    assert_eq!(network.training_range(0), [50.0, 58.0]);
}
