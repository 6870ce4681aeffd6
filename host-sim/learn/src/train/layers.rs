//! The layers of networks before their output weights: projection and Gaussians.

use std::borrow::Cow;

use taxel_data::Dataset;

use super::HiddenLayer;

/// All that stands before the output weights, and what it makes of the frames that it was found on.
#[derive(Debug, Clone, PartialEq)]
pub struct Layers<'d> {
    /// Parameters of the projection in front of the one network of all rows; see [`projection`](super::projection).
    pub projection: Option<Vec<f32>>,
    /// What the networks are given of the frames: these themselves, or their features behind the projection.
    pub seen: Cow<'d, Dataset>,
    /// Gaussians of the row-wires' networks in order, or of the one network behind the projection.
    pub hidden: Vec<HiddenLayer>,
}
