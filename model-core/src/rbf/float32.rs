//! The network in f32: exact, for any width.
//!
//! F(x) = Σ_k ω_k·exp(−d_k·‖x − c_k‖²) + b (+ A·x), with d = 1/(2σ²) and x the readings scaled to
//! [0, 1]. ‖x − c‖² accumulates in four interleaved partial sums, added pairwise.

use super::parameters::{Cut, NetworkError, Shape, check_finite, check_length, check_spans};
use crate::cortex_m4::{INPUTS, OUTPUTS};
use crate::exp::exp;
use crate::scale::scale_and_tell;

/// The parameters of one network, borrowed from where they lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters<'a> {
    /// Smallest reading of each input in training, in the reading's unit: `[inputs]`.
    pub input_minimum: &'a [f32],
    /// 1/(maximum − minimum) of each input; 0 for a channel that never changed: `[inputs]`.
    pub input_per_span: &'a [f32],
    /// Centres on scaled inputs, centre after centre: `[centres × inputs]`.
    pub centres: &'a [f32],
    /// 1/(2σ²) of each centre, on scaled inputs: `[centres]`.
    pub decay: &'a [f32],
    /// Output weights ω, centre after centre: `[centres × outputs]`.
    pub output_weights: &'a [f32],
    /// Bias in the outputs' units: `[outputs]`.
    pub bias: &'a [f32],
    /// Affine tail A on scaled inputs, input after input: `[inputs × outputs]`, or empty.
    pub affine: &'a [f32],
}

impl Parameters<'_> {
    /// All parameters as words, one array after the other, as in the blob.
    pub fn words(&self) -> impl Iterator<Item = u32> {
        let before = self.input_minimum.iter().chain(self.input_per_span).chain(self.centres);
        let after = self.decay.iter().chain(self.output_weights).chain(self.bias);
        before.chain(after).chain(self.affine).map(|value| value.to_bits())
    }
}

/// A network in f32, whose parameters have been checked against its shape.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)] // the shape first, so that it is at the same place in a network of any format
pub struct Network<'a> {
    shape: Shape,
    parameters: Parameters<'a>,
}

impl<'a> Network<'a> {
    /// Makes a network after checking the lengths and values of `parameters`.
    ///
    /// # Errors
    /// Every variant of [`NetworkError`]; lengths are checked before values.
    pub fn try_new(shape: Shape, parameters: Parameters<'a>) -> Result<Self, NetworkError> {
        let network = Self::with_lengths_checked(shape, parameters)?;
        network.check_values()?;
        Ok(network)
    }

    /// Makes a network from the words of [`Parameters::words`], after checking lengths and values.
    ///
    /// # Errors
    /// Every variant of [`NetworkError`]. If there are too few words, the last arrays have the wrong length.
    pub fn of_words(shape: Shape, affine: bool, words: &'a [u32]) -> Result<Self, NetworkError> {
        check_length("block", words, Self::block_words(shape, affine))?;
        let network = Self::from_block(shape, affine, Cut(words))?;
        network.check_values()?;
        Ok(network)
    }

    /// Makes a network after checking the lengths alone, for parameters whose values were checked before.
    #[inline(always)]
    pub(crate) fn with_lengths_checked(
        shape: Shape,
        parameters: Parameters<'a>,
    ) -> Result<Self, NetworkError> {
        let Shape { inputs, centres, outputs } = shape;
        if inputs == 0 || centres == 0 || outputs == 0 {
            return Err(NetworkError::Empty);
        }
        let p = &parameters;
        check_length("input_minimum", p.input_minimum, inputs)?;
        check_length("input_per_span", p.input_per_span, inputs)?;
        check_length("centres", p.centres, centres * inputs)?;
        check_length("decay", p.decay, centres)?;
        check_length("output_weights", p.output_weights, centres * outputs)?;
        check_length("bias", p.bias, outputs)?;
        if !p.affine.is_empty() {
            check_length("affine", p.affine, inputs * outputs)?;
        }
        Ok(Self::of_arrays(shape, parameters))
    }

    /// Makes a network of parameters whose lengths fit the shape; no value is checked.
    pub(crate) const fn of_arrays(shape: Shape, parameters: Parameters<'a>) -> Self {
        Self { shape, parameters }
    }

    pub(crate) fn check_values(&self) -> Result<(), NetworkError> {
        let p = &self.parameters;
        if let Some(centre) = p.decay.iter().position(|d| !(d.is_finite() && *d > 0.0)) {
            return Err(NetworkError::InvalidWidth { centre });
        }
        check_finite(&[
            ("input_minimum", p.input_minimum),
            ("input_per_span", p.input_per_span),
            ("centres", p.centres),
            ("output_weights", p.output_weights),
            ("bias", p.bias),
            ("affine", p.affine),
        ])?;
        check_spans(p.input_per_span)
    }

