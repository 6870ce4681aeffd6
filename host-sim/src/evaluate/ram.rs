//! RAM for decoding on a 32-bit device.

use model_core::blob::Model;
use model_core::rbf::Format;
use serde::Serialize;

/// RAM in bytes by its use, including the larger buffers on the stack.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct DecoderRam {
    /// Pointers to each row's weights, which stay in flash.
    pub decoder: usize,
    /// Readings of all rows.
    pub frame: usize,
    /// Outputs of all rows, and their status.
    pub estimate: usize,
    /// Scaled readings of one row, on the stack.
    pub scaled_readings: usize,
    /// Features of the whole array, on the stack; 0 without a projection.
    pub features: usize,
    /// One over each reading of the baseline, and readings relative to it; 0 for a model of readings.
    pub relative_inputs: usize,
    /// Activations of 128 centres, on the stack of f32 networks; 0 without a network of that format.
    pub activations: usize,
}

impl DecoderRam {
    /// RAM for decoding with `model`.
    #[must_use]
    pub fn of(model: &Model<'_>) -> Self {
        let (shape, metadata) = (model.shape(), model.metadata());
        let float = size_of::<f32>();
        let readings = shape.inputs * float;
        let f32_kernel = model.networks().any(|network| network.format() == Format::F32);
        Self {
            decoder: model_core::decoder_ram_bytes(shape.rows),
            frame: shape.rows * readings,
            estimate: shape.rows * (shape.outputs * float + 1),
            scaled_readings: readings,
            features: model.projection().map_or(0, |_| readings),
            relative_inputs: match (metadata.relative_inputs, model.projection()) {
                (false, _) => 0,
                (true, None) => (shape.rows + 1) * readings,
                (true, Some(_)) => 2 * shape.rows * readings,
            },
            activations: if f32_kernel { 128 * float } else { 0 },
        }
    }

    /// Total in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let Self {
            decoder,
            frame,
            estimate,
            scaled_readings,
            features,
            relative_inputs,
            activations,
        } = self;
        decoder + frame + estimate + scaled_readings + features + relative_inputs + activations
    }

    /// Total in bytes behind a gate, which holds the baseline (a frame) and its estimate.
    #[must_use]
    pub fn gated_bytes(&self) -> usize {
        self.bytes() + self.frame + self.estimate
    }
}
