//! The layers of networks before their output weights: projection and Gaussians.

use super::HiddenLayer;
use super::samples::Seen;

/// All that stands before the output weights, and what it makes of the frames that it was found on.
#[derive(Debug, Clone, PartialEq)]
pub struct Layers {
    /// Parameters of the projection in front of the one network of all rows; see [`projection`](super::projection).
    pub projection: Option<Vec<f32>>,
    /// What the networks see of the frames: these themselves, or their features behind the projection.
    pub seen: Seen,
    /// Gaussians of the row-wires' networks in order, or of the one network behind the projection.
    pub hidden: Vec<HiddenLayer>,
}
