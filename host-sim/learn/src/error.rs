//! Errors of training and packing, as values that a program can match.

use std::path::PathBuf;

use model_core::blob::{DecodeError, EncodeError};
use model_core::rbf::{Format, NetworkError};
use taxel_data::BadValue;

/// Result of the functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// Failure of training, selection or packing.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Option that cannot be used, by itself or with this data.
    #[error(transparent)]
    Setting(#[from] BadValue),
    /// Data file that cannot be read or used.
    #[error(transparent)]
    Data(#[from] taxel_data::Error),
    /// Blob that was rejected.
    #[error("{}: {cause}", path.display())]
    Blob {
        /// Path of the blob.
        path: PathBuf,
        /// Reason.
        cause: DecodeError,
    },
    /// More inputs than a format has room for.
    #[error("{inputs} inputs a row: the format {} holds at most {most}; give another format ({})", format.name(), Format::F32.name())]
    TooManyInputs {
        /// Number format of the network.
        format: Format,
        /// Number of inputs of a row.
        inputs: usize,
        /// Largest number of inputs that the format holds.
        most: usize,
    },
    /// Trained network with a parameter that its format does not hold.
    #[error("training ends in numbers that the format {} does not hold ({cause}); bring the columns to a moderate scale, say by another unit", format.name())]
    NotHeld {
        /// Number format of the network.
        format: Format,
        /// Parameter that does not fit, and why.
        cause: NetworkError,
    },
    /// Weights that grow without end while they are rounded to a format.
    #[error("the format {} does not hold this model: its weights grow without end as they are rounded; give a larger spread, fewer centres, or another format ({})", format.name(), Format::F32.name())]
    WeightsGrow {
        /// Number format of the network.
        format: Format,
    },
    /// Network for the whole array asked for, while the data has few readings, of one row-wire only.
    #[error(
        "whole-array input needs the readings of two row-wires or more, or more than {least} readings; the data has \
         {readings} of one: leave it out"
    )]
    OneRow {
        /// Number of readings in a frame.
        readings: usize,
        /// Number of readings that is not enough: that of the features.
        least: usize,
    },
    /// Readings without any regression on which a projection could be based.
    #[error(
        "the readings have no regression: some are no numbers, or so large that sums of their squares lose all digits"
    )]
    NoRegression,
    /// Projection of the readings with numbers beyond f32.
    #[error("the projection of these readings is beyond f32")]
    ProjectionBeyondF32,
    /// Model whose missing readings cannot be filled.
    #[error("the model cannot fill missing readings: {0}")]
    NoFill(&'static str),
    /// Model beyond what the blob's format holds.
    #[error("the model cannot be written: {0}")]
    NotPacked(EncodeError),
    /// Price list of code that cannot be used.
    #[error(
        "prices of code (firmware/prices.csv): {0}; `cargo xtask cycles --accept` writes them anew"
    )]
    Prices(String),
}
