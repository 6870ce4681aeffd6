//! The network in f32 with expanded distances.
//!
//! With g = log₂e/(2σ²), exp(−‖x − c‖²/(2σ²)) = 2^(b + a·x − g‖x‖²), where a = 2g·c and b = −g‖c‖². This takes
//! two operations for each input and centre instead of three, and no constant of the base e.
//!
//! Products cancel, so a model uses this form only where the trainer has proved the rounding harmless. Inputs
//! are counted from the middle of the training range, and clamped, which makes the bound small (400 % error was
//! seen at an offset of 100 spans).
//!
//! Inputs are in [`UNITS`]. b + a·x − g‖x‖² adds up in four interleaved partial sums; the first starts with b, the
//! second with −g‖x‖². Centres are stored in groups of four; the last group may be filled up with zero weights.
#![cfg_attr(
    cortex_m4f,
    expect(unsafe_code, reason = "calls to assembly, whose conditions are checked before")
)]

use super::packed::{self, Layout};
use super::parameters::{
    Cut, NetworkError, Shape, accumulate, check_finite, check_spans, magnitudes, range_about,
    scale_about,
};
#[cfg(cortex_m4f)]
use crate::cortex_m4::{self, Inputs};
use crate::exp::exp2;
use crate::feature::{F32Built, Feature};
use crate::scale::{HALF_RANGE, UNITS, clamp_units};

/// Number of centres in a group: K is rounded up to a multiple of it in the block.
pub const CENTRES_AT_ONCE: usize = 4;

/// Smallest exponent that a network may reach; 2^−126 is the smallest normal number.
pub const LOWEST_EXPONENT: f32 = -125.0;

/// Largest exponent that a network may reach: rounding can lift an exponent slightly above 0.
pub const HIGHEST_EXPONENT: f32 = 0.125;

/// The parameters of one network, borrowed from its block. K' is K rounded up to a multiple of
/// [`CENTRES_AT_ONCE`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters<'a> {
    /// Middle of each input's training range, in the reading's unit: `[inputs]`.
    pub input_midpoint: &'a [f32],
    /// Number of [`UNITS`] in one unit of the reading; 0 for a channel that never changed: `[inputs]`.
    pub input_per_unit: &'a [f32],
    /// Decay g = log₂e/(2σ²), on inputs in [`UNITS`].
    pub decay: f32,
    /// Bias in the outputs' units: `[outputs]`.
    pub bias: &'a [f32],
    /// Affine tail A on inputs in [`UNITS`], input after input: `[inputs × outputs]`, or empty.
    pub affine: &'a [f32],
    /// Coefficients of the exponents, b and then a, centre after centre: `[K' × (1 + inputs)]`.
    pub exponents: &'a [f32],
    /// Output weights ω, centre after centre, 0 beyond K: `[K' × outputs]`.
    pub output_weights: &'a [f32],
}

impl Parameters<'_> {
    /// All parameters as words, one array after the other: the block that `Network::try_new` takes.
    pub fn words(&self) -> impl Iterator<Item = u32> {
        let before = self.input_midpoint.iter().chain(self.input_per_unit).chain([&self.decay]);
        let after = self.bias.iter().chain(self.affine).chain(self.exponents);
        before.chain(after).chain(self.output_weights).map(|value| value.to_bits())
    }
}

/// The layout of a block in f32 with expanded distances.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Expanded;

/// A network in f32 with expanded distances; its block is what [`Parameters::words`] lists.
pub type Network<'a> = packed::Network<'a, Expanded>;

impl Layout for Expanded {
    const BATCH: usize = 128;
    const FEATURE: Feature = Feature::F32;
    type Proof = F32Built;

    type Parameters<'a> = Parameters<'a>;

    #[inline]
    fn block_words(shape: Shape, affine: bool) -> usize {
        let Shape { inputs, centres, outputs } = shape;
        let stored = centres.next_multiple_of(CENTRES_AT_ONCE);
        let affine = if affine { inputs.saturating_mul(outputs) } else { 0 };
        let centres = stored.saturating_mul(1 + inputs + outputs);
        [inputs, inputs, 1, outputs, affine, centres].into_iter().fold(0, usize::saturating_add)
    }

