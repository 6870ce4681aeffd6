//! Faults that are planted in the emulated board, and the words that must name each.

use super::board::{Board, prepare_emulator};
use super::{Options, accept};
use crate::process::Outcome;
use crate::toolchain::Toolchain;

/// In place of a name: each in turn.
pub const ALL: &str = "all";

/// Names of faults (proof/board-emulator/faults.py), and what a probable cause must say.
const FAULTS: [(&str, &str); 11] = [
    ("swapped-pin", "PA1 is swapped with PA7"),
    ("dead-converter", "ADC2 does not answer"),
    ("shorted-pin", "PA4 is shorted to ground"),
    ("stalled-numbers", "DMA2 stream 0 stalls"),
    ("stalled-rows", "DMA2 stream 6 stalls"),
    ("silent-triggers", "timer 8 does not trigger the converters"),
    ("lossy-line", "the line loses bytes"),
    ("low-supply", "V_DDA is too low"),
    ("hot-chip", "the chip is too hot"),
    ("bias-off", "V_b is off"),
    ("slow-op-amp", "the op-amp of column 5 is slow"),
];

/// Accepts the emulated board with each fault: the first cause that it tells must be the right one.
pub fn each_is_named(options: &Options) -> Outcome {
    let toolchain = Toolchain::find()?;
    let emulator = prepare_emulator(&toolchain)?;
    let mut missed = Vec::new();
    for (fault, words) in FAULTS {
        println!("-- {fault}");
        let mut board = Board::emulated(&emulator, Some(fault), None)?;
        let record = accept(&mut board, options, &toolchain)?;
        let cause = record.stages.iter().find_map(|stage| stage.probable_cause.as_deref());
        if !cause.is_some_and(|cause| cause.contains(words)) {
            missed.push(format!("{fault}: {words:?} is not said, but {cause:?}"));
        }
    }
    if missed.is_empty() { Ok(()) } else { Err(missed.join("\n")) }
}
