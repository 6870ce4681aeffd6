//! What can go wrong in training and packing, as values that a program can match.

use std::path::PathBuf;

use model_core::blob::{DecodeError, EncodeError};
use model_core::rbf::{Format, NetworkError};
use taxel_data::BadValue;

/// Result of everything in this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// A failure of training, selection or packing.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An option cannot be used, by itself or with this data.
    #[error(transparent)]
    Setting(#[from] BadValue),
    /// A file cannot be read.
    #[error(transparent)]
    Data(#[from] taxel_data::Error),
    /// A blob was refused.
    #[error("{}: {cause}", path.display())]
    Blob {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: DecodeError,
    },
    /// A format has no room for so many inputs.
    #[error("{inputs} inputs a row: the format {} holds at most {most}; give another format ({})", format.name(), Format::F32.name())]
    TooManyInputs {
        /// The format.
        format: Format,
        /// Inputs of a row.
        inputs: usize,
        /// Inputs that it holds.
        most: usize,
    },
    /// Training ended in parameters that a format does not hold.
    #[error("training ends in numbers that the format {} does not hold ({cause}); bring the columns to a moderate scale, say by another unit", format.name())]
    NotHeld {
        /// The format.
        format: Format,
        /// Which, and why.
        cause: NetworkError,
    },
    /// Weights grow without end while they are rounded to a format.
    #[error("the format {} does not hold this model: its weights grow without end as they are rounded; give a larger spread, fewer centres, or another format ({})", format.name(), Format::F32.name())]
    WeightsGrow {
        /// The format.
        format: Format,
    },
    /// One network for the whole array was asked for, of data with the readings of one row-wire.
    #[error(
        "whole-array input needs the readings of two row-wires or more; the data has one: leave it out"
    )]
    OneRow,
    /// The readings have no regression on which a projection could be based.
    #[error("the readings have no regression: some are no numbers")]
    NoRegression,
    /// The projection of the readings is beyond f32.
    #[error("the projection of these readings is beyond f32")]
    ProjectionBeyondF32,
    /// The model is beyond what the blob's format holds.
    #[error("the model cannot be written: {0}")]
    NotPacked(EncodeError),
}
