//! Baseline: always predicting the mean of the training outputs, which any decoder must beat.

use taxel_data::Dataset;

use crate::decoder::{Estimates, FrameDecoder, Frames};

/// Name of the decoder in tables and results.
pub const NAME: &str = "mean";

/// Decoder that always predicts the mean of the training outputs, whatever the readings are.
#[derive(Debug, Clone, PartialEq)]
pub struct Mean {
    inputs: usize,
    outputs: Vec<f64>,
}

impl Mean {
    /// Computes the mean of each output of `training`.
    pub fn fit(training: &Dataset) -> Self {
        Self { inputs: training.inputs.names.len(), outputs: training.outputs.means() }
    }
}

impl FrameDecoder for Mean {
    type State = ();

    fn name(&self) -> &str {
        NAME
    }

    fn inputs(&self) -> usize {
        self.inputs
    }

    fn decode(&self, (): &mut (), frames: Frames<'_>) -> Estimates {
        Estimates::of_values(self.outputs.repeat(frames.readings.len() / self.inputs.max(1)))
    }
}
