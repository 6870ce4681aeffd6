//! A board without hardware: sensor, serial line, clock and flash as mocks, and the host at the other end
//! of the line. All are stricter than real parts, and panic where a test asks for what cannot be.
//!
//! [`Bench`] puts an application together with what it is connected to:
//!
//! ```
//! use taxel_firmware::app::Session;
//! use mock_board::{Bench, Flash, blob, crc_of, model_crc, quiet};
//!
//! let model = blob(1, 3);
//! let mut slots = Flash::slots_with(&model);
//! let mut bench = Bench::new(quiet());
//! let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
//! assert_eq!(model_crc(&mut session, &bench.board), Some(crc_of(&model)));
//! ```

#![allow(missing_docs, clippy::missing_errors_doc, clippy::missing_panics_doc)] // a name that says all needs no more

// From the ground up: a module imports only what is declared before it.
mod shape;
mod flash;
mod board;
mod source;
mod models;
mod bench;
mod host;
mod device;
pub mod sweep;

pub use bench::{Bench, Memory, Running, TestApp, TestSession, quiet};
pub use board::{Board, Pins};
pub use device::{Device, Snapshot, confirmed, confirmed_steps, model, trial_steps};
pub use flash::{Cells, Flash, Supply, Torn, Worn};
pub use host::{
    Answer, ask, begin, find_report, install, model_crc, reports, request_bytes, settle,
    statistics, undo, upload, upload_step, upload_steps,
};
pub use models::{
    blob, blob_of, blob_of_a_row, blob_of_features, blob_of_length, blob_with_confidence, crc_of,
};
pub use shape::{COLS, MESSAGE_BYTES, OUTPUTS, ROWS, TestFrame, frame_at_rest};
pub use source::Source;
