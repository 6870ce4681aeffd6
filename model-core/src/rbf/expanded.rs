//! The network in f32 with expanded distances.
//!
//! With g = log₂e/(2σ²), exp(−‖x − c‖²/(2σ²)) = 2^(b + a·x − g‖x‖²), where a = 2g·c and b = −g‖c‖²: two
//! operations an input and centre instead of three, and no constant of the base e. Products cancel, so a
//! model takes this form only where the trainer has proved the rounding harmless; inputs counted from the
//! middle of the training range, and clamped, make the bound small (400 % error was seen at an offset of
//! 100 spans).
//!
//! Inputs are in [`UNITS`]. b + a·x − g‖x‖² adds up in four interleaved partial sums, the first opened by b,
//! the second by −g‖x‖². Centres are stored in fours; the last may be fill.
#![cfg_attr(
    cortex_m4f,
    expect(unsafe_code, reason = "calls to assembly, whose conditions are checked before")
)]

use super::assembled::Assembled;
use super::parameters::{
    Cut, NetworkError, Shape, accumulate, check_finite, check_length, check_spans, range_about,
    scale_about,
};
#[cfg(cortex_m4f)]
use crate::cortex_m4::{self, Finite, Inputs, OUTPUTS};
use crate::exp::exp2;
use crate::scale::{HALF_RANGE, UNITS, clamp_units};

/// Centres are stored in multiples of this.
pub const CENTRES_AT_ONCE: usize = 4;

/// The smallest exponent that can be computed with: 2^−126 is the smallest normal number.
pub const LOWEST_EXPONENT: f32 = -125.0;

/// The largest: rounding may lift an exponent a little above 0, and no sound parameters lift it further.
pub const HIGHEST_EXPONENT: f32 = 0.125;

/// The parameters of one network. With K' for K rounded up to a multiple of [`CENTRES_AT_ONCE`]:
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters<'a> {
    /// Middle of each input's training range, in the reading's unit: `[inputs]`.
    pub input_midpoint: &'a [f32],
    /// [`UNITS`] in one unit of the reading; 0 for a channel that never changed: `[inputs]`.
    pub input_per_unit: &'a [f32],
    /// g, on inputs in [`UNITS`].
    pub decay: f32,
    /// Bias in the outputs' units: `[outputs]`.
    pub bias: &'a [f32],
    /// Affine tail A on inputs in [`UNITS`], input after input: `[inputs × outputs]`, or empty.
    pub affine: &'a [f32],
    /// b and then a, centre after centre: `[K' × (1 + inputs)]`.
    pub exponents: &'a [f32],
    /// Output weights ω, centre after centre; 0 where there is none: `[K' × outputs]`.
    pub output_weights: &'a [f32],
}

impl Parameters<'_> {
    /// The parameters one after the other: the block that [`Network::try_new`] takes.
    pub fn words(&self) -> impl Iterator<Item = u32> {
        let before = self.input_midpoint.iter().chain(self.input_per_unit).chain([&self.decay]);
        let after = self.bias.iter().chain(self.affine).chain(self.exponents);
        before.chain(after).chain(self.output_weights).map(|value| value.to_bits())
    }
}

/// A network: a block of words, borrowed from where it lies, that has been checked against its shape.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)] // the shape first, so that it is at the same place in a network of any format
pub struct Network<'a> {
    shape: Shape,
    affine: bool,
    block: &'a [u32],
}

impl<'a> Network<'a> {
    /// Checks the length and the values of a `block` ([`Parameters::words`]), and that no reading can drive
    /// an exponent out of [`LOWEST_EXPONENT`] to [`HIGHEST_EXPONENT`] or an output out of f32.
    ///
    /// # Errors
    /// Every variant of [`NetworkError`] but `TooManyInputs`; the length is checked before values.
    pub fn try_new(shape: Shape, affine: bool, block: &'a [u32]) -> Result<Self, NetworkError> {
        let network = Self::with_length_checked(shape, affine, block)?;
        network.check_values()?;
        Ok(network)
    }

    /// As [`try_new`](Self::try_new), without the pass over all values: for a block that passed it before.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "a network is large to hand over")]
    pub(crate) fn with_length_checked(
        shape: Shape,
        affine: bool,
        block: &'a [u32],
    ) -> Result<Self, NetworkError> {
        if shape.inputs == 0 || shape.centres == 0 || shape.outputs == 0 {
            return Err(NetworkError::Empty);
        }
        check_length("block", block, Self::block_words(shape, affine))?;
        Ok(Self { shape, affine, block })
    }

