//! Inference on many lines at once, in vector instructions, one line a lane.
//!
//! Operations are those of `model_core::rbf`, in their order where that matters, so that outputs stay
//! the same bit for bit.

#![expect(clippy::inline_always, reason = "what pulp dispatches must be inlined into it")]

use model_core::rbf::Network;

#[cfg(target_arch = "x86_64")]
use self::fixed16::Fixed16;
use self::floats::Floats;
use self::lines::Lines;
use super::Exponential;

mod aligned;
mod lines;
mod tiles;
mod exp;
mod exponent;
mod floats;
#[cfg(target_arch = "x86_64")]
mod fixed16;

/// Network laid out for computing several lines at once.
#[derive(Debug)]
pub(super) enum Batch<'a> {
    Floats(Floats<'a>),
    #[cfg(target_arch = "x86_64")]
    Fixed16(Fixed16<'a>),
}

impl<'a> Batch<'a> {
    /// Network in its vectorised form, if it has one.
    pub(super) fn of(network: &Network<'a>, exponential: Exponential) -> Option<Self> {
        match network {
            #[cfg(target_arch = "x86_64")]
            Network::Fixed16(inner) => Fixed16::of(inner).map(Self::Fixed16),
            _ => Floats::of(network, exponential).map(Self::Floats),
        }
    }

    /// Infers the outputs for lines of readings; NaN for a line where a reading is missing or an output
    /// overflows.
    ///
    /// Each line of the network starts `readings_step` (`outputs_step`) values after the previous one.
    pub(super) fn infer(
        &self,
        readings: &[f64],
        readings_step: usize,
        outputs: &mut [f64],
        outputs_step: usize,
    ) {
        let lines = Lines { readings, readings_step, outputs, outputs_step };
        match self {
            Self::Floats(network) => network.infer(lines),
            #[cfg(target_arch = "x86_64")]
            Self::Fixed16(network) => network.infer(lines),
        }
    }
}

#[cfg(test)]
mod tests;
