//! The network in 16-bit fixed point.
//!
//! With g = log₂e/(2σ²), exp(−‖x − c‖²/(2σ²)) = 2^−v. Inputs x have 16 bits, the upper halves of saturated integers in
//! [`UNITS`], counted from the middle of the training range. The exponent v = g‖x − c‖² is an unsigned 6.26 number:
//! v = b + a·x + g‖x‖². There a = −2g·c has 16 bits, so c is exactly −a/(2g) after a was rounded, and b = g‖c‖² +
//! [`EXPONENT_MARGIN`]. The activation 2^−v has 16 bits (Q15): a cubic for the fraction, a shift for the integer
//! part. Weights have 16 bits and a scale for each output; sums have 32 bits.
//!
//! No result wraps around. Inputs saturate. A check of the parameters ensures that v stays between 0 and 2³²
//! for every input. The trainer proves that sums fit, by a bound on the network's norm; partial sums may wrap,
//! which does not change the result modulo 2³².
//!
//! Sums start with the bias and end with one multiplication by the scale. All before it is in integers, so that
//! any order gives the same bits.
#![cfg_attr(
    cortex_m4f,
    expect(unsafe_code, reason = "calls to assembly, whose conditions are checked before")
)]

use core::f32::consts::LOG2_E;

use super::parameters::{Cut, NetworkError, Shape, check_finite, check_length, check_spans};
#[cfg(cortex_m4f)]
use crate::cortex_m4::{self, Inputs};
use crate::cortex_m4::{Block, INPUTS, OUTPUTS};
use crate::scale::{HALF_RANGE, UNITS, UNITS_PER_STEP, clamp_steps, saturates};

/// Number of centres in a group: K is rounded up to a multiple of it in the block.
pub const CENTRES_AT_ONCE: usize = 16;
/// Largest number of inputs of a network.
pub const MOST_INPUTS: usize = 65_535;
/// Number of fraction bits of an exponent v.
pub const EXPONENT_FRACTION_BITS: u32 = 26;
/// Number of fraction bits of the decay g, which is per step².
pub const DECAY_FRACTION_BITS: u32 = 34;
/// Margin that b holds beyond g‖c‖², in units of the last place: more than truncation can take away.
pub const EXPONENT_MARGIN: u32 = 8;
/// The activation at a distance of 0, in Q15; 1 would be 32768.
pub const HIGHEST_ACTIVATION: i32 = 32_766;

/// Coefficients of the cubic p(f) = Σ c_i·f^i for 2^−f on [0, 1), within 1.1e-4. It is continuous over whole
/// numbers: p(1) = p(0)/2.
///
/// They are in Q33, Q27, Q21 and Q15, since each product with f (Q26) drops 32 bits.
pub const CUBIC: [i32; 4] = [-335_049_012, 30_875_674, -1_449_129, HIGHEST_ACTIVATION];

/// The parameters of one network, borrowed from its block.
///
/// K' is K rounded up to a multiple of [`CENTRES_AT_ONCE`]. A *pair* is a word of two `i16`, the first in its low
/// half. I' is the number of pairs of inputs (a last odd input is paired with 0).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters<'a> {
    /// Middle of each input's training range, in the reading's unit: `[inputs]`.
    pub input_midpoint: &'a [f32],
    /// Number of [`UNITS`] in one unit of the reading; 0 for a channel that never changed: `[inputs]`.
    pub input_per_unit: &'a [f32],
    /// Decay g per step², in units of 2^−(26 + 34).
    pub decay: u32,
    /// Bias in units of the sums: `[outputs]`.
    pub bias: &'a [i32],
    /// Value of one unit of a sum, in the outputs' units: `[outputs]`.
    pub output_scale: &'a [f32],
    /// Affine tail in pairs of inputs: `[outputs × I']`, or empty.
    pub affine: &'a [u32],
    /// Groups of sixteen centres (`[K'/16]`): for each centre b and then the pairs of a (`[16 × (1 + I')]`),
    /// followed by the group's output weights in pairs of centres (`[outputs × 8]`).
    pub centres: &'a [u32],
}