    fn check_values(network: &Network<'_>) -> Result<(), NetworkError> {
        let p = &network.parameters();
        if !(p.decay.is_finite() && p.decay > 0.0) {
            return Err(NetworkError::InvalidWidth { centre: 0 });
        }
        check_finite(&[
            ("input_midpoint", p.input_midpoint),
            ("input_per_unit", p.input_per_unit),
            ("exponents", p.exponents),
            ("output_weights", p.output_weights),
            ("bias", p.bias),
            ("affine", p.affine),
        ])?;
        check_spans(p.input_per_unit)?;
        for (centre, row) in
            p.exponents.chunks_exact(network.shape().inputs.saturating_add(1)).enumerate()
        {
            let Some((&b, a)) = row.split_first() else { continue };
            // −g‖x‖² + a·x + b is lowest in a corner of the clamp's box and highest at x = a/(2g).
            let (mut reach, mut square) = (0.0, 0.0);
            for &a in a {
                reach += p.decay * UNITS * UNITS + a.abs() * UNITS;
                square += a * (a / p.decay);
            }
            let (lowest, highest) = (b - reach, b + square / 4.0);
            if !(lowest >= LOWEST_EXPONENT && highest <= HIGHEST_EXPONENT) {
                return Err(NetworkError::ExponentOutOfRange { centre });
            }
        }
        let p = network.parameters();
        // Activations stay below 2^(1/8).
        let largest = 2.0
            * (magnitudes(p.output_weights) + magnitudes(p.affine) * UNITS + magnitudes(p.bias));
        if !largest.is_finite() {
            return Err(NetworkError::NotFinite { what: "the sum of weights" });
        }
        Ok(())
    }

    fn parameters<'a>(network: &Network<'a>) -> Parameters<'a> {
        let Shape { inputs, centres, outputs } = network.shape();
        let stored = centres.next_multiple_of(CENTRES_AT_ONCE);
        let mut cut = Cut(network.block());
        Parameters {
            input_midpoint: cut.floats(inputs),
            input_per_unit: cut.floats(inputs),
            decay: cut.floats(1).first().copied().unwrap_or(f32::NAN),
            bias: cut.floats(outputs),
            affine: cut.floats(if network.has_affine_tail() { inputs * outputs } else { 0 }),
            exponents: cut.floats(stored * (1 + inputs)),
            output_weights: cut.floats(stored * outputs),
        }
    }

    fn scale(network: &Network<'_>, reading: &[f32], scaled: &mut [f32]) -> bool {
        let p = network.parameters();
        scale_about(p.input_midpoint, p.input_per_unit, reading, scaled)
    }

    fn training_range(network: &Network<'_>, input: usize) -> [f32; 2] {
        let p = network.parameters();
        range_about(p.input_midpoint.get(input), p.input_per_unit.get(input))
    }

    fn width(parameters: &Parameters<'_>) -> f32 {
        let unit = HALF_RANGE / UNITS;
        libm::sqrtf(core::f32::consts::LOG2_E / (2.0 * parameters.decay)) * unit
    }

    #[inline(always)]
    fn infer_scaled_in_rust(network: &Network<'_>, scaled: &mut [f32], output: &mut [f32]) {
        scaled.iter_mut().for_each(|x| *x = clamp_units(*x));
        output.fill(0.0);
        // `max(1)`: a checked network has no empty dimension; this tells the compiler.
        let (inputs, outputs) = (scaled.len().max(1), output.len().max(1));
        let p = network.parameters();
        for (&x, row) in scaled.iter().zip(p.affine.chunks_exact(outputs)) {
            accumulate(output, x, row);
        }
        let shared = -(p.decay * sum_of_products([0.0; 4], scaled, scaled));
        let centres =
            p.exponents.chunks_exact(1 + inputs).zip(p.output_weights.chunks_exact(outputs));
        for (row, weights) in centres {
            let Some((&b, a)) = row.split_first() else { continue };
            let exponent = sum_of_products([b, shared, 0.0, 0.0], scaled, a);
            accumulate(output, exp2(exponent), weights);
        }
        for (y, &b) in output.iter_mut().zip(p.bias) {
            *y += b;
        }
    }

    #[cfg(cortex_m4f)]
    #[inline(always)]
    unsafe fn routine(network: &Network<'_>, inputs: Inputs<'_>, output: &mut [f32]) -> bool {
        // SAFETY: the caller has compared the lengths with the shape. When the network was made, its block was found
        // to be as long as its shape asks for, and no dimension to be 0.
        unsafe { cortex_m4::expanded(network.counted(), inputs, output) }
    }
}

impl Network<'_> {
    /// Infers as [`rbf::Network::infer_scaled_with`](super::Network::infer_scaled_with) does, to the bit, by the assembly's
    /// compiled twin in portable Rust. It is public to measure what the assembly saves.
    ///
    /// `scaled` and `output` must have the lengths of the shape; elements beyond are ignored.
    #[inline(never)]
    pub fn infer_scaled_portably(&self, scaled: &mut [f32], output: &mut [f32]) {
        self.infer_scaled_by_twin(scaled, output);
    }
}

/// Sum of `opened` and the products of `a` and `b`, in four partial sums that are added pairwise.
#[inline(always)]
fn sum_of_products(opened: [f32; 4], a: &[f32], b: &[f32]) -> f32 {
    let mut sum = opened;
    let ((a4, a_rest), (b4, b_rest)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    for (a, b) in a4.iter().zip(b4) {
        for ((s, a), b) in sum.iter_mut().zip(a).zip(b) {
            *s += a * b;
        }
    }
    for ((s, a), b) in sum.iter_mut().zip(a_rest).zip(b_rest) {
        *s += a * b;
    }
    (sum[0] + sum[1]) + (sum[2] + sum[3])
}
