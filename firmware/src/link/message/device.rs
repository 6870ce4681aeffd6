//! What a device is, and what it has counted.

use serde::{Deserialize, Serialize};

/// Identity of the device, and of the model in force.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Identity<'a> {
    /// Name of the board.
    pub board: &'a str,
    /// Version of the firmware.
    pub firmware: &'a str,
    /// Largest number of row-wires.
    pub rows: u8,
    /// Largest number of column-wires: readings a row.
    pub columns: u8,
    /// Largest number of outputs a row.
    pub outputs: u8,
    /// The model in force; `None` if there is none.
    pub model: Option<ModelIdentity>,
    /// Name of the scene or data set of the model in force, cut after 40 bytes; empty without a model.
    pub model_name: &'a str,
    /// Largest blob that a slot holds, in bytes.
    pub slot_bytes: u32,
    /// Largest chunk of an upload in bytes, a multiple of four.
    pub chunk_bytes: u16,
    /// Use of flash and RAM.
    pub memory: Memory,
    /// Number that no other device of this board has; zeros if the board has none.
    pub unique_id: [u8; 12],
    /// CRC-32 of the wires of all readings, in their order: of a row and a column each, as bytes that count from 0.
    pub wires_crc_32: u32,
}

/// Identity of the model in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ModelIdentity {
    /// CRC-32 at the end of the model's blob.
    pub crc_32: u32,
    /// Slot of the model, 0 or 1.
    pub slot: u8,
    /// Number of times that a model came into force for good on this device; 0 if this one was flashed with the firmware.
    pub generation: u32,
    /// Number of rows.
    pub rows: u8,
    /// Number of readings a row.
    pub inputs: u16,
    /// Number of outputs a row.
    pub outputs: u16,
    /// Whether the weights are decoded from a copy in RAM; else from the slot.
    pub in_ram: bool,
    /// CRC-64/XZ of the scene or data file that trained the model.
    pub scene_digest: u64,
    /// CRC-32 of the names of its readings, and then of their units.
    pub inputs_crc_32: u32,
    /// CRC-32 of the names of its outputs, and then of their units.
    pub outputs_crc_32: u32,
    /// Whether the model is on trial: not confirmed, and gone with the next restart.
    pub on_trial: bool,
}

/// Use of a device's memory, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Memory {
    /// Flash for the vector table.
    pub vector_table: u32,
    /// Flash for code.
    pub text: u32,
    /// Flash for constants.
    pub rodata: u32,
    /// RAM for variables with an initial value, and as much flash for these values.
    pub data: u32,
    /// RAM for variables that start as zero.
    pub bss: u32,
    /// RAM for variables that are not initialised.
    pub uninit: u32,
    /// RAM reserved for the stack.
    pub stack_reserved: u32,
    /// RAM that the stack has used at most since the start.
    pub stack_high_water: u32,
}

impl Memory {
    /// Bytes of flash that the firmware takes, without models.
    pub fn flash_bytes(&self) -> u32 {
        let parts = [self.vector_table, self.text, self.rodata, self.data];
        parts.into_iter().fold(0, u32::saturating_add)
    }

    /// Bytes of RAM that the firmware takes, with the stack at its deepest so far.
    pub fn ram_bytes(&self) -> u32 {
        let parts = [self.data, self.bss, self.uninit, self.stack_high_water];
        parts.into_iter().fold(0, u32::saturating_add)
    }
}

/// Counters since the start. Each stops at its largest value, except the number of frames scanned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Statistics {
    /// Number of frames scanned, which numbers them. After its largest value it wraps around to 0.
    pub frames_scanned: u32,
    /// Number of frames decoded, scanned or on request.
    pub frames_decoded: u32,
    /// Number of frames that could not be scanned in time.
    pub frames_missed: u32,
    /// Number of samples that the converter did not give.
    pub failed_samples: u32,
    /// Number of requests answered.
    pub requests: u32,
    /// Number of frames of bytes that were damaged, cut, too long or not of this protocol.
    pub bad_packets: u32,
    /// Number of reports that the host did not take in time.
    pub lost_reports: u32,
    /// Number of turns of the loop that did not feed the watchdog.
    pub bad_loops: u32,
    /// Longest scan in µs.
    pub longest_scan_us: u32,
    /// Longest decoding of one frame in µs, its filter included.
    pub longest_decode_us: u32,
    /// Longest decoding of one frame in cycles of the processor; 0 on a board that does not count them.
    pub longest_decode_cycles: u32,
    /// Shortest decoding of one frame in cycles of the processor; 0 on a board that does not count them.
    pub shortest_decode_cycles: u32,
    /// Number of decoded frames with [`EstimateReport::CLAMPED`](super::EstimateReport::CLAMPED).
    pub frames_clamped: u32,
    /// Number of times that a slot was erased.
    pub slot_erases: u32,
    /// Number of frames with [`EstimateReport::NOVEL`](super::EstimateReport::NOVEL).
    pub frames_novel: u32,
    /// Longest time in µs of computing a frame's confidence.
    pub longest_confidence_us: u32,
    /// Longest time of computing a frame's confidence, in cycles of the processor; 0 on a board that does not count them.
    pub longest_confidence_cycles: u32,
    /// Longest time in µs from the start of a scan until the board's line took the last byte of its estimate. What the
    /// line holds back, such as a ring of bytes, is still to be sent then.
    pub longest_latency_us: u32,
}

impl Statistics {
    /// Counts a scanned frame; returns its number. The largest is followed by 0.
    pub fn number_frame(&mut self) -> u32 {
        self.frames_scanned = self.frames_scanned.wrapping_add(1);
        self.frames_scanned
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_numbered_on_behind_the_largest_number() {
        let mut s = Statistics { frames_scanned: u32::MAX - 1, ..Statistics::default() };
        assert_eq!([(); 3].map(|()| s.number_frame()), [u32::MAX, 0, 1]);
    }
}
