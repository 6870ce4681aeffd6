//! What a model asks of a device: time, memory, and whether a slot holds it.

use serde::Serialize;
use taxel_learn::ModelBlob;
use taxel_learn::cost::{Cost, DecoderRam, Design};

use crate::verdict::SLOT_BYTES;

/// Clock of the STM32F446, in MHz.
const CLOCK_MHZ: f64 = 180.0;

/// Cost of decoding a frame on a Cortex-M4F, and the memory that a model takes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DeviceCost {
    /// Cycles with memory that never waits.
    pub cycles: u64,
    /// Time in µs that these take at 180 MHz.
    pub us: f64,
    /// RAM in bytes for decoding, without weights.
    pub ram_bytes: usize,
    /// Whether the images copy the weights to RAM, which takes as many bytes more as the blob has.
    pub weights_in_ram: bool,
    pub blob_bytes: usize,
    /// Size of a slot for models in flash, in bytes.
    pub slot_bytes: usize,
    /// Whether a slot holds the blob.
    pub fits_slot: bool,
}

impl DeviceCost {
    /// Cost of the model in `blob`.
    pub fn new(blob: &ModelBlob) -> Self {
        let design = Design::new(blob);
        let frame = Cost::of_frame(&design);
        let blob_bytes = blob.bytes().len();
        Self {
            cycles: frame.cycles,
            us: frame.cycles as f64 / CLOCK_MHZ,
            ram_bytes: DecoderRam::new(&design).bytes(),
            weights_in_ram: design.weights_in_ram,
            blob_bytes,
            slot_bytes: SLOT_BYTES,
            fits_slot: blob_bytes <= SLOT_BYTES,
        }
    }
}
