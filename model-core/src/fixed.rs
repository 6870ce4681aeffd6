//! Models in arrays of fixed size, for programs that never change their model.

use crate::blob::ModelShape;
use crate::estimate::{Estimate, RowStatus};
use crate::frame_decoder::{Frame, FrameDecoder, Networks};
use crate::infer::Infer;
use crate::reading_model::ReadingModel;

/// Model in arrays of fixed size: `ROWS` rows of `INPUTS` readings and `OUTPUTS` outputs.
///
/// It needs no blob, no buffer and no error: its sizes are part of its type, and are checked when the program is compiled.
/// `taxel export model.bin --rust FILE.rs` writes any trained model as such a static. It gives what
/// [`Decoder`](crate::Decoder) gives of the blob, to the bit.
///
/// `N` is the type of its networks: [`float32::Network`](crate::rbf::float32::Network), [`fixed16::Network`](crate::rbf::fixed16::Network), or
/// [`rbf::Network`](crate::rbf::Network) if both are there. So a program has the code of its own number format alone.
/// `SCRATCH` is the number of floats of working space, which lies on the stack.
///
/// ```
/// use taxel_core::rbf::{arrays::F32, float32::Network};
/// use taxel_core::{Fixed, Networks, RowStatus};
///
/// // Two readings (Ω), one centre, one output (mm).
/// static NETWORK: F32<2, 1, 1> = F32 {
///     input_minimum: [50.0, 50.0],
///     input_per_span: [0.1, 0.1],
///     centres: [[0.5, 0.5]],
///     decay: [2.0],
///     output_weights: [[3.0]],
///     bias: [1.0],
///     affine: [[0.0], [0.0]],
/// };
/// static MODEL: Fixed<Network<'static>, 1, 2, 1, 2> = Fixed {
///     networks: Networks::OfRows(&[NETWORK.network()]),
///     relative_inputs: false,
///     reading_model: None,
/// }
/// .checked();
///
/// // At its centre the activation is 1, so the output is weight + bias.
/// assert_eq!(MODEL.decode(&[[55.0, 55.0]], None).outputs, [[4.0]]);
/// // A reading that could not be taken leaves nothing to tell.
/// let decoded = MODEL.decode(&[[55.0, f32::NAN]], None);
/// assert_eq!(decoded.status, [RowStatus::MissingReading]);
/// assert!(decoded.outputs[0][0].is_nan());
/// ```
#[derive(Debug, Clone)]
pub struct Fixed<
    N: 'static,
    const ROWS: usize,
    const INPUTS: usize,
    const OUTPUTS: usize,
    const SCRATCH: usize,
> {
    /// Networks of the rows, or of whole frames.
    pub networks: Networks<'static, 'static, N>,
    /// Whether inputs are [relative](crate::relative) to the baseline.
    pub relative_inputs: bool,
    /// Statistics that fill missing readings, and may estimate novelty and deviations.
    pub reading_model: Option<ReadingModel<'static>>,
}

/// Estimate of a frame, in arrays of fixed size.
#[derive(Debug, Clone, PartialEq)]
pub struct Decoded<const ROWS: usize, const OUTPUTS: usize> {
    /// Outputs of each row, in the units of the model's output columns. NaN where a row could not be decoded.
    pub outputs: [[f32; OUTPUTS]; ROWS],
    /// Status of each row.
    pub status: [RowStatus; ROWS],
    /// Whether an input of a decoded row was clamped ([`Decoder::decode_into`](crate::Decoder::decode_into)).
    pub clamped: bool,
}

