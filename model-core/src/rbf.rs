//! The K-centre Gaussian radial-basis-function network.
//!
//! F(x) = Σ_k ω_k·exp(−d_k·‖x − c_k‖²) + b (+ A·x), with d = 1/(2σ²) and x the readings scaled to
//! [0, 1] (the paper, eq. 8–10; the affine tail A·x is ours). All parameters are `f32` and
//! borrowed, and the shape is part of the value, so that one firmware serves any K.
//!
//! The order of the floating-point operations is part of the contract: ‖x − c‖² accumulates in
//! four interleaved partial sums, added pairwise, and the outputs take the affine tail, one centre
//! after the other, and last the bias, so that a large offset costs no digits of the rest. Host and device thus agree bit for bit, with or without SIMD.

use crate::exp::ExpKernel;
use crate::scale::scale;

/// The sizes of one network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Readings taken in.
    pub inputs: usize,
    /// Centres, K.
    pub centres: usize,
    /// Quantities given out.
    pub outputs: usize,
}

/// The parameters of one network, borrowed from where they lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters<'a> {
    /// Smallest reading of each input in training, in the reading's unit: `[inputs]`.
    pub input_minimum: &'a [f32],
    /// 1/(maximum − minimum) of each input; 0 for a channel that never changed: `[inputs]`.
    pub input_per_span: &'a [f32],
    /// Centres on scaled inputs, centre after centre: `[centres × inputs]`.
    pub centres: &'a [f32],
    /// 1/(2σ²) on scaled inputs: `[1]` for one common width, or `[centres]`.
    pub decay: &'a [f32],
    /// Output weights ω, centre after centre: `[centres × outputs]`.
    pub output_weights: &'a [f32],
    /// Bias in the outputs' units: `[outputs]`.
    pub bias: &'a [f32],
    /// Affine tail A on scaled inputs, input after input: `[inputs × outputs]`, or empty.
    pub affine: &'a [f32],
}

/// Why parameters do not make a network, or why a buffer does not fit one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NetworkError {
    /// A dimension is zero.
    #[error("a network needs at least one input, one centre and one output")]
    Empty,
    /// An array has the wrong number of elements.
    #[error("{what} has {found} elements; the network's shape asks for {expected}")]
    Length {
        /// The array.
        what: &'static str,
        /// Elements it must have.
        expected: usize,
        /// Elements it has.
        found: usize,
    },
    /// A parameter is NaN or infinite.
    #[error("{what} holds a number that is not finite")]
    NotFinite {
        /// The array.
        what: &'static str,
    },
    /// A width is zero, negative or without bound: its decay 1/(2σ²) is not a positive number.
    #[error("width of centre {centre} is not a positive finite number")]
    InvalidWidth {
        /// Which decay, from 0.
        centre: usize,
    },
    /// An input's 1/(maximum − minimum) is negative.
    #[error("input {input} has a negative span")]
    NegativeSpan {
        /// Which input, from 0.
        input: usize,
    },
}

/// A network whose parameters have been checked against its shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Network<'a> {
    shape: Shape,
    parameters: Parameters<'a>,
}

impl<'a> Network<'a> {
    /// Checks the lengths and values of `parameters`.
    ///
    /// # Errors
    /// Every variant of [`NetworkError`]; lengths are checked before values.
    pub fn try_new(shape: Shape, parameters: Parameters<'a>) -> Result<Self, NetworkError> {
        let network = Self::with_lengths_checked(shape, parameters)?;
        network.check_values()?;
        Ok(network)
    }