impl Parameters<'_> {
    /// All parameters as words, one array after the other: the block that `Network::try_new` takes.
    pub fn words(&self) -> impl Iterator<Item = u32> {
        let bits = |value: &f32| value.to_bits();
        let before = self.input_midpoint.iter().chain(self.input_per_unit).map(bits);
        let bias = self.bias.iter().map(|&bias| bias as u32);
        let scale = self.output_scale.iter().map(bits);
        let after = self.affine.iter().chain(self.centres).copied();
        before.chain([self.decay]).chain(bias).chain(scale).chain(after)
    }
}

/// A network in 16-bit fixed point, whose block of words has been checked against its shape.
///
/// A Cortex-M4F infers by an assembly routine. Elsewhere the routine's compiled twin is used: portable Rust that gives
/// the same bits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Network<'a>(Block<'a>);

impl<'a> Network<'a> {
    /// Makes a network after checking the length and values of `block`, the words of [`Parameters::words`].
    ///
    /// After that, no reading can drive an exponent out of the format's range, nor an output out of f32. That the
    /// sums of 16-bit weights fit is not checked here: it is proved where a network is quantised.
    ///
    /// # Errors
    /// Every variant of [`NetworkError`]; the length is checked before values.
    pub fn try_new(shape: Shape, affine: bool, block: &'a [u32]) -> Result<Self, NetworkError> {
        let network = Self::with_length_checked(shape, affine, block)?;
        network.check_values()?;
        Ok(network)
    }

    /// Makes a network after checking the length alone, for a block whose values were checked before.
    #[inline(always)]
    pub(crate) const fn with_length_checked(
        shape: Shape,
        affine: bool,
        block: &'a [u32],
    ) -> Result<Self, NetworkError> {
        let Shape { inputs, centres, outputs } = shape;
        if inputs == 0 || centres == 0 || outputs == 0 {
            return Err(NetworkError::Empty);
        }
        if inputs > MOST_INPUTS {
            return Err(NetworkError::TooManyInputs { most: MOST_INPUTS, found: inputs });
        }
        match check_length("block", block, Self::block_words(shape, affine)) {
            Ok(()) => Ok(Self(Block::new([inputs, centres, outputs], affine, block))),
            Err(cause) => Err(cause),
        }
    }

    /// Number of words in the block of a network of this shape, with an affine tail or without.
    #[inline]
    pub const fn block_words(shape: Shape, affine: bool) -> usize {
        let Shape { inputs, centres, outputs } = shape;
        let pairs = inputs.div_ceil(2);
        let affine = if affine { pairs.saturating_mul(outputs) } else { 0 };
        let centres = centres.div_ceil(CENTRES_AT_ONCE).saturating_mul(words_at_once(shape));
        let scales = inputs.saturating_add(outputs).saturating_mul(2).saturating_add(1);
        scales.saturating_add(affine).saturating_add(centres)
    }

    /// The network's numbers of inputs, centres and outputs.
    pub fn shape(&self) -> Shape {
        let Block { inputs, centres, outputs, .. } = self.0;
        Shape { inputs, centres, outputs }
    }

    /// Whether the network has an affine tail.
    pub fn has_affine_tail(&self) -> bool {
        self.0.affine()
    }

