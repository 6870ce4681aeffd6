//! Virtual board: the firmware's readout, run on the host against a resistor network.
//!
//! [`VirtualBoard`] holds the sensor's wires as an electrical network, the parts that select rows and
//! sample columns, and a clock. Its pins, SPI devices, converter and delay implement embedded-hal 1.0,
//! so that the firmware's own scanner runs on them. The parts are strict: a request that the real one
//! would not accept is refused and recorded ([`VirtualBoard::check`]).
//!
//! Cross-talk, resistance in switches and leads, offsets, noise and settling are each simulated only if
//! the world's readout asks for it. Quantisation always is, since the parts give counts.
//!
//! ```
//! use taxel_firmware::readout::FrameSource;
//! use taxel_simulate::World;
//! use taxel_virtual_board::{SeriesResistance, VirtualBoard};
//!
//! let board = VirtualBoard::new(&World::press())?;
//! board.set_readings(&[57.5; 144]); // Ω, row after row
//! let mut scanner = board.scanner(SeriesResistance::NONE);
//! let mut frame = [f32::NAN; 144];
//! let report = scanner.scan(board.scan_settings(), board.wires(), &mut frame);
//! board.check()?;
//! assert_eq!(report.failed_samples, 0);
//! assert!((frame[143] - 57.5).abs() < 0.02);
//! # Ok::<(), taxel_simulate::Error>(())
//! ```

#![allow(missing_docs, clippy::missing_errors_doc)] // a name that says all needs no more

mod violation;
mod pin;
mod network;
mod fault;
mod analogue;
mod rows;
mod converters;
mod board;
mod handles;
mod scanner;
mod scan;
#[cfg(test)]
mod tests;

pub use analogue::{Parts, op_amp_time_constant_us};
pub use board::{Transactions, VirtualBoard};
pub use fault::BoardFault;
pub use handles::{VirtualAdc, VirtualDelay, VirtualPin, VirtualSpi};
pub use pin::Pin;
pub use scan::{all_readings, scan};
pub use scanner::{FrameScanner, SeriesResistance};
pub use violation::Violation;

/// Row-wires that the board's parts can drive.
pub const ROWS: usize = 8;
/// Column-wires that the board's parts can sample.
pub const COLUMNS: usize = 18;
