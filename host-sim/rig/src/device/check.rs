//! Whether a device does what the host does, and survives what must not harm it.

use std::time::{Duration, Instant};

use firmware::link::message::{Report, Request, Statistics};
use serde::Serialize;
use taxel_data::progress::{Progress, Silent};
use taxel_data::random::{Purpose, Random, Stream};
use taxel_learn::ModelBlob;
use taxel_simulate::{World, synthesise};

use super::expected::{Expected, prepare};
use super::scan::ScanFindings;
use super::{Device, DeviceIdentity, Wire};
use crate::error::{Error, Result};

mod uploads;

pub use uploads::UploadFindings;
use uploads::check_uploads;

/// In this time a device has taken all that was sent to it, however slow it is.
const SWALLOWED: Duration = Duration::from_mins(2);

/// What is to be checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Frames to decode.
    pub frames: usize,
    /// Damaged models to upload.
    pub damaged_uploads: usize,
    /// Whether an upload is broken off after each of its chunks, with a restart of the device.
    pub interruptions: bool,
    /// Random bytes to send.
    pub garbage_bytes: usize,
    /// Frames on their way at a time: see [`stream::decode_frames`].
    pub window: usize,
}

/// What was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Findings {
    /// The device, at the end: its memory tells how deep the stack has been.
    pub device: DeviceIdentity,
    /// Its counters.
    pub statistics: Statistics,
    /// Decoding.
    pub frames: FrameFindings,
    /// Scans, if [they were checked](super::scan::check) as well.
    pub scans: Option<ScanFindings>,
    /// Uploads, if any were asked for.
    pub uploads: Option<UploadFindings>,
    /// Garbage, if any was asked for.
    pub garbage: Option<GarbageFindings>,
    /// Requests that were not answered in time and sent again.
    pub repeated: u64,
    /// Frames of bytes from the device that were damaged.
    pub damaged: u64,
}

impl Findings {
    /// Whether all is as it must be. A request that had to be sent again, or a damaged report, is a fault
    /// of the line, and counts.
    #[must_use]
    pub fn all_good(&self) -> bool {
        let frames = self.frames.bit_identical == self.frames.frames;
        let scans = self.scans.as_ref().is_none_or(ScanFindings::all_good);
        let uploads = self.uploads.as_ref().is_none_or(|u| {
            u.good_came_into_force
                && u.damaged_refused == u.damaged
                && u.old_stayed == u.interrupted
        });
        let garbage = self
            .garbage
            .as_ref()
            .is_none_or(|g| g.decodes_as_before && g.requests_until_answer <= 2);
        frames && scans && uploads && garbage && self.repeated == 0 && self.damaged == 0
    }
}

/// How frames were decoded.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrameFindings {
    /// Frames sent.
    pub frames: usize,
    /// Frames whose every output has the very bits that the host computes.
    pub bit_identical: usize,
    /// Frames a second, the line included.
    pub frames_per_s: f64,
}

/// How garbage went.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GarbageFindings {
    /// Random bytes.
    pub bytes: usize,
    /// Requests until the device answered again: 1 or 2.
    pub requests_until_answer: u64,
    /// Whether it then decoded a frame to the bit, by the same model.
    pub decodes_as_before: bool,
}

/// Holds `device` to the host: the model of `blob` must be in force when it is done, and is uploaded if it is not
/// now. Frames are those of `world`.
///
/// # Errors
/// The device stops answering, or is not one for this model; what is merely wrong is in the findings.
pub fn check<W: Wire>(
    device: &mut Device<W>,
    world: &World,
    blob: &ModelBlob,
    plan: &Plan,
    progress: &dyn Progress,
) -> Result<Findings> {
    device.while_paused(|device| check_paused(device, world, blob, plan, progress))
}

fn check_paused<W: Wire>(
    device: &mut Device<W>,
    world: &World,
    blob: &ModelBlob,
    plan: &Plan,
    progress: &dyn Progress,
) -> Result<Findings> {
    let exponential = prepare(device, blob, progress)?;

    let readings = synthesise(world, Stream::Test, plan.frames.max(1)).inputs;
    let model = blob.prepare(exponential);
    let expected = Expected::new(&model, &readings);
    let crc_32 = model.model().crc();
    let (bit_identical, time) = expected.count_same(device, plan.frames, plan.window, progress)?;
    let frames = FrameFindings {
        frames: plan.frames,
        bit_identical,
        frames_per_s: plan.frames as f64 / time.as_secs_f64(),
    };
    // A restart forgets how deep the stack has been.
    let deepest_so_far = device.identify()?.memory.stack_high_water;
    let uploads = if plan.damaged_uploads > 0 || plan.interruptions {
        Some(check_uploads(device, world, blob, &expected, plan, progress)?)
    } else {
        None
    };
    let garbage = if plan.garbage_bytes > 0 {
        Some(check_garbage(device, world.seed, &expected, crc_32, plan.garbage_bytes, progress)?)
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
        scans: None,
        uploads,
        garbage,
        repeated: device.repeated,
        damaged: device.damaged,
    })
}

fn check_garbage<W: Wire>(
    device: &mut Device<W>,
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
    // The first may run into a frame that the garbage left open; the second may not.
    let [first, second] = [device.send(&Request::Identify)?, device.send(&Request::Identify)?];
    let answered = device.hear(Instant::now() + SWALLOWED, |number, report| match report {
        Report::Identity(_) if number == first => Some(1),
        Report::Identity(_) if number == second => Some(2),
        _ => None,
    })?;
    let requests_until_answer =
        answered.ok_or_else(|| Error::Silent("after garbage the device answers no more".into()))?;
    let identity = device.identify()?;
    progress.step();
    let (same, _) = expected.count_same(device, 1, 1, &Silent)?;
    let in_force = identity.has_in_force(crc_32);
    Ok(GarbageFindings { bytes, requests_until_answer, decodes_as_before: in_force && same == 1 })
}

#[cfg(test)]
mod tests;