    /// All words of the network.
    pub fn block(&self) -> &'a [u32] {
        self.0.words
    }

    /// The network's parameters, cut from its block.
    pub fn parameters(&self) -> Parameters<'a> {
        let Shape { inputs, centres, outputs } = self.shape();
        let mut cut = Cut(self.block());
        Parameters {
            input_midpoint: cut.floats(inputs),
            input_per_unit: cut.floats(inputs),
            decay: cut.words(1).first().copied().unwrap_or_default(),
            bias: bytemuck::cast_slice(cut.words(outputs)),
            output_scale: cut.floats(outputs),
            affine: cut.words(if self.has_affine_tail() {
                inputs.div_ceil(2) * outputs
            } else {
                0
            }),
            centres: cut.words(centres.div_ceil(CENTRES_AT_ONCE) * words_at_once(self.shape())),
        }
    }

    /// Width σ of all centres on inputs scaled to [0, 1].
    pub fn width(&self) -> f32 {
        // 2^60 is where the decay's last place stands.
        let per_step_squared = self.parameters().decay as f32 / 1_152_921_504_606_846_976.0;
        let step = HALF_RANGE / UNITS * UNITS_PER_STEP;
        libm::sqrtf(LOG2_E / (2.0 * per_step_squared)) * step
    }

    pub(crate) fn check_values(&self) -> Result<(), NetworkError> {
        let p = self.parameters();
        let decay = u64::from(p.decay);
        if decay == 0 {
            return Err(NetworkError::InvalidWidth { centre: 0 });
        }
        check_finite(&[
            ("input_midpoint", p.input_midpoint),
            ("input_per_unit", p.input_per_unit),
            ("output_scale", p.output_scale),
        ])?;
        check_spans(p.input_per_unit)?;
        if p.output_scale.iter().any(|scale| !(scale * UNITS).is_finite()) {
            return Err(NetworkError::NotFinite { what: "the largest output" });
        }
        let most_shared = (((self.shape().inputs as u64) << 26) * decay) >> 30;
        let line = 1 + self.shape().inputs.div_ceil(2);
        let lines = self.centres().flat_map(|(exponents, _)| exponents.chunks_exact(line));
        for (centre, line) in lines.enumerate() {
            let Some((&b, a)) = line.split_first() else { continue };
            let b = u64::from(b);
            // b + a·x + g‖x‖² is highest in a corner of the clamp's box, and lowest at x = −a/(2g).
            let (mut reach, mut square) = (b + most_shared, 0);
            for a in a.iter().flat_map(|&pair| halves(pair)) {
                reach += u64::from(a.unsigned_abs()) << 15;
                square += u64::from(a.unsigned_abs().pow(2));
            }
            let room = b.checked_sub(EXPONENT_MARGIN.into());
            let enough = room.is_some_and(|b| (b * decay) >> 32 >= square);
            if !enough || reach > u64::from(u32::MAX) {
                return Err(NetworkError::ExponentOutOfRange { centre });
            }
        }
        Ok(())
    }

    /// Lowest and highest reading of `input` in training, in its unit; NaN if there is no such input.
    pub(super) fn training_range(&self, input: usize) -> [f32; 2] {
        let p = self.parameters();
        let limits = (p.input_midpoint.get(input), p.input_per_unit.get(input));
        let (Some(&midpoint), Some(&per_unit)) = limits else { return [f32::NAN; 2] };
        let half = if per_unit > 0.0 { 0.5 / HALF_RANGE * UNITS / per_unit } else { 0.0 };
        [midpoint - half, midpoint + half]
    }

    /// Converts readings to units counted from the middle of the training range, not clamped yet. Returns whether one
    /// [will be clamped](saturates), or is NaN.
    #[inline(always)]
    pub(crate) fn scale(&self, reading: &[f32], scaled: &mut [f32]) -> bool {
        let p = self.parameters();
        let limits = p.input_midpoint.iter().zip(p.input_per_unit);
        let mut any_saturates = false;
        for ((x, &r), (&midpoint, &per_unit)) in scaled.iter_mut().zip(reading).zip(limits) {
            *x = (r - midpoint) * per_unit;
            any_saturates |= saturates(*x);
        }
        any_saturates
    }

    /// Infers `output` from one row of readings; `scaled` is working space. All must have the lengths of the shape.
    /// Returns whether a reading was clamped, NaN or infinite.
    #[inline(always)]
    pub(crate) fn infer(&self, reading: &[f32], scaled: &mut [f32], output: &mut [f32]) -> bool {
        #[cfg(cortex_m4f)]
        if reading.len() == self.0.inputs && self.fit(scaled, output) {
            // SAFETY: the lengths are the network's, as was just checked. When the network was made, its block was
            // found to be as long as its shape asks for, and no dimension to be 0.
            return unsafe {
                cortex_m4::fixed16(&self.0, Inputs::Readings(reading, scaled), output)
            };
        }
        #[cfg(not(cortex_m4f))]
        {
            let clamped = self.scale(reading, scaled);
            self.infer_scaled_in_rust(scaled, output);
            clamped
        }
        #[cfg(cortex_m4f)]
        true
    }

    /// Infers `output` from `scaled` inputs, which are overwritten. Both must have the lengths of the shape.
    #[inline(always)]
    pub(crate) fn infer_scaled(&self, scaled: &mut [f32], output: &mut [f32]) {
        #[cfg(cortex_m4f)]
        if self.fit(scaled, output) {
            // SAFETY: as in `infer`.
            unsafe { cortex_m4::fixed16(&self.0, Inputs::Scaled(scaled), output) };
        }
        #[cfg(not(cortex_m4f))]
        self.infer_scaled_in_rust(scaled, output);
    }

    /// Whether buffers have the lengths of the shape.
    #[cfg(cortex_m4f)]
    #[inline(always)]
    fn fit(&self, scaled: &[f32], output: &[f32]) -> bool {
        scaled.len() == self.0.inputs && output.len() == self.0.outputs
    }

    /// Infers `output` from `scaled` inputs, which are overwritten, in Rust: the same bits as the routine's.
    #[inline(always)]
    fn infer_scaled_in_rust(&self, scaled: &mut [f32], output: &mut [f32]) {
        let p = self.parameters();
        // The caller's buffers also hold the integers: no others have the right length.
        let x = bytemuck::cast_slice_mut::<f32, i32>(scaled);
        x.iter_mut().for_each(|x| *x = clamp_steps(f32::from_bits(*x as u32)));
        let sums = bytemuck::cast_slice_mut::<f32, i32>(output);
        sums.iter_mut().zip(p.bias).for_each(|(sum, &bias)| *sum = bias);
        let (pairs, shared) =
            (x.len().div_ceil(2).max(1), shared_term(p.decay, square(x), x.len()));
        for (sum, row) in sums.iter_mut().zip(p.affine.chunks_exact(pairs)) {
            *sum = add_products(*sum, row, x);
        }
        for (exponents, weights) in self.centres() {
            let activations = activations_of(exponents, shared, x);
            for (sum, row) in sums.iter_mut().zip(weights.chunks_exact(CENTRES_AT_ONCE / 2)) {
                *sum = add_products(*sum, row, &activations);
            }
        }
        for (y, scale) in output.iter_mut().zip(p.output_scale) {
            *y = y.to_bits().cast_signed() as f32 * scale;
        }
    }

    /// Infers as [`rbf::Network::infer_scaled`](super::Network::infer_scaled) does, to the bit, by the assembly's
    /// compiled twin, with separate code for the usual sizes. It is public to measure what the assembly saves.
    ///
    /// `scaled` and `output` must have the lengths of the shape; elements beyond are ignored.
    #[inline(never)]
    pub fn infer_scaled_portably(&self, scaled: &mut [f32], output: &mut [f32]) {
        let usual: (Result<&mut [f32; INPUTS], _>, Result<&mut [f32; OUTPUTS], _>) =
            ((&mut *scaled).try_into(), (&mut *output).try_into());
        if let (Ok(scaled), Ok(output)) = usual {
            self.infer_scaled_in_rust(scaled, output);
        } else {
            self.infer_scaled_in_rust(scaled, output);
        }
    }

    /// The groups of sixteen centres: for each, the lines of its exponents, and its weights.
    fn centres(&self) -> impl Iterator<Item = (&'a [u32], &'a [u32])> {
        let exponents = CENTRES_AT_ONCE * (1 + self.shape().inputs.div_ceil(2));
        let at_once = self.parameters().centres.chunks_exact(words_at_once(self.shape()).max(1));
        at_once.map(move |words| words.split_at_checked(exponents).unwrap_or_default())
    }

    /// Activations in Q15, for one group of sixteen centres after the other, of inputs `x` in steps
    /// ([`clamp_steps`]). A trainer fits output weights to them.
    pub fn activations(&self, x: &[i32]) -> impl Iterator<Item = [i32; CENTRES_AT_ONCE]> {
        let shared = shared_term(self.parameters().decay, square(x), x.len());
        self.centres().map(move |(exponents, _)| activations_of(exponents, shared, x))
    }
}

