//! A board without hardware: sensor, serial line, clock and flash as mocks, and the host at the other end
//! of the line. All are stricter than real parts, and panic where a test asks for what cannot be.
//!
//! [`Bench`] puts an application together with what it is connected to.

// From the ground up: a module imports only what is declared before it.
mod shape;
mod flash;
mod board;
mod source;
mod models;
mod host;
mod bench;
mod device;

pub use bench::{Bench, every, quiet, started};
pub use device::{Device, confirmed};
pub use flash::{Flash, Supply};
pub(crate) use host::answer;
pub use host::{CHUNK, Host, TRY, begin, framed, request_bytes, trial_steps};
pub use models::{
    OVERFLOWING, bits, blob, blob_of_a_row, blob_of_changes, blob_of_features, blob_of_names,
    blob_of_units, blob_with_readings, blob_with_tracker, crc_of, expected,
};
pub use shape::{COLS, OUTPUTS, ROWS, TestFrame, frame_at_rest, frame_with};