    /// Words of the block of a network of this shape.
    #[must_use]
    #[inline]
    pub fn block_words(shape: Shape, affine: bool) -> usize {
        let Shape { inputs, centres, outputs } = shape;
        let stored = centres.next_multiple_of(CENTRES_AT_ONCE);
        let affine = if affine { inputs.saturating_mul(outputs) } else { 0 };
        let centres = stored.saturating_mul(1 + inputs + outputs);
        [inputs, inputs, 1, outputs, affine, centres].into_iter().fold(0, usize::saturating_add)
    }

    /// The network's sizes.
    #[must_use]
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// Whether there is an affine tail.
    #[must_use]
    pub fn has_affine_tail(&self) -> bool {
        self.affine
    }

    /// All of the network's words.
    #[must_use]
    pub fn block(&self) -> &'a [u32] {
        self.block
    }

    /// The network's parameters.
    #[must_use]
    pub fn parameters(&self) -> Parameters<'a> {
        let Shape { inputs, centres, outputs } = self.shape;
        let stored = centres.next_multiple_of(CENTRES_AT_ONCE);
        let mut cut = Cut(self.block);
        Parameters {
            input_midpoint: cut.floats(inputs),
            input_per_unit: cut.floats(inputs),
            decay: cut.floats(1).first().copied().unwrap_or(f32::NAN),
            bias: cut.floats(outputs),
            affine: cut.floats(if self.affine { inputs * outputs } else { 0 }),
            exponents: cut.floats(stored * (1 + inputs)),
            output_weights: cut.floats(stored * outputs),
        }
    }

    /// Width σ of all centres on inputs scaled to [0, 1].
    #[must_use]
    pub fn width(&self) -> f32 {
        let unit = HALF_RANGE / UNITS;
        libm::sqrtf(core::f32::consts::LOG2_E / (2.0 * self.parameters().decay)) * unit
    }

    pub(crate) fn check_values(&self) -> Result<(), NetworkError> {
        let p = &self.parameters();
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
            p.exponents.chunks_exact(self.shape.inputs.saturating_add(1)).enumerate()
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
        // Activations stay below 2^(1/8): if this is finite, no output overflows.
        let sum = |values: &[f32]| values.iter().map(|v| v.abs()).sum::<f32>();
        if !(2.0 * (sum(p.output_weights) + sum(p.affine) * UNITS + sum(p.bias))).is_finite() {
            return Err(NetworkError::NotFinite { what: "the sum of weights" });
        }
        Ok(())
    }

    pub(super) fn training_range(&self, input: usize) -> [f32; 2] {
        let p = self.parameters();
        range_about(p.input_midpoint.get(input), p.input_per_unit.get(input))
    }

    /// As [`rbf::Network::infer_scaled`](super::Network::infer_scaled), by the compiled twin of the
    /// assembly: the same bits; public to measure what the assembly saves. `scaled` and `output` must have
    /// the sizes of the shape: what is beyond is left alone.
    #[inline(never)]
    pub fn infer_scaled_portably(&self, scaled: &mut [f32], output: &mut [f32]) {
        self.infer_scaled_by_twin(scaled, output);
    }
}

impl Assembled for Network<'_> {
    fn shape(&self) -> Shape {
        self.shape
    }

    fn scale(&self, reading: &[f32], scaled: &mut [f32]) {
        let p = self.parameters();
        scale_about(p.input_midpoint, p.input_per_unit, reading, scaled);
    }

    #[cfg(cortex_m4f)]
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "a call")]
    unsafe fn routine(&self, inputs: Inputs<'_>, output: &mut [f32; OUTPUTS]) -> Finite {
        let Self { shape, affine, block } = *self;
        // SAFETY: the caller has compared the shape with the routine's. When the network was made, its block was
        // found to be as long as its shape asks for, and no dimension to be 0. A test compares the lengths.
        unsafe { cortex_m4::expanded(inputs, block, shape.centres, affine, output) }
    }

    #[cfg(cortex_m4f)]
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "a call")]
    unsafe fn array_routine(&self, inputs: Inputs<'_>, groups: &mut [[f32; OUTPUTS]]) -> Finite {
        let Self { shape, affine, block } = *self;
        // SAFETY: as in `routine`.
        unsafe { cortex_m4::expanded_array(inputs, block, shape.centres, affine, groups) }
    }

    #[inline(always)]
    #[expect(clippy::inline_always, reason = "callers rely on it for constant lengths")]
    fn infer_scaled_in_rust(&self, scaled: &mut [f32], output: &mut [f32]) {
        scaled.iter_mut().for_each(|x| *x = clamp_units(*x));
        output.fill(0.0);
        // `max(1)`: a checked network has no empty dimension; this tells the compiler.
        let (inputs, outputs) = (scaled.len().max(1), output.len().max(1));
        let p = self.parameters();
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
}

/// `opened` and the products in turn, in four partial sums that are added pairwise.
#[inline(always)]
#[expect(clippy::inline_always, reason = "callers rely on it for unrolling")]
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