/// Number of words that a group of sixteen centres takes in [`Parameters::centres`].
#[inline]
pub const fn words_at_once(shape: Shape) -> usize {
    CENTRES_AT_ONCE
        .saturating_mul(1 + shape.inputs.div_ceil(2))
        .saturating_add((CENTRES_AT_ONCE / 2).saturating_mul(shape.outputs))
}

/// The two `i16` of a pair, the low half first.
fn halves(pair: u32) -> [i32; 2] {
    [i32::from(pair as i16), i32::from((pair >> 16) as i16)]
}

/// `sum` plus the products of the `i16` in `pairs` with the `values` in the same places.
#[inline(always)]
fn add_products(sum: i32, pairs: &[u32], values: &[i32]) -> i32 {
    let (twos, rest) = values.as_chunks::<2>();
    let mut sum = sum;
    for (&pair, two) in pairs.iter().zip(twos) {
        let [low, high] = halves(pair);
        sum = sum.wrapping_add(low * two[0]).wrapping_add(high * two[1]);
    }
    if let (Some(&pair), Some(&last)) = (pairs.get(twos.len()), rest.first()) {
        sum = sum.wrapping_add(halves(pair)[0] * last);
    }
    sum
}

/// Number of bits that ‖x‖² of so many inputs drops, so that the rest fits 32 bits.
///
/// Up to 63 inputs it is 4. What the bits are worth in an exponent stays below 5 units, less than
/// [`EXPONENT_MARGIN`]: with more inputs, exponents below 64 allow only a smaller decay.
#[inline]
pub fn square_shift(inputs: usize) -> u32 {
    inputs.checked_ilog2().unwrap_or(0).saturating_sub(1).max(4)
}

