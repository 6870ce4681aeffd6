//! Whether a device does what the host does, and survives what must not harm it.

use std::time::{Duration, Instant};

use firmware::link::message::{Report, Request, Statistics};
use serde::Serialize;

use super::scan::ScanFindings;
use super::{Device, DeviceIdentity, Wire, stream, upload};
use crate::dataset::Table;
use crate::error::{Error, Result};
use crate::infer::Kernel;
use crate::model::LoadedModel;
use crate::progress::Progress;
use crate::random::{Purpose, Random, Stream};
use crate::scene::Scene;
use crate::synth;

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

/// A scene's frames with the answers that the host computes.
pub(super) struct Expected {
    readings_ohm: Vec<f32>,
    outputs: Vec<f32>,
    per_frame: [usize; 2],
}

impl Expected {
    pub(super) fn new(model: &LoadedModel, kernel: Kernel, readings: &Table) -> Self {
        let outputs = model.decode(kernel, readings);
        let f32s = |values: &[f64]| values.iter().map(|value| *value as f32).collect();
        Self {
            readings_ohm: f32s(&readings.values),
            outputs: f32s(&outputs.values),
            per_frame: [readings.names.len(), outputs.names.len()],
        }
    }

    fn first(&self, frames: usize) -> &[f32] {
        &self.readings_ohm[..frames * self.per_frame[0]]
    }

    /// Whether these are the readings of that frame.
    pub(super) fn was_read(&self, frame: u32, readings: impl Iterator<Item = f32>) -> bool {
        Self::is_line(&self.readings_ohm, frame, self.per_frame[0], readings)
    }

    /// Whether these are the outputs of that frame.
    pub(super) fn is_same(&self, frame: u32, outputs: impl Iterator<Item = f32>) -> bool {
        Self::is_line(&self.outputs, frame, self.per_frame[1], outputs)
    }

    fn is_line(all: &[f32], line: u32, width: usize, found: impl Iterator<Item = f32>) -> bool {
        let start = line as usize * width;
        all.get(start..start + width).is_some_and(|expected| {
            found.map(f32::to_bits).eq(expected.iter().map(|value| value.to_bits()))
        })
    }

    /// How many of the first `frames` the device decodes to the bit, and how long that took.
    fn count_same<W: Wire>(
        &self,
        device: &mut Device<W>,
        frames: usize,
        window: usize,
        progress: &Progress,
    ) -> Result<(usize, Duration)> {
        let mut same = 0;
        progress.stage("decoding on the device", frames);
        let time = stream::decode_frames(
            device,
            self.first(frames),
            self.per_frame[0],
            window,
            |frame, estimate| {
                same += usize::from(self.is_same(frame, estimate.outputs.iter()));
                progress.step();
            },
        )?;
        Ok((same, time))
    }
}

/// Holds `device` to the host: `model` must be in force when it is done, and is uploaded if it is not
/// now.
///
/// # Errors
/// [`Error::Failed`] if the device stops answering, [`Error::Usage`] if it is not one for this model;
/// what is merely wrong is in the findings.
pub fn check<W: Wire>(
    device: &mut Device<W>,
    scene: &Scene,
    model: &LoadedModel,
    plan: &Plan,
    progress: &Progress,
) -> Result<Findings> {
    device.while_paused(|device| check_paused(device, scene, model, plan, progress))
}

fn check_paused<W: Wire>(
    device: &mut Device<W>,
    scene: &Scene,
    model: &LoadedModel,
    plan: &Plan,
    progress: &Progress,
) -> Result<Findings> {
    let kernel = prepare(device, model, progress)?;

    let readings = synth::synthesise(scene, Stream::Test, plan.frames.max(1)).inputs;
    let expected = Expected::new(model, kernel, &readings);
    let (bit_identical, time) = expected.count_same(device, plan.frames, plan.window, progress)?;
    let frames = FrameFindings {
        frames: plan.frames,
        bit_identical,
        frames_per_s: plan.frames as f64 / time.as_secs_f64(),
    };
    // A restart forgets how deep the stack has been.
    let deepest_so_far = device.identify()?.memory.stack_high_water;
    let uploads = if plan.damaged_uploads > 0 || plan.interruptions {
        Some(check_uploads(device, scene, model, &expected, plan, progress)?)
    } else {
        None
    };
    let garbage = if plan.garbage_bytes > 0 {
        Some(check_garbage(device, scene.seed, &expected, model, plan.garbage_bytes, progress)?)
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

/// Puts `model` in force unless it is already; the kernel that the device decodes with.
pub(super) fn prepare<W: Wire>(
    device: &mut Device<W>,
    model: &LoadedModel,
    progress: &Progress,
) -> Result<Kernel> {
    let identity = device.identify()?;
    let kernel = fitting_kernel(&identity, model)?;
    if !identity.has_in_force(model.model().crc()) {
        upload::replace(device, model.bytes(), progress)?;
    }
    Ok(kernel)
}

/// The kernel that the device decodes with, if it is a device for this model at all.
fn fitting_kernel(identity: &DeviceIdentity, model: &LoadedModel) -> Result<Kernel> {
    let shape = model.model().shape();
    let found = [identity.rows, identity.columns, identity.outputs];
    let expected = [shape.rows, shape.inputs, shape.outputs];
    if found != expected {
        return Err(Error::Usage(format!(
            "the device is for {found:?} rows, columns and outputs a row, the model for {expected:?}"
        )));
    }
    Kernel::by_name(&identity.kernel)
        .ok_or_else(|| Error::Failed(format!("the device decodes with {:?}", identity.kernel)))
}

fn check_garbage<W: Wire>(
    device: &mut Device<W>,
    seed: u64,
    expected: &Expected,
    model: &LoadedModel,
    bytes: usize,
    progress: &Progress,
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
        answered.ok_or_else(|| Error::Failed("after garbage the device answers no more".into()))?;
    let identity = device.identify()?;
    progress.step();
    let (same, _) = expected.count_same(device, 1, 1, &Progress::silent())?;
    let in_force = identity.has_in_force(model.model().crc());
    Ok(GarbageFindings { bytes, requests_until_answer, decodes_as_before: in_force && same == 1 })
}

#[cfg(test)]
mod tests;