impl<N: Infer, const ROWS: usize, const INPUTS: usize, const OUTPUTS: usize, const SCRATCH: usize>
    Fixed<N, ROWS, INPUTS, OUTPUTS, SCRATCH>
{
    /// Returns the model if its sizes fit each other.
    ///
    /// # Panics
    /// If a size does not fit. In a `static` or a `const` that is an error of the compiler:
    ///
    /// ```compile_fail
    /// use taxel_core::{Fixed, Networks, rbf::float32::Network};
    /// static MODEL: Fixed<Network<'static>, 1, 2, 1, 2> = Fixed {
    ///     networks: Networks::OfRows(&[]), // "a row has no network"
    ///     relative_inputs: false,
    ///     reading_model: None,
    /// }
    /// .checked();
    /// # let _ = &MODEL;
    /// ```
    #[must_use]
    pub const fn checked(self) -> Self {
        match self.networks {
            Networks::OfRows(networks) => assert!(networks.len() == ROWS, "a row has no network"),
            Networks::OfFrames(mut networks) => {
                let mut outputs = 0;
                while let [(front, _), rest @ ..] = networks {
                    outputs += front.outputs;
                    networks = rest;
                }
                assert!(outputs == ROWS * OUTPUTS, "networks give another number of outputs");
            }
        }
        let mut scratch = self.decoder().scratch_floats();
        if let Some(model) = &self.reading_model {
            let sizes = model.sizes();
            assert!(sizes.readings == ROWS * INPUTS, "a reading model of other readings");
            assert!(sizes.outputs == ROWS * OUTPUTS, "a reading model of other outputs");
            if sizes.scratch_floats() > scratch {
                scratch = sizes.scratch_floats();
            }
        }
        assert!(scratch <= SCRATCH, "too little working space");
        self
    }

    #[inline(always)]
    const fn decoder(&self) -> FrameDecoder<'static, 'static, N> {
        let shape = ModelShape { rows: ROWS, inputs: INPUTS, outputs: OUTPUTS };
        FrameDecoder { shape, relative: self.relative_inputs, networks: self.networks }
    }

    /// Decodes a frame of readings in Ω; NaN is missing. A model with relative inputs takes
    /// [reciprocals](crate::relative::reciprocal) of the baseline, too: without them all readings are missing.
    #[inline(always)]
    pub fn decode(
        &self,
        readings_ohm: &[[f32; INPUTS]; ROWS],
        reciprocals: Option<&[[f32; INPUTS]; ROWS]>,
    ) -> Decoded<ROWS, OUTPUTS> {
        let mut outputs = [[f32::NAN; OUTPUTS]; ROWS];
        let mut status = [RowStatus::MissingReading; ROWS];
        let frame = frame(readings_ohm, reciprocals);
        let mut estimate = Estimate { outputs: outputs.as_flattened_mut(), status: &mut status };
        // No length can be wrong.
        let clamped = self.decoder().decode(frame, &mut [0.0; SCRATCH], &mut estimate);
        Decoded { outputs, status, clamped: clamped.unwrap_or_default() }
    }

    /// Writes the standard deviation of each output, and returns the novelty of a frame in nats, as
    /// [`Decoder::assess_into`](crate::Decoder::assess_into) does; NaN if the model does not estimate it.
    #[inline(always)]
    pub fn assess(
        &self,
        readings_ohm: &[[f32; INPUTS]; ROWS],
        reciprocals: Option<&[[f32; INPUTS]; ROWS]>,
        deviation: &mut [[f32; OUTPUTS]; ROWS],
    ) -> f32 {
        let Some(model) = &self.reading_model else { return f32::NAN };
        let Frame { readings_ohm, reciprocals } = frame(readings_ohm, reciprocals);
        let reciprocals = self.relative_inputs.then_some(reciprocals);
        let (scratch, deviation) = (&mut [0.0; SCRATCH], deviation.as_flattened_mut());
        let novelty = model.assess(readings_ohm, reciprocals, scratch, deviation);
        novelty.ok().flatten().unwrap_or(f32::NAN)
    }

    /// Replaces missing readings by those expected from the others, as [`Decoder::fill`](crate::Decoder::fill) does, and
    /// returns their number.
    #[inline(always)]
    pub fn fill(
        &self,
        readings_ohm: &mut [[f32; INPUTS]; ROWS],
        reciprocals: Option<&[[f32; INPUTS]; ROWS]>,
    ) -> usize {
        let Some(model) = &self.reading_model else { return 0 };
        let given = reciprocals.map_or(&[][..], |it| it.as_flattened());
        let reciprocals = self.relative_inputs.then_some(given);
        model.fill(readings_ohm.as_flattened_mut(), reciprocals, &mut [0.0; SCRATCH])
    }
}

fn frame<'f, const ROWS: usize, const INPUTS: usize>(
    readings_ohm: &'f [[f32; INPUTS]; ROWS],
    reciprocals: Option<&'f [[f32; INPUTS]; ROWS]>,
) -> Frame<'f> {
    let reciprocals = reciprocals.map_or(&[][..], |it| it.as_flattened());
    Frame { readings_ohm: readings_ohm.as_flattened(), reciprocals }
}