/// The sum of squares ‖x‖² of inputs in steps.
#[inline(always)]
fn square(x: &[i32]) -> u64 {
    x.iter().map(|&x| u64::from(x.unsigned_abs()).pow(2)).sum()
}

/// The term g‖x‖² of the exponent, which all centres share, of the sum of squares of so many `inputs`.
#[inline(always)]
pub fn shared_term(decay: u32, square: u64, inputs: usize) -> u32 {
    let shift = square_shift(inputs);
    (((square >> shift) * u64::from(decay)) >> (DECAY_FRACTION_BITS - shift)) as u32
}

/// The activation 2^−v in Q15, of an exponent v in units of its last place.
#[inline(always)]
pub fn power(v: u32) -> i32 {
    let fraction = i64::from(v & ((1 << EXPONENT_FRACTION_BITS) - 1));
    let [c3, c2, c1, c0] = CUBIC;
    let mut p = c3;
    for c in [c2, c1, c0] {
        p = ((fraction * i64::from(p)) >> 32) as i32 + c;
    }
    p.checked_shr(v >> EXPONENT_FRACTION_BITS).unwrap_or(0)
}

#[inline(always)]
fn activations_of(exponents: &[u32], shared: u32, x: &[i32]) -> [i32; CENTRES_AT_ONCE] {
    let mut activations = [0; CENTRES_AT_ONCE];
    let lines = exponents.chunks_exact(1 + x.len().div_ceil(2));
    for (activation, line) in activations.iter_mut().zip(lines) {
        let Some((&b, a)) = line.split_first() else { continue };
        *activation =
            power((add_products(b.cast_signed(), a, x).cast_unsigned()).wrapping_add(shared));
    }
    activations
}
