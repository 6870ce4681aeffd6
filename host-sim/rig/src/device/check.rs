//! Check of a device: it must decode like the host.

use serde::Serialize;
use taxel_core::filter::Settings;
use taxel_data::Progress;
use taxel_firmware::link::message::Statistics;
use taxel_learn::ModelBlob;

pub use super::expected::Frames;
use super::expected::{Expected, prepare};
use super::{Device, DeviceIdentity};
use crate::error::Result;

/// Plan of a check.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Number of frames on their way at a time: see [`decode_frames`](super::stream::decode_frames).
    /// A filter and a tracker need them one after the other, however many they are.
    pub window: usize,
    /// Settings of the filter in time that the device and the host pass outputs through.
    pub filter: Settings,
}

/// Findings of a check.
#[derive(Debug, Clone, PartialEq)]
pub struct Findings {
    /// Identity of the device at the end, with the deepest use of its stack.
    pub device: DeviceIdentity,
    /// Counters of the device.
    pub statistics: Statistics,
    /// Findings about decoding.
    pub frames: FrameFindings,
    /// Number of requests that were not answered in time and sent again.
    pub repeated: u64,
    /// Number of damaged frames of bytes from the device.
    pub damaged: u64,
}

impl Findings {
    /// Whether every finding is good. A request that had to be sent again, or a damaged report, is a
    /// fault of the line, and counts as bad.
    pub fn all_good(&self) -> bool {
        self.frames.bit_identical == self.frames.frames && self.repeated == 0 && self.damaged == 0
    }
}

/// Findings about decoding.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrameFindings {
    pub frames: usize,
    /// Number of frames in which every output has the bits that the host computes, and so have novelty and deviations.
    pub bit_identical: usize,
    /// Frames a second, the line included.
    pub frames_per_s: f64,
}

/// Compares `device` with the host on `frames`, whose baseline the device takes.
///
/// The model of `blob` is uploaded first if it is not active.
///
/// # Errors
/// [`Error`](crate::Error) if the device stops answering, or is not one for this model. Wrong results
/// are no error: they are in the findings.
pub fn check(
    device: &mut Device,
    frames: &Frames,
    blob: &ModelBlob,
    plan: &Plan,
    progress: &dyn Progress,
) -> Result<Findings> {
    device.while_paused(|device| {
        prepare(device, blob, progress)?;
        let expected = Expected::new(blob, frames, plan.filter);
        let frames = frames.readings.len();
        let (bit_identical, time) = expected.count_same(device, frames, plan.window, progress)?;
        let frames_per_s = frames as f64 / time.as_secs_f64();
        Ok(Findings {
            device: device.identify()?,
            statistics: device.statistics()?,
            frames: FrameFindings { frames, bit_identical, frames_per_s },
            repeated: device.repeated,
            damaged: device.damaged,
        })
    })
}

#[cfg(test)]
mod tests {
    use taxel_firmware::link::message::Report;

    use super::*;
    use crate::device::upload::tests::identity;

    #[test]
    fn every_frame_must_have_the_hosts_bits_over_a_sound_line() {
        let Report::Identity(identity) = identity(false) else { unreachable!() };
        let device = DeviceIdentity::from(&identity);
        let frames = FrameFindings { frames: 5, bit_identical: 5, frames_per_s: 1.0 };
        let statistics = Statistics::default();
        let good = Findings { device, statistics, frames, repeated: 0, damaged: 0 };
        assert!(good.all_good());
        let one_differs = FrameFindings { bit_identical: 4, ..good.frames.clone() };
        assert!(!Findings { frames: one_differs, ..good.clone() }.all_good());
        assert!(!Findings { repeated: 1, ..good.clone() }.all_good());
        assert!(!Findings { damaged: 1, ..good }.all_good());
    }
}
