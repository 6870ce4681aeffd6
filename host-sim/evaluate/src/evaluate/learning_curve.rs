//! Learning curve of a recursion: errors by the number of frames that it had taken in.

use serde::Serialize;
use taxel_data::columns;
use taxel_learn::train::stream::Learned;

use crate::metrics::pooled;

/// Frames that the errors of a learning curve were measured on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LearnedOn {
    /// Frames of the scene that nothing was trained on.
    FreshFrames,
    /// Next frames of the stream, before these were taken in.
    NextFrames,
}

impl LearnedOn {
    /// Frames in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::FreshFrames => "fresh frames",
            Self::NextFrames => "the next frames, before they are taken in",
        }
    }
}

/// Errors by the number of frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LearningCurve {
    /// Frames that errors were measured on.
    pub judged_on: LearnedOn,
    pub groups: Vec<String>,
    pub units: Vec<String>,
    /// RMSE of always predicting the mean of the first frames, on these frames, for each group.
    pub mean_rmse: Vec<f64>,
    /// Errors, in the order of the frames.
    pub points: Vec<Point>,
}

/// Errors after so many frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Point {
    pub frames: usize,
    /// Number of frames that the errors were measured on.
    pub judged_frames: usize,
    /// RMSE of each group, in its unit, with weights in f64.
    pub rmse: Vec<f64>,
}

impl LearningCurve {
    /// Curve of `learned` errors of outputs with these `names`, whose standard deviations are `deviations`.
    pub fn new(
        judged_on: LearnedOn,
        learned: &[Learned],
        names: &[String],
        deviations: &[f64],
    ) -> Self {
        let groups = columns::groups(names);
        let points = learned.iter().map(|point| Point {
            frames: point.frames,
            judged_frames: point.judged_frames,
            rmse: pooled(&groups, &point.rmse),
        });
        Self {
            judged_on,
            points: points.collect(),
            mean_rmse: pooled(&groups, deviations),
            units: groups.iter().map(|(group, _)| columns::unit_of(group).into()).collect(),
            groups: groups.iter().map(|(group, _)| (*group).into()).collect(),
        }
    }
}
