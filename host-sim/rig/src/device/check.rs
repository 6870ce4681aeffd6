//! Check of a device: it must decode like the host, and survive bad input.

use std::time::{Duration, Instant};

use serde::Serialize;
use taxel_core::filter::Settings;
use taxel_data::{Progress, Purpose, Random, Silent, Stream};
use taxel_firmware::link::message::{Report, Request, Statistics};
use taxel_learn::ModelBlob;

pub use super::expected::Frames;
use super::expected::{Expected, prepare};
use super::{Device, DeviceIdentity};
use crate::error::{Error, Result};

mod uploads;

pub use uploads::UploadFindings;
use uploads::check_uploads;

/// Time in which any device has taken all bytes that were sent to it, however slow it is.
const SWALLOWED: Duration = Duration::from_mins(2);

/// Plan of a check.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Seed of every random draw.
    pub seed: u64,
    /// Number of damaged models to upload.
    pub damaged_uploads: usize,
    /// Whether an upload is broken off after each of its chunks, with a restart of the device.
    pub interruptions: bool,
    /// Number of random bytes to send.
    pub garbage_bytes: usize,
    /// Number of frames on their way at a time: see [`decode_frames`](super::stream::decode_frames).
    /// A filter needs them one after the other, however many they are.
    pub window: usize,
    /// Settings of the filter in time that the device and the host pass outputs through.
    pub filter: Settings,
}

/// Findings of a check.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Findings {
    /// Identity of the device at the end, with the deepest use of its stack.
    pub device: DeviceIdentity,
    /// Counters of the device.
    pub statistics: Statistics,
    /// Findings about decoding.
    pub frames: FrameFindings,
    /// Findings about uploads, if any were asked for.
    pub uploads: Option<UploadFindings>,
    /// Findings about garbage, if any was asked for.
    pub garbage: Option<GarbageFindings>,
    /// Number of requests that were not answered in time and sent again.
    pub repeated: u64,
    /// Number of damaged frames of bytes from the device.
    pub damaged: u64,
}

impl Findings {
    /// Whether every finding is good. A request that had to be sent again, or a damaged report, is a
    /// fault of the line, and counts as bad.
    pub fn all_good(&self) -> bool {
        let frames = self.frames.bit_identical == self.frames.frames;
        let uploads = self.uploads.as_ref().is_none_or(|u| {
            u.good_came_into_force
                && u.damaged_refused == u.damaged
                && u.old_stayed == u.interrupted
        });
        let garbage = self
            .garbage
            .as_ref()
            .is_none_or(|g| g.decodes_as_before && g.requests_until_answer <= 2);
        frames && uploads && garbage && self.repeated == 0 && self.damaged == 0
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

/// Findings about garbage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GarbageFindings {
    /// Number of random bytes sent.
    pub bytes: usize,
    /// Number of requests until the device answered again: 1 or 2.
    pub requests_until_answer: u64,
    /// Whether it then decoded a frame bit for bit, by the same model.
    pub decodes_as_before: bool,
}

/// Compares `device` with the host on `frames`, whose baseline the device takes.
///
/// The model of `blob` is uploaded first if it is not active, and must be active at the end.
///
/// # Errors
/// [`Error`] if the device stops answering, or is not one for this model. Wrong results
/// are no error: they are in the findings.
pub fn check(
    device: &mut Device,
    frames: &Frames,
    blob: &ModelBlob,
    plan: &Plan,
    progress: &dyn Progress,
) -> Result<Findings> {
    device.while_paused(|device| check_paused(device, frames, blob, plan, progress))
}

fn check_paused(
    device: &mut Device,
    frames: &Frames,
    blob: &ModelBlob,
    plan: &Plan,
    progress: &dyn Progress,
) -> Result<Findings> {
    let exponential = prepare(device, blob, progress)?;

    let expected = Expected::new(blob, exponential, frames, plan.filter);
    let readings = &frames.readings;
    let frames = readings.len();
    let crc_32 = blob.parse().crc();
    let (bit_identical, time) = expected.count_same(device, frames, plan.window, progress)?;
    let frames =
        FrameFindings { frames, bit_identical, frames_per_s: frames as f64 / time.as_secs_f64() };
    // A restart resets the record of the deepest stack.
    let deepest_so_far = device.identify()?.memory.stack_high_water;
    let uploads = if plan.damaged_uploads > 0 || plan.interruptions {
        Some(check_uploads(device, readings, blob, &expected, plan, progress)?)
    } else {
        None
    };
    let garbage = if plan.garbage_bytes > 0 {
        Some(check_garbage(device, plan.seed, &expected, crc_32, plan.garbage_bytes, progress)?)
    } else {
        None
    };
    let mut identity = device.identify()?;
    let deepest = &mut identity.memory.stack_high_water;
    *deepest = deepest_so_far.max(*deepest);
    Ok(Findings {
        device: identity,
        statistics: device.statistics()?,
        frames,
        uploads,
        garbage,
        repeated: device.repeated,
        damaged: device.damaged,
    })
}

fn check_garbage(
    device: &mut Device,
    seed: u64,
    expected: &Expected,
    crc_32: u32,
    bytes: usize,
    progress: &dyn Progress,
) -> Result<GarbageFindings> {
    let mut random = Random::new(seed, Stream::Test, Purpose::Damage, 0, 1);
    progress.stage("sending garbage", 1);
    let garbage: Vec<u8> = (0..bytes).map(|_| random.below(256) as u8).collect();
    for part in garbage.chunks(1024) {
        device.send_raw(part)?;
    }
    // The first request may run into a frame that the garbage left open; the second may not.
    let [first, second] = [device.send(&Request::Identify)?, device.send(&Request::Identify)?];
    let answered = device.hear(Instant::now() + SWALLOWED, |number, report| match report {
        Report::Identity(_) if number == first => Some(1),
        Report::Identity(_) if number == second => Some(2),
        _ => None,
    })?;
    let requests_until_answer =
        answered.ok_or_else(|| Error::failed("after garbage the device answers no more"))?;
    let identity = device.identify()?;
    progress.step();
    let (same, _) = expected.count_same(device, 1, 1, &Silent)?;
    let in_force = identity.has_in_force(crc_32);
    Ok(GarbageFindings { bytes, requests_until_answer, decodes_as_before: in_force && same == 1 })
}

#[cfg(test)]
mod tests;