    /// As [`try_new`](Self::try_new), without the pass over all values: for parameters that
    /// passed it before.
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
        if p.decay.len() != 1 {
            check_length("decay", p.decay, centres)?;
        }
        check_length("output_weights", p.output_weights, centres * outputs)?;
        check_length("bias", p.bias, outputs)?;
        if !p.affine.is_empty() {
            check_length("affine", p.affine, inputs * outputs)?;
        }
        Ok(Self { shape, parameters })
    }

    fn check_values(&self) -> Result<(), NetworkError> {
        let p = &self.parameters;
        if let Some(centre) = p.decay.iter().position(|d| !(d.is_finite() && *d > 0.0)) {
            return Err(NetworkError::InvalidWidth { centre });
        }
        for (what, values) in [
            ("input_minimum", p.input_minimum),
            ("input_per_span", p.input_per_span),
            ("centres", p.centres),
            ("output_weights", p.output_weights),
            ("bias", p.bias),
            ("affine", p.affine),
        ] {
            if !values.iter().all(|v| v.is_finite()) {
                return Err(NetworkError::NotFinite { what });
            }
        }
        if let Some(input) = p.input_per_span.iter().position(|s| *s < 0.0) {
            return Err(NetworkError::NegativeSpan { input });
        }
        Ok(())
    }

    /// The network's sizes.
    #[must_use]
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// The network's parameters.
    #[must_use]
    pub fn parameters(&self) -> &Parameters<'a> {
        &self.parameters
    }

    /// Infers `output` from one row of `reading`s, with sizes known when it runs.
    ///
    /// `scaled` is working space of one value an input; it is left holding the scaled readings. A
    /// NaN reading makes every output NaN or meaningless: screen readings before
    /// ([`Decoder`](crate::Decoder) does).
    ///
    /// # Errors
    /// [`NetworkError::Length`] if a buffer does not fit the shape; `output` is then untouched.
    pub fn infer<E: ExpKernel>(
        &self,
        reading: &[f32],
        scaled: &mut [f32],
        output: &mut [f32],
    ) -> Result<(), NetworkError> {
        check_length("reading", reading, self.shape.inputs)?;
        check_length("scaled", scaled, self.shape.inputs)?;
        check_length("output", output, self.shape.outputs)?;
        evaluate::<E>(&self.parameters, reading, scaled, output);
        Ok(())
    }

    /// Infers the outputs of one row, with sizes known when it is compiled: the same operations
    /// in the same order as [`infer`](Self::infer), unrolled for the target.
    ///
    /// # Errors
    /// [`NetworkError::Length`] if the network has other sizes.
    ///
    /// ```
    /// use model_core::{exp::Polynomial, rbf::{Network, Parameters, Shape}};
    /// let network = Network::try_new(
    ///     Shape { inputs: 2, centres: 1, outputs: 1 },
    ///     Parameters {
    ///         input_minimum: &[50.0, 50.0],
    ///         input_per_span: &[0.1, 0.1],
    ///         centres: &[0.5, 0.5],
    ///         decay: &[2.0],
    ///         output_weights: &[3.0],
    ///         bias: &[1.0],
    ///         affine: &[],
    ///     },
    /// )?;
    /// // At its centre the activation is 1, so the output is weight + bias.
    /// assert_eq!(network.infer_array::<Polynomial, 2, 1>(&[55.0, 55.0])?, [4.0]);
    /// # Ok::<(), model_core::rbf::NetworkError>(())
    /// ```
    pub fn infer_array<E: ExpKernel, const INPUTS: usize, const OUTPUTS: usize>(
        &self,
        reading: &[f32; INPUTS],
    ) -> Result<[f32; OUTPUTS], NetworkError> {
        check_length("reading", reading, self.shape.inputs)?;
        let mut output = [0.0; OUTPUTS];
        check_length("output", &output, self.shape.outputs)?;
        let mut scaled = [0.0; INPUTS];
        evaluate::<E>(&self.parameters, reading, &mut scaled, &mut output);
        Ok(output)
    }

    /// The centres' share of [`infer_array`](Self::infer_array), from readings that are scaled
    /// already: Σ_k ω_k·exp(−d_k·‖x − c_k‖²) + b, without the affine tail. This is what other
    /// implementations of such networks compute, and so what their speed is compared by.
    ///
    /// # Errors
    /// [`NetworkError::Length`] if the network has other sizes.
    pub fn infer_scaled<E: ExpKernel, const INPUTS: usize, const OUTPUTS: usize>(
        &self,
        scaled: &[f32; INPUTS],
    ) -> Result<[f32; OUTPUTS], NetworkError> {
        check_length("scaled", scaled, self.shape.inputs)?;
        let mut output = [0.0; OUTPUTS];
        check_length("output", &output, self.shape.outputs)?;
        accumulate_centres::<E>(&self.parameters, scaled, &mut output);
        Ok(output)
    }
}

fn check_length(what: &'static str, values: &[f32], expected: usize) -> Result<(), NetworkError> {
    if values.len() == expected {
        Ok(())
    } else {
        Err(NetworkError::Length { what, expected, found: values.len() })
    }
}

/// The one implementation of inference. Inlined, so that constant sizes reach the loops.
#[inline(always)]
#[expect(clippy::inline_always, reason = "callers with array arguments rely on it for unrolling")]
fn evaluate<E: ExpKernel>(
    p: &Parameters<'_>,
    reading: &[f32],
    scaled: &mut [f32],
    output: &mut [f32],
) {
    let limits = p.input_minimum.iter().zip(p.input_per_span);
    for ((x, &r), (&minimum, &per_span)) in scaled.iter_mut().zip(reading).zip(limits) {
        *x = scale(r, minimum, per_span);
    }
    output.fill(0.0);
    for (&x, row) in scaled.iter().zip(p.affine.chunks_exact(output.len().max(1))) {
        accumulate(output, x, row);
    }
    accumulate_centres::<E>(p, scaled, output);
}

/// Adds one centre after the other, and last the bias.
#[inline(always)]
#[expect(clippy::inline_always, reason = "see `evaluate`")]
fn accumulate_centres<E: ExpKernel>(p: &Parameters<'_>, scaled: &[f32], output: &mut [f32]) {
    // `max(1)`: a checked network has no empty dimension; this tells the compiler.
    let inputs = scaled.len().max(1);
    let outputs = output.len().max(1);
    let common = p.decay.first().copied().unwrap_or(0.0);
    let centres = p.centres.chunks_exact(inputs).zip(p.output_weights.chunks_exact(outputs));
    for (k, (centre, weights)) in centres.enumerate() {
        let decay = p.decay.get(k).copied().unwrap_or(common);
        let activation = E::exp(-decay * squared_distance(scaled, centre));
        accumulate(output, activation, weights);
    }
    for (y, &b) in output.iter_mut().zip(p.bias) {
        *y += b;
    }
}

#[inline(always)]
#[expect(clippy::inline_always, reason = "see `evaluate`")]
fn accumulate(output: &mut [f32], factor: f32, weights: &[f32]) {
    for (y, &w) in output.iter_mut().zip(weights) {
        *y += factor * w;
    }
}

/// ‖a − b‖² by direct differences: the expanded form ‖a‖² − 2a·b + ‖b‖² cancels (400 % error at
/// offset 100).
#[inline(always)]
#[expect(clippy::inline_always, reason = "see `evaluate`")]
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

#[cfg(test)]
mod tests;
