//! The K-centre Gaussian radial-basis-function network, in two number formats.
//!
//! F(x) = Σ_k ω_k·exp(−‖x − c_k‖²/(2σ_k²)) + b (+ A·x), with x the scaled readings (the paper's Gaussian is eq. 11, its
//! network eq. 18, and K-means' output eq. 19; the affine tail A·x is ours). All parameters are borrowed, and the shape
//! is part of the value, so that one firmware serves any K.
//!
//! | [`Format`] | distances | a Cortex-M4F computes with |
//! |---|---|---|
//! | [`F32`](Format::F32) | Σ (x − c)²: safe at any width, which each centre has | compiled code |
//! | [`Fixed16`](Format::Fixed16) | ‖x‖² − 2x·c + ‖c‖², in integers; one width | `cortex_m4/fixed16.s`, two products an instruction |
//!
//! The order of the floating-point operations is part of each format's contract. The affine tail comes first,
//! then one centre after the other, and last the bias, so that a large offset costs no digits of the rest.
//! Host and device thus agree bit for bit, with or without SIMD.

// From the ground up: a module imports only what is declared before it.
mod parameters;
mod format;
pub mod float32;
pub mod fixed16;
pub mod arrays;

pub use format::Format;
pub(crate) use parameters::Cut;
pub use parameters::{NetworkError, Shape};

use self::parameters::check_length;

