//! RAM for decoding on a 32-bit device.

use serde::Serialize;
use taxel_core::rbf::Format;

use super::design::{Design, NetworkDesign};

/// RAM in bytes by its use, including the larger buffers on the stack. The weights are not counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct DecoderRam {
    /// Pointers to each row's weights.
    pub decoder: usize,
    /// Readings of all rows.
    pub frame: usize,
    /// Outputs of all rows, and their status.
    pub estimate: usize,
    /// Scaled inputs of a network.
    pub scaled_readings: usize,
    /// Features of the whole array; 0 without a projection.
    pub features: usize,
    /// Shape and strength of a touch; 0 without one.
    pub touch: usize,
    /// One over each reading of the baseline, and readings relative to it; 0 for a model of readings.
    pub relative_inputs: usize,
    /// Exponents and activations of a batch of centres, on the stack.
    pub activations: usize,
}

impl DecoderRam {
    /// RAM for decoding with a model of this `design`.
    pub fn new(design: &Design) -> Self {
        let shape = design.shape;
        let float = size_of::<f32>();
        let readings = shape.inputs * float;
        let most = |floats: &dyn Fn(&NetworkDesign) -> usize| {
            design.networks.iter().map(floats).max().unwrap_or(0) * float
        };
        let touch = most(&|it| {
            let touch = it.front.filter(|front| front.touch.is_some());
            touch.map_or(0, |front| front.seen(shape.rows * shape.inputs))
        });
        let batch = |format, centres: usize| match format {
            Format::F32 => 0,
            Format::Fixed16 => centres.next_multiple_of(16).min(256),
        };
        let activations = design.networks.iter().map(|it| batch(it.format, it.shape.centres));
        Self {
            decoder: taxel_core::decoder_ram_bytes(shape.rows),
            frame: shape.rows * readings,
            estimate: shape.rows * (shape.outputs * float + 1),
            scaled_readings: most(&|it| it.shape.inputs),
            features: most(&NetworkDesign::features),
            touch,
            relative_inputs: match (design.relative_inputs, design.whole_frames()) {
                (false, _) => 0,
                (true, false) => (shape.rows + 1) * readings,
                (true, true) if touch > 0 => shape.rows * readings,
                (true, true) => 2 * shape.rows * readings,
            },
            activations: activations.max().unwrap_or(0) * float,
        }
    }

    /// Total in bytes.
    pub fn bytes(&self) -> usize {
        let Self {
            decoder,
            frame,
            estimate,
            scaled_readings,
            features,
            touch,
            relative_inputs,
            activations,
        } = self;
        let on_the_way = scaled_readings + features + touch + relative_inputs + activations;
        decoder + frame + estimate + on_the_way
    }
}
