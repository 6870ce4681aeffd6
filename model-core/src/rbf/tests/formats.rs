//! Networks in fixed point, compared with their formulas in f64.

use super::super::*;
use crate::scale::{CLAMP, HALF_RANGE, UNITS, UNITS_PER_STEP};
use proptest::prelude::*;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Parameters of a network's formula: centres on inputs scaled to [0, 1], σ, weights, bias, affine tail.
struct Formula {
    shape: Shape,
    minimum: Vec<f64>,
    span: Vec<f64>,
    centres: Vec<f64>,
    sigma: f64,
    weights: Vec<f64>,
    bias: Vec<f64>,
    affine: Vec<f64>,
}

impl Formula {
    fn random(shape: Shape, sigma: f64, affine: bool, seed: u64) -> Self {
        let mut source = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut draw = |count: usize, low: f64, high: f64| -> Vec<f64> {
            let unit = |bits: u64| (bits >> 11) as f64 / (1_u64 << 53) as f64;
            (0..count).map(|_| low + (high - low) * unit(source.next_u64())).collect()
        };
        let Shape { inputs, centres, outputs } = shape;
        Self {
            shape,
            minimum: draw(inputs, 40.0, 60.0),
            span: draw(inputs, 5.0, 20.0),
            centres: draw(centres * inputs, 0.0, 1.0),
            sigma,
            weights: draw(centres * outputs, -1.0, 1.0),
            bias: draw(outputs, -1.0, 1.0),
            affine: draw(if affine { inputs * outputs } else { 0 }, -0.5, 0.5),
        }
    }

    fn reading(&self, place: &[f64]) -> Vec<f32> {
        let limits = self.minimum.iter().zip(&self.span);
        place.iter().zip(limits).map(|(x, (minimum, span))| (minimum + x * span) as f32).collect()
    }

    fn outputs(&self, reading: &[f32]) -> Vec<f64> {
        let limits = self.minimum.iter().zip(&self.span);
        let place = |(&r, (minimum, span)): (&f32, (&f64, &f64))| {
            ((f64::from(r) - minimum) / span).clamp(CLAMP[0].into(), CLAMP[1].into())
        };
        let x: Vec<f64> = reading.iter().zip(limits).map(place).collect();
        let mut outputs = self.bias.clone();
        let mut add = |factor: f64, row: &[f64]| {
            outputs.iter_mut().zip(row).for_each(|(y, w)| *y += factor * w);
        };
        for (x, row) in x.iter().zip(self.affine.chunks(self.shape.outputs)) {
            add(x - 0.5, row); // the tail is on inputs about the middle
        }
        let lines = self.centres.chunks(self.shape.inputs);
        for (centre, row) in lines.zip(self.weights.chunks(self.shape.outputs)) {
            let square: f64 = x.iter().zip(centre).map(|(x, c)| (x - c).powi(2)).sum();
            add((-square / (2.0 * self.sigma * self.sigma)).exp(), row);
        }
        outputs
    }

    /// Middle of each input's range, and number of units in one unit of the reading.
    fn scaling(&self) -> [Vec<f32>; 2] {
        let half = f64::from(HALF_RANGE);
        let limits = || self.minimum.iter().zip(&self.span);
        [
            limits().map(|(minimum, span)| (minimum + 0.5 * span) as f32).collect(),
            limits().map(|(_, span)| (f64::from(UNITS) / (half * span)) as f32).collect(),
        ]
    }

    /// log₂e/(2σ²) for inputs counted in `unit` spans.
    fn decay(&self, unit: f64) -> f64 {
        core::f64::consts::LOG2_E / (2.0 * self.sigma * self.sigma) * unit * unit
    }

    fn fixed16(&self) -> Vec<u32> {
        let Shape { inputs, centres, outputs } = self.shape;
        let unit = f64::from(HALF_RANGE / UNITS * UNITS_PER_STEP);
        let decay = (self.decay(unit) * 2_f64.powi(60)).round();
        let pair = |low: f64, high: f64| {
            u32::from(low.round() as i16 as u16) | u32::from(high.round() as i16 as u16) << 16
        };
        let at = |values: &[f64], i: usize| values.get(i).copied().unwrap_or(0.0);
        // Sums of centres·1 + inputs·½ + 1 must fit.
        let scale = (centres + inputs + 1) as f64 / 2_f64.powi(31);
        let mut words = Vec::new();
        for block in 0..centres.div_ceil(fixed16::CENTRES_AT_ONCE) {
            let numbers = block * 16..block * 16 + 16;
            for k in numbers.clone() {
                let a: Vec<f64> = (0..inputs)
                    .map(|i| if k < centres { self.centres[k * inputs + i] } else { 0.5 })
                    .map(|c| (-2.0 * decay / 2_f64.powi(34) * (c - 0.5) / unit).round())
                    .collect();
                let square: f64 = a.iter().map(|a| a * a).sum();
                words.push((square * 2_f64.powi(32) / decay) as u32 + fixed16::EXPONENT_MARGIN + 1);
                words.extend((0..inputs.div_ceil(2)).map(|p| pair(a[2 * p], at(&a, 2 * p + 1))));
            }
            for o in 0..outputs {
                let weight = |k: usize| at(&self.weights, k * outputs + o) / scale / 32768.0;
                let weight = |k: usize| if k < centres { weight(k) } else { 0.0 };
                words.extend(numbers.clone().step_by(2).map(|k| pair(weight(k), weight(k + 1))));
            }
        }
        let mut affine = Vec::new();
        for o in 0..if self.affine.is_empty() { 0 } else { outputs } {
            let a = |i: usize| at(&self.affine, i * outputs + o) * unit / scale;
            let a = |i: usize| if i < inputs { a(i) } else { 0.0 };
            affine.extend((0..inputs.div_ceil(2)).map(|p| pair(a(2 * p), a(2 * p + 1))));
        }
        let [midpoint, per_unit] = self.scaling();
        let parameters = fixed16::Parameters {
            input_midpoint: &midpoint,
            input_per_unit: &per_unit,
            decay: decay as u32,
            bias: &self.bias.iter().map(|b| (b / scale).round() as i32).collect::<Vec<_>>(),
            output_scale: &vec![scale as f32; outputs],
            affine: &affine,
            centres: &words,
        };
        parameters.words().collect()
    }

