//! What decoding costs on a Cortex-M4F, predicted from a model's [`Design`]: instructions, cycles, flash and RAM.
//!
//! Code is cut into *pieces*: the start of a routine, sixteen centres, one output of them, and so on. A design tells
//! how often each is executed, a price list what one execution costs. `cargo xtask cycles --accept` finds the prices:
//! it counts frames of many designs in QEMU, and solves for them. `docs/cycles.md` says how, and how exact they are.

mod pieces;
mod design;
mod memory;
mod frames;
mod prices;
mod routines;
mod compiled;

pub use design::{Design, NetworkDesign};
pub use frames::{Cost, Frames};
pub use memory::DecoderRam;
use model_core::rbf::Format;
pub use pieces::Pieces;
pub use prices::{Price, Prices};

use crate::error::Result;
use crate::infer::Exponential;

/// The price list in the repository.
const ACCEPTED: &str = include_str!("../../../firmware/prices.csv");

/// Bytes of a line of an STM32F446's flash, and the cycles that reading one waits at 180 MHz.
const FLASH_LINE_BYTES: usize = 16;
const WAIT_STATES: u64 = 5;

/// What lies before decoding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gating {
    /// No gate.
    Ungated,
    /// A gate that finds all rows at rest.
    AtRest,
    /// A gate that finds all rows touched, each by its last reading; an array by the last reading of its last row.
    Awake,
}

/// How often pieces of code are executed for one frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FramePieces {
    /// Pieces of routines in assembly.
    pub assembly: Pieces,
    /// Pieces of compiled code.
    pub compiled: Pieces,
}

impl FramePieces {
    /// The pieces of one frame of a model of this `design`.
    pub fn of(design: &Design, exponential: Exponential, gating: Gating) -> Self {
        Self {
            assembly: routines::of_frame(design, gating),
            compiled: compiled::of_frame(design, exponential, gating),
        }
    }
}

impl Prices {
    /// The price list in the repository, `firmware/prices.csv`.
    ///
    /// # Errors
    /// [`Error::Prices`](crate::Error::Prices) if it is not sound.
    pub fn accepted() -> Result<Self> {
        Self::parse(ACCEPTED)
    }

    /// What one frame costs a model of this `design`, with the `exponential` of networks in `f32-direct`.
    ///
    /// # Errors
    /// [`Error::Prices`](crate::Error::Prices) names a piece that the list lacks.
    pub fn frame(&self, design: &Design, exponential: Exponential, gating: Gating) -> Result<Cost> {
        let FramePieces { assembly, compiled } = FramePieces::of(design, exponential, gating);
        let (exact, mean) = (self.sum(&assembly)?, self.sum(&compiled)?);
        let [instructions, cycles, flash_cycles] =
            [0, 1, 2].map(|cost| (exact[cost] + mean[cost]).round() as u64);
        let waiting = if gating == Gating::AtRest { 0 } else { design.least_waiting_for_weights() };
        Ok(Cost { instructions, cycles, flash_cycles: flash_cycles + waiting })
    }

    /// What a frame costs a model of this `design` without a gate, and behind gates.
    ///
    /// # Errors
    /// As [`frame`](Self::frame).
    pub fn frames(&self, design: &Design, exponential: Exponential) -> Result<Frames<Cost>> {
        Ok(Frames {
            ungated: self.frame(design, exponential, Gating::Ungated)?,
            at_rest: self.frame(design, exponential, Gating::AtRest)?,
            awake: self.frame(design, exponential, Gating::Awake)?,
        })
    }
}

impl Design {
    /// Least waiting in cycles for the weights that one frame reads: 0 if they are in RAM.
    pub fn least_waiting_for_weights(&self) -> u64 {
        if self.weights_in_ram {
            return 0;
        }
        let networks: usize = self.row_networks().map(NetworkDesign::bytes).sum();
        least_waiting_for_weights(networks + self.projection_bytes() + self.expansion_bytes())
    }
}

/// Least waiting in cycles for weights in flash of which so many `bytes` are read, once and in order: for every line, the
/// wait states of one read. Weights are too many for the cache of data, and nothing prefetches data.
pub fn least_waiting_for_weights(bytes: usize) -> u64 {
    bytes.div_ceil(FLASH_LINE_BYTES) as u64 * WAIT_STATES
}

/// Name of a number format with an exponential, as `cargo xtask cycles` spells it.
pub fn kernel_name(format: Format, exponential: Exponential) -> String {
    match (format, exponential) {
        (Format::F32Direct, Exponential::Libm | Exponential::Micromath) => {
            format!("{}-{}", format.name(), exponential.name())
        }
        _ => format.name().into(),
    }
}

#[cfg(test)]
mod tests {
    use super::least_waiting_for_weights;

    #[test]
    fn each_line_of_flash_is_waited_for_once() {
        assert_eq!([0, 1, 16, 17, 160].map(least_waiting_for_weights), [0, 5, 5, 10, 50]);
    }
}
