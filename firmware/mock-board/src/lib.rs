//! A board without hardware: sensor, serial line, clock, flash and settings as mocks, and the host at the other end
//! of the line. All are stricter than real parts.
//!
//! [`Bench`] puts an application together with what it is connected to:
//!
//! ```
//! use firmware::app::Session;
//! use mock_board::{Bench, MockSlot, blob, crc_of, model_crc, quiet};
//!
//! let model = blob(1, 3);
//! let mut slots = MockSlot::pair_with(&model);
//! let mut bench = Bench::new(quiet());
//! let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
//! assert_eq!(model_crc(&mut session, &bench.board), Some(crc_of(&model)));
//! ```

#![allow(missing_docs, clippy::missing_errors_doc)] // a name that says all needs no more

// From the ground up: a module imports only what is declared before it.
mod shape;
mod power;
mod slot;
#[cfg(target_os = "linux")]
mod decay;
mod pages;
mod key_area;
mod board;
mod source;
mod models;
mod bench;
mod host;

pub use bench::{Bench, Memory, TestApp, TestSession, quiet};
pub use board::{AnyKeeper, Board, Pins};
#[cfg(target_os = "linux")]
pub use decay::flip_bit;
pub use host::{
    ask, begin, configure, install, model_crc, reports, request_bytes, settle, upload, upload_steps,
};
pub use key_area::KeyArea;
pub use models::{blob, blob_of, blob_of_components, blob_with_confidence, crc_of};
pub use pages::{MockPage, SharedSettings};
pub use shape::{COLS, MESSAGE_BYTES, OUTPUTS, ROWS, TestFrame, frame_at_rest};
pub use slot::MockSlot;
pub use source::Source;