    /// The network's numbers of inputs, centres and outputs.
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// The network's parameters.
    pub fn parameters(&self) -> &Parameters<'a> {
        &self.parameters
    }

    /// Number of words in the block of a network of this shape, with an affine tail or without.
    pub fn block_words(shape: Shape, affine: bool) -> usize {
        let Shape { inputs, centres, outputs } = shape;
        let affine = if affine { inputs.saturating_mul(outputs) } else { 0 };
        [
            inputs,
            inputs,
            centres.saturating_mul(inputs),
            centres,
            centres.saturating_mul(outputs),
            outputs,
            affine,
        ]
        .into_iter()
        .fold(0, usize::saturating_add)
    }

    /// Makes a network of the arrays that follow each other in `block`; its values are not checked.
    #[inline(always)]
    pub(crate) fn from_block(
        shape: Shape,
        affine: bool,
        mut block: Cut<'a>,
    ) -> Result<Self, NetworkError> {
        let Shape { inputs, centres, outputs } = shape;
        let parameters = Parameters {
            input_minimum: block.floats(inputs),
            input_per_span: block.floats(inputs),
            centres: block.floats(centres * inputs),
            decay: block.floats(centres),
            output_weights: block.floats(centres * outputs),
            bias: block.floats(outputs),
            affine: block.floats(if affine { inputs * outputs } else { 0 }),
        };
        Self::with_lengths_checked(shape, parameters)
    }

    /// The network's arrays as words, in the order of the blob.
    pub(crate) fn block(&self) -> [&'a [u32]; 7] {
        let p = &self.parameters;
        [p.input_minimum, p.input_per_span, p.centres, p.decay, p.output_weights, p.bias, p.affine]
            .map(bytemuck::cast_slice)
    }

    pub(super) fn training_range(&self, input: usize) -> [f32; 2] {
        let p = &self.parameters;
        let (Some(&lowest), Some(&per_span)) =
            (p.input_minimum.get(input), p.input_per_span.get(input))
        else {
            return [f32::NAN; 2];
        };
        [lowest, if per_span > 0.0 { lowest + 1.0 / per_span } else { lowest }]
    }

    /// Scales readings to [0, 1], and clamps them. Returns whether one was clamped, NaN or infinite.
    #[inline(always)]
    pub(crate) fn scale(&self, reading: &[f32], scaled: &mut [f32]) -> bool {
        let p = &self.parameters;
        let limits = p.input_minimum.iter().zip(p.input_per_span);
        let mut any_clamped = false;
        for ((x, &r), (&minimum, &per_span)) in scaled.iter_mut().zip(reading).zip(limits) {
            let (scaled, clamped) = scale_and_tell(r, minimum, per_span);
            *x = scaled;
            any_clamped |= clamped;
        }
        any_clamped
    }

    /// Infers `output` from `scaled` inputs as [`infer_scaled`](Self::infer_scaled) does.
    ///
    /// On a device all callers share it: compiled with this crate, for speed, and not inlined, so that `fixed16` need not
    /// save the registers it uses.
    #[cfg_attr(cortex_m4f, inline(never))]
    #[cfg_attr(not(cortex_m4f), inline(always))]
    pub(crate) fn infer_scaled_shared(&self, scaled: &[f32], output: &mut [f32]) {
        self.infer_scaled(scaled, output);
    }

    /// Infers `output` from `scaled` inputs.
    ///
    /// `scaled` and `output` must have the lengths of the shape; elements beyond are ignored.
    #[inline(always)]
    pub fn infer_scaled(&self, scaled: &[f32], output: &mut [f32]) {
        let usual: (Result<&[f32; INPUTS], _>, Result<&mut [f32; OUTPUTS], _>) =
            (scaled.try_into(), (&mut *output).try_into());
        if let (Ok(scaled), Ok(output)) = usual {
            self.add_up(scaled, output);
        } else {
            self.add_up(scaled, output);
        }
    }

    #[inline(always)]
    fn add_up(&self, scaled: &[f32], output: &mut [f32]) {
        let p = &self.parameters;
        output.fill(0.0);
        // `max(1)`: a checked network has no empty dimension; this tells the compiler.
        let inputs = scaled.len().max(1);
        let outputs = output.len().max(1);
        for (&x, row) in scaled.iter().zip(p.affine.chunks_exact(outputs)) {
            accumulate(output, x, row);
        }
        let centres = p.centres.chunks_exact(inputs).zip(p.output_weights.chunks_exact(outputs));
        for ((centre, weights), decay) in centres.zip(p.decay) {
            let activation = exp(-decay * squared_distance(scaled, centre));
            accumulate(output, activation, weights);
        }
        for (y, &b) in output.iter_mut().zip(p.bias) {
            *y += b;
        }
    }
}

#[inline(always)]
fn accumulate(output: &mut [f32], factor: f32, weights: &[f32]) {
    for (y, &w) in output.iter_mut().zip(weights) {
        *y += factor * w;
    }
}

/// ‖a − b‖² by direct differences; the expanded form ‖a‖² − 2a·b + ‖b‖² cancels (400 % error at offset 100).
#[inline(always)]
fn squared_distance(a: &[f32], b: &[f32]) -> f32 {
    let (a4, a_rest) = a.as_chunks::<4>();
    let (b4, b_rest) = b.as_chunks::<4>();
    let mut sum = [0.0_f32; 4];
    for (a, b) in a4.iter().zip(b4) {
        for ((s, a), b) in sum.iter_mut().zip(a).zip(b) {
            let d = a - b;
            *s += d * d;
        }
    }
    for ((s, a), b) in sum.iter_mut().zip(a_rest).zip(b_rest) {
        let d = a - b;
        *s += d * d;
    }
    (sum[0] + sum[1]) + (sum[2] + sum[3])
}
