//! Errors of training and packing, as values that a program can match.

use std::path::PathBuf;

use model_core::blob::{DecodeError, EncodeError};
use model_core::rbf::{Format, NetworkError};
use taxel_data::BadValue;
use taxel_data::error::{Role, quoted};

/// Result of the functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// Why f32 does not hold a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unresolved {
    /// Values beyond the largest magnitude that training accepts.
    TooLarge {
        /// That magnitude.
        bound: f64,
    },
    /// Range below the least one that inputs can be scaled by.
    TooNarrow {
        /// Least range.
        bound: f64,
    },
    /// Range whose square, which a confidence holds, f32 does not hold.
    SquareLost {
        /// Least range.
        least: f64,
        /// Largest range.
        most: f64,
    },
    /// Values so far from zero that rounding blurs them.
    TooFarFromZero {
        /// Distance between neighbouring numbers in f32 there.
        step: f64,
    },
}

impl Unresolved {
    /// What is wrong with values in the range from `low` to `high`, and what to do.
    fn words(self, role: Role, [low, high]: [f64; 2]) -> String {
        let scale = |size: f64| format!("1e{}", -size.log10().floor());
        let leave = match role {
            Role::Inputs => ", or leave it out of the inputs",
            Role::Outputs => "",
        };
        match self {
            Self::TooLarge { bound } => format!(
                "values beyond {bound:e} are too large for f32, which devices compute in: multiply it by {}{leave}",
                scale(low.abs().max(high.abs()))
            ),
            Self::TooNarrow { bound } => format!(
                "a range below {bound:e} is lost in f32, which devices compute in: multiply it by {}{leave}",
                scale(high - low)
            ),
            Self::SquareLost { least, most } => format!(
                "a confidence, which holds squares in f32, needs a range from {least:e} to {most:e}: multiply it by {}, \
                 or leave the confidence out",
                scale(high - low)
            ),
            Self::TooFarFromZero { step } => {
                let unit = 10_f64.powf((high - low).log10().floor());
                format!(
                    "numbers in f32, which devices compute in, are {step:?} apart there: subtract {} from it{leave}",
                    (low / unit).floor() * unit
                )
            }
        }
    }
}

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
    /// Column of which f32 would leave too little ([`resolution`](crate::train::resolution)).
    #[error("column {} goes from {:?} to {:?}, and {}", quoted(column), range[0], range[1], why.words(*role, *range))]
    Column {
        /// Name of the column.
        column: String,
        /// Whether it is an input or an output.
        role: Role,
        /// Its smallest and largest value.
        range: [f64; 2],
        /// Reason.
        why: Unresolved,
    },
    /// Output that a format decodes clearly worse than the same weights in f64.
    #[error(
        "the format {} loses the output {output:?}: R² on the training frames would be {lost:.3} lower than with the same \
         centres in f64. Subtract {mean:?}, its mean, from the output; or choose another format ({}) or a smaller spread",
        format.name(), Format::F32.name()
    )]
    OutputLost {
        /// Number format of the network.
        format: Format,
        /// Name of the output.
        output: String,
        /// By how much R² is lower.
        lost: f64,
        /// Mean of the output.
        mean: f64,
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
    /// Frames that are too few to tell missing readings from the others.
    #[error(
        "{frames} frames are too few to learn how to fill {readings} missing readings (fill): give {least} or more, or \
         leave the fill out"
    )]
    FewForFill {
        /// Number of frames.
        frames: usize,
        /// Number of readings of a frame.
        readings: usize,
        /// Least number of frames.
        least: usize,
    },
    /// Model that presses cannot recalibrate.
    #[error("the model cannot be recalibrated: {0}")]
    NotRecalibrable(&'static str),
    /// Network that has seen too few presses to be recalibrated, or presses that are too alike.
    #[error("{}too few presses, or presses that are too alike; press other places", row.map_or(String::new(), |row| format!("row {row} has seen ")))]
    NotExcited {
        /// Number of its row, from 1; `None` for a network of the whole array.
        row: Option<usize>,
    },
    /// Recalibration that makes no network better.
    #[error("no better model came of the presses; the model is as good, or the presses are wrong")]
    NotBetter,
    /// Model beyond what the blob's format holds.
    #[error("the model cannot be written: {0}")]
    NotPacked(EncodeError),
    /// Price list of code that cannot be used.
    #[error(
        "prices of code (firmware/prices.csv): {0}; `cargo xtask cycles --fit` writes them anew"
    )]
    Prices(String),
}
