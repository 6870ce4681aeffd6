//! A network in arrays of fixed size, for a program that never changes its model.

use crate::rbf::{Shape, float32};

/// Network of `INPUTS` readings, `CENTRES` Gaussians and `OUTPUTS` outputs, whose parameters are arrays of its own.
///
/// It needs no blob, no buffer and no error: its sizes are part of its type, and [`checked`](Self::checked) looks at its
/// numbers when the program is compiled. `host-sim export model.bin --rust FILE.rs` writes a trained model as statics of
/// this type, one for each row-wire.
///
/// It infers what [`Decoder`](crate::Decoder) decodes from the blob, to the bit, for the number format
/// [`f32`](crate::rbf::Format::F32). The assembly routine of the other format reads an array of words.
///
/// Each reading is scaled to [0, 1] on its training range, and clamped an eighth beyond it. With x the scaled readings, the
/// outputs are A·x + Σ_k ω_k·exp(−d_k·‖x − c_k‖²) + b.
///
/// ```
/// use taxel_core::Fixed;
///
/// // Two readings (Ω), one centre, one output (mm).
/// static NETWORK: Fixed<2, 1, 1> = Fixed {
///     input_minimum: [50.0, 50.0],
///     input_per_span: [0.1, 0.1],
///     centres: [[0.5, 0.5]],
///     decay: [2.0],
///     output_weights: [[3.0]],
///     bias: [1.0],
///     affine: [[0.0], [0.0]],
/// }
/// .checked();
///
/// // At its centre the activation is 1, so the output is weight + bias.
/// assert_eq!(NETWORK.infer(&[55.0, 55.0]), [4.0]);
/// // A reading that could not be taken leaves nothing to tell.
/// assert!(NETWORK.infer(&[55.0, f32::NAN])[0].is_nan());
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Fixed<const INPUTS: usize, const CENTRES: usize, const OUTPUTS: usize> {
    /// Smallest reading of each input in training, in the reading's unit.
    pub input_minimum: [f32; INPUTS],
    /// 1/(maximum − minimum) of each input; 0 for a channel that never changed.
    pub input_per_span: [f32; INPUTS],
    /// Centres c on scaled inputs.
    pub centres: [[f32; INPUTS]; CENTRES],
    /// Decay d = 1/(2σ²) of each centre, on scaled inputs.
    pub decay: [f32; CENTRES],
    /// Output weights ω of each centre, in the outputs' units.
    pub output_weights: [[f32; OUTPUTS]; CENTRES],
    /// Bias b in the outputs' units.
    pub bias: [f32; OUTPUTS],
    /// Affine tail A on scaled inputs, one array an input; zeros for a network without one.
    pub affine: [[f32; OUTPUTS]; INPUTS],
}

impl<const INPUTS: usize, const CENTRES: usize, const OUTPUTS: usize>
    Fixed<INPUTS, CENTRES, OUTPUTS>
{
    /// Returns the network if its numbers are sound: all finite, decays positive, spans not negative. A network that was
    /// not checked never panics either, but its outputs may mean nothing.
    ///
    /// # Panics
    /// If a number is not sound. In a `static` or a `const` that is an error of the compiler:
    ///
    /// ```compile_fail
    /// # use taxel_core::Fixed;
    /// static NETWORK: Fixed<1, 1, 1> = Fixed {
    ///     decay: [-2.0], // "a decay is not a positive number"
    ///     input_minimum: [50.0],
    ///     input_per_span: [0.1],
    ///     centres: [[0.5]],
    ///     output_weights: [[3.0]],
    ///     bias: [1.0],
    ///     affine: [[0.0]],
    /// }
    /// .checked();
    /// # let _ = &NETWORK;
    /// ```
    #[must_use]
    pub const fn checked(self) -> Self {
        assert!(all(&self.decay, Rule::Positive), "a decay is not a positive number");
        assert!(all(&self.input_per_span, Rule::NotNegative), "a span is negative or not finite");
        assert!(all(&self.input_minimum, Rule::Finite), "a minimum is not finite");
        assert!(all(self.centres.as_flattened(), Rule::Finite), "a centre is not finite");
        assert!(all(self.output_weights.as_flattened(), Rule::Finite), "a weight is not finite");
        assert!(all(&self.bias, Rule::Finite), "a bias is not finite");
        assert!(all(self.affine.as_flattened(), Rule::Finite), "the affine tail is not finite");
        self
    }

    /// Infers the outputs, in their units, from one `reading` an input, in its unit. All outputs are NaN if a reading is
    /// not finite, or if an output would not be.
    pub fn infer(&self, readings: &[f32; INPUTS]) -> [f32; OUTPUTS] {
        const { assert!(INPUTS > 0 && CENTRES > 0 && OUTPUTS > 0, "a dimension is zero") };
        let shape = Shape { inputs: INPUTS, centres: CENTRES, outputs: OUTPUTS };
        let network = float32::Network::of_arrays(shape, self.parameters());
        let (mut scaled, mut outputs) = ([0.0; INPUTS], [f32::NAN; OUTPUTS]);
        if network.scale(readings, &mut scaled) && !all(readings, Rule::Finite) {
            return outputs;
        }
        network.infer_scaled_shared(&scaled, &mut outputs);
        if all(&outputs, Rule::Finite) { outputs } else { [f32::NAN; OUTPUTS] }
    }

    /// The parameters as slices, as [`float32::Network::try_new`] takes them.
    pub const fn parameters(&self) -> float32::Parameters<'_> {
        float32::Parameters {
            input_minimum: &self.input_minimum,
            input_per_span: &self.input_per_span,
            centres: self.centres.as_flattened(),
            decay: &self.decay,
            output_weights: self.output_weights.as_flattened(),
            bias: &self.bias,
            affine: self.affine.as_flattened(),
        }
    }
}

/// What a number must be.
#[derive(Clone, Copy)]
enum Rule {
    Finite,
    NotNegative,
    Positive,
}

/// Whether all `values` are finite and keep to the `rule`.
const fn all(mut values: &[f32], rule: Rule) -> bool {
    while let [value, rest @ ..] = values {
        let kept = match rule {
            Rule::Finite => true,
            Rule::NotNegative => *value >= 0.0,
            Rule::Positive => *value > 0.0,
        };
        if !(kept && value.is_finite()) {
            return false;
        }
        values = rest;
    }
    true
}
