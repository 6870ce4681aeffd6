//! Errors that several modules report.

use taxel_core::blob::EncodeError;
use taxel_core::rbf::{Format, NetworkError};
pub use taxel_data::error::{Error, Result};

/// Error for readings without any regression on which a projection could be based.
pub(crate) fn no_regression() -> Error {
    Error::failed(
        "the readings cannot be fitted: some are not numbers, or are so large that sums of their squares lose all digits",
    )
}

/// Error for a model beyond what the blob's format holds.
pub(crate) fn not_packed(cause: EncodeError) -> Error {
    Error::failed(format!("the model cannot be written: {cause}"))
}

/// Error for a trained network with a parameter that its format does not hold.
pub(crate) fn parameter_not_held(format: Format, cause: NetworkError) -> Error {
    Error::unfit(format!(
        "training gives numbers that the format {} cannot represent ({cause}); give the columns a moderate scale, for \
         example by another unit",
        format.name()
    ))
}