    fn error_of(&self, network: &Network<'_>, place: &[f64]) -> f64 {
        let reading = self.reading(place);
        let (mut scaled, mut output) =
            (vec![0.0; self.shape.inputs], vec![0.0; self.shape.outputs]);
        network.infer(&reading, &mut scaled, &mut output).unwrap();
        let truth = self.outputs(&reading);
        let errors = output.iter().zip(truth).map(|(y, truth)| (f64::from(*y) - truth).abs());
        errors.fold(0.0, f64::max)
    }
}

const SHAPES: [Shape; 4] = [
    Shape { inputs: 18, centres: 64, outputs: 18 },
    Shape { inputs: 5, centres: 3, outputs: 2 },
    Shape { inputs: 12, centres: 17, outputs: 5 },
    Shape { inputs: 1, centres: 1, outputs: 1 },
];

proptest! {
    #[test]
    fn fixed16_follows_the_formula(
        which in 0..4_usize,
        sigma in 0.6..2.0_f64,
        affine: bool,
        seed: u64,
        place in prop::collection::vec(-1.0..2.0_f64, 18),
    ) {
        let shape = SHAPES[which];
        let formula = Formula::random(shape, sigma, affine, seed);
        let place = &place[..shape.inputs];

        let words = formula.fixed16();
        let network = fixed16::Network::try_new(shape, affine, &words).unwrap();
        prop_assert!((f64::from(network.width()) - sigma).abs() < 1e-4);
        let [low, high] = network.training_range(0).map(f64::from);
        prop_assert!((low - formula.minimum[0]).abs() < 1e-4);
        prop_assert!((high - low - formula.span[0]).abs() < 1e-4);
        // The error comes from the cubic (within 1.1e-4), from rounded centres, and from weights of at most 16
        // bits.
        let error = formula.error_of(&network.into(), place);
        prop_assert!(error < 6e-4 * shape.centres as f64, "fixed16: {error}");
    }
}

#[test]
fn exponents_beyond_their_range_are_refused() {
    let formula = Formula::random(SHAPES[1], 0.8, false, 1);
    let sound = formula.fixed16();
    let first = SHAPES[1].inputs * 2 + 1 + SHAPES[1].outputs * 2;
    for b in [sound[first] - 2, u32::MAX, 0] {
        let mut words = sound.clone();
        words[first] = b;
        let refused = fixed16::Network::try_new(SHAPES[1], false, &words);
        assert_eq!(refused, Err(NetworkError::ExponentOutOfRange { centre: 0 }), "{b}");
    }
    let wide = Shape { inputs: 65_536, centres: 1, outputs: 1 };
    let refused = fixed16::Network::try_new(wide, false, &[]);
    assert_eq!(refused, Err(NetworkError::TooManyInputs { most: 65_535, found: 65_536 }));
}

#[test]
fn numbers_that_could_overflow_an_output_are_refused() {
    let formula = Formula::random(SHAPES[1], 0.8, false, 1);
    let mut words = formula.fixed16();
    words[SHAPES[1].inputs * 2 + 1 + SHAPES[1].outputs] = 1e30_f32.to_bits();
    let refused = fixed16::Network::try_new(SHAPES[1], false, &words);
    assert_eq!(refused, Err(NetworkError::NotFinite { what: "the largest output" }));
}

#[test]
fn activations_are_continuous_and_fall_with_distance() {
    let shape = Shape { inputs: 1, centres: 1, outputs: 1 };
    let formula = Formula {
        shape,
        minimum: vec![0.0],
        span: vec![1.0],
        centres: vec![0.0],
        sigma: 0.27,
        weights: vec![1.0],
        bias: vec![0.0],
        affine: vec![],
    };
    let words = formula.fixed16();
    let network = fixed16::Network::try_new(shape, false, &words).unwrap();
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

/// One input, one centre and one output.
const SMALLEST: Shape = Shape { inputs: 1, centres: 1, outputs: 1 };

#[test]
fn exponents_beyond_their_range_are_refused_by_the_decay_alone() {
    let refused = Err(NetworkError::ExponentOutOfRange { centre: 0 });
    // What the input adds is 2^28 here, a step less.
    let fixed16 = |start: u32| {
        let mut group = vec![0; fixed16::words_at_once(SMALLEST)];
        group[..32].chunks_exact_mut(2).for_each(|line| line[0] = start);
        let parameters = fixed16::Parameters {
            input_midpoint: &[60.0],
            input_per_unit: &[1.0],
            decay: u32::MAX,
            bias: &[0],
            output_scale: &[1.0],
            affine: &[],
            centres: &group,
        };
        let words: Vec<u32> = parameters.words().collect();
        fixed16::Network::try_new(SMALLEST, false, &words).map(|_| ())
    };
    let most = u32::MAX - ((1 << 28) - 1);
    assert_eq!([most, most + 1].map(fixed16), [Ok(()), refused]);
}

#[test]
fn a_network_in_f32_tells_its_training_range() {
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