/// A network of any format, whose parameters have been checked against its shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Network<'a> {
    /// A network in f32 ([`Format::F32`]).
    F32(float32::Network<'a>),
    /// A network in 16-bit fixed point ([`Format::Fixed16`]).
    Fixed16(fixed16::Network<'a>),
}

/// Applies `$body` to the network inside, whatever its format.
macro_rules! each {
    ($network:expr, $inner:ident => $body:expr) => {
        match $network {
            Network::F32($inner) => $body,
            Network::Fixed16($inner) => $body,
        }
    };
}

impl<'a> Network<'a> {
    /// The network's format.
    pub fn format(&self) -> Format {
        match self {
            Self::F32(_) => Format::F32,
            Self::Fixed16(_) => Format::Fixed16,
        }
    }

    /// The network's numbers of inputs, centres and outputs.
    pub fn shape(&self) -> Shape {
        each!(self, inner => inner.shape())
    }

    /// Whether the network has an affine tail.
    pub fn has_affine_tail(&self) -> bool {
        match self {
            Self::F32(inner) => !inner.parameters().affine.is_empty(),
            Self::Fixed16(inner) => inner.has_affine_tail(),
        }
    }

    /// Widths σ of the centres on inputs scaled to [0, 1]: one for all, or one for each.
    pub fn widths(&self) -> impl Iterator<Item = f32> {
        let (common, each): (Option<f32>, &'a [f32]) = match self {
            Self::F32(inner) => (None, inner.parameters().decay),
            Self::Fixed16(inner) => (Some(inner.width()), &[]),
        };
        common.into_iter().chain(each.iter().map(|decay| libm::sqrtf(0.5 / decay)))
    }

    /// Checks every value of a network whose lengths alone were checked before.
    pub(crate) fn check_values(&self) -> Result<(), NetworkError> {
        each!(self, inner => inner.check_values())
    }

    /// All words of the network, in slices that follow each other.
    pub(crate) fn block(&self) -> [&'a [u32]; 7] {
        match self {
            Self::F32(inner) => inner.block(),
            Self::Fixed16(inner) => [inner.block(), &[], &[], &[], &[], &[], &[]],
        }
    }

    /// Lowest and highest reading of `input` in training, in its unit, as precisely as f32 can hold.
    ///
    /// Both are the same if the reading never changed, and NaN if there is no such input.
    pub fn training_range(&self, input: usize) -> [f32; 2] {
        each!(self, inner => inner.training_range(input))
    }

    /// Infers `output` (one value an output, in its unit) from one row of `reading`s (one an input, in its unit).
    ///
    /// `scaled` is working space of one value an input. A NaN reading makes the outputs meaningless: check
    /// readings first ([`Decoder`](crate::Decoder) does). Inlined, so that lengths known to the compiler reach the
    /// loops.
    ///
    /// # Errors
    /// [`NetworkError::Length`] if a buffer does not fit the shape; `output` is then untouched.
    ///
    /// ```
    /// use taxel_core::rbf::{Network, Shape, float32};
    /// let network = Network::from(float32::Network::try_new(
    ///     Shape { inputs: 2, centres: 1, outputs: 1 },
    ///     float32::Parameters {
    ///         input_minimum: &[50.0, 50.0],
    ///         input_per_span: &[0.1, 0.1],
    ///         centres: &[0.5, 0.5],
    ///         decay: &[2.0],
    ///         output_weights: &[3.0],
    ///         bias: &[1.0],
    ///         affine: &[],
    ///     },
    /// )?);
    /// let mut output = [0.0];
    /// network.infer(&[55.0, 55.0], &mut [0.0; 2], &mut output)?;
    /// // At its centre the activation is 1, so the output is weight + bias.
    /// assert_eq!(output, [4.0]);
    /// # Ok::<(), taxel_core::rbf::NetworkError>(())
    /// ```
    #[inline(always)]
    pub fn infer(
        &self,
        reading: &[f32],
        scaled: &mut [f32],
        output: &mut [f32],
    ) -> Result<(), NetworkError> {
        check_length("reading", reading, self.shape().inputs)?;
        self.check_buffers(scaled, output)?;
        match self {
            Self::F32(inner) => {
                let _ = inner.scale(reading, scaled);
                inner.infer_scaled_shared(scaled, output);
            }
            Self::Fixed16(inner) => _ = inner.infer(reading, scaled, output),
        }
        Ok(())
    }

    /// Whether inference clamps one of the `reading`s, because it lies far beyond the training range
    /// ([`Decoder::decode_into`](crate::Decoder::decode_into)), or is missing.
    ///
    /// `scaled` receives the readings in the format's own unit of inputs, as the first half of [`infer`](Self::infer)
    /// makes them: [`Format::F32`] clamps them here, [`Format::Fixed16`] when it infers.
    ///
    /// # Errors
    /// [`NetworkError::Length`] if a buffer does not fit the shape; `scaled` is then untouched.
    pub fn clamps(&self, reading: &[f32], scaled: &mut [f32]) -> Result<bool, NetworkError> {
        check_length("reading", reading, self.shape().inputs)?;
        check_length("scaled", scaled, self.shape().inputs)?;
        Ok(each!(self, inner => inner.scale(reading, scaled)))
    }

    /// Infers `output` from inputs that [`clamps`](Self::clamps) scaled: the second half of [`infer`](Self::infer).
    /// `scaled` is overwritten.
    ///
    /// # Errors
    /// [`NetworkError::Length`] if a buffer does not fit the shape; `output` is then untouched.
    #[inline(always)]
    pub fn infer_scaled(&self, scaled: &mut [f32], output: &mut [f32]) -> Result<(), NetworkError> {
        self.check_buffers(scaled, output)?;
        match self {
            Self::F32(inner) => inner.infer_scaled_shared(scaled, output),
            Self::Fixed16(inner) => inner.infer_scaled(scaled, output),
        }
        Ok(())
    }

    #[inline(always)]
    fn check_buffers(&self, scaled: &[f32], output: &[f32]) -> Result<(), NetworkError> {
        let shape = self.shape();
        check_length("scaled", scaled, shape.inputs)?;
        check_length("output", output, shape.outputs)
    }
}

impl<'a> From<float32::Network<'a>> for Network<'a> {
    fn from(inner: float32::Network<'a>) -> Self {
        Self::F32(inner)
    }
}

impl<'a> From<fixed16::Network<'a>> for Network<'a> {
    fn from(inner: fixed16::Network<'a>) -> Self {
        Self::Fixed16(inner)
    }
}

#[cfg(test)]
mod tests;
