//! Whether a device does what the host does, and survives what must not harm it.

use std::time::{Duration, Instant};

use firmware::link::message::{Refusal, Report, Request, Statistics, UploadState, UploadStep};
use model_core::checksum::CRC_32;
use serde::Serialize;

use super::scan::ScanFindings;
use super::{Device, DeviceIdentity, Wire, stream, upload};
use crate::dataset::Table;
use crate::error::{Error, Result};
use crate::infer::Kernel;
use crate::model::{self, LoadedModel, Origin};
use crate::progress::Progress;
use crate::random::{Purpose, Random, Stream};
use crate::scene::Scene;
use crate::synth;
use crate::train::{self, Options};

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

/// How uploads went.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UploadFindings {
    /// Bytes of the model that was uploaded again and again.
    pub blob_bytes: usize,
    /// Whether a good model came into force, and the old one again after it.
    pub good_came_into_force: bool,
    /// Damaged models.
    pub damaged: usize,
    /// Those after which the device refused, and the old model was still in force.
    pub damaged_refused: usize,
    /// Uploads broken off.
    pub interrupted: usize,
    /// Those after which, and after a restart, the old model was in force.
    pub old_stayed: usize,
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
    let identity = device.identify()?;
    let kernel = fitting_kernel(&identity, model)?;
    if identity.model.is_none_or(|found| found.crc_32 != model.model().crc()) {
        upload::replace(device, model.bytes(), progress)?;
    }

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

/// The kernel that the device decodes with, if it is a device for this model at all.
pub(super) fn fitting_kernel(identity: &DeviceIdentity, model: &LoadedModel) -> Result<Kernel> {
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

/// A small model of the right shape, quick to upload.
fn small_model(scene: &Scene, centres: usize) -> Result<LoadedModel> {
    let mut frames = synth::synthesise(scene, Stream::Training, 64);
    // Names would be most of it.
    for names in [&mut frames.inputs.names, &mut frames.outputs.names] {
        names.fill("x".into());
    }
    let options = Options::new(centres, scene.training.spread, false, scene.seed);
    let networks = train::train(&frames, &options, &Progress::silent())?;
    let blob = model::encode(&networks, &frames, &Origin::of_scene(scene))?;
    LoadedModel::from_bytes("small model".as_ref(), &blob)
}

fn check_uploads<W: Wire>(
    device: &mut Device<W>,
    scene: &Scene,
    model: &LoadedModel,
    expected: &Expected,
    plan: &Plan,
    progress: &Progress,
) -> Result<UploadFindings> {
    let chunk_bytes = device.identify()?.chunk_bytes;
    let (old, new) = (small_model(scene, 2)?, small_model(scene, 1)?);
    // First, while the model is where it was when the device started: an emulator that restarts puts
    // it there again, over whatever had been written to that slot, but not to the other.
    let (interrupted, old_stayed) = if plan.interruptions {
        break_uploads_off(device, new.bytes(), chunk_bytes, model.model().crc(), progress)?
    } else {
        (0, 0)
    };
    // `replace` fails unless the device then says that the model is in force.
    upload::replace(device, old.bytes(), progress)?;
    let in_force = old.model().crc();

    progress.stage("uploading damaged models", plan.damaged_uploads);
    let mut damaged_refused = 0;
    for index in 0..plan.damaged_uploads {
        let mut random = Random::new(scene.seed, Stream::Test, Purpose::Damage, index as u64, 0);
        let refused = upload_damaged(device, new.bytes(), chunk_bytes, index, &mut random)?;
        damaged_refused += usize::from(refused && has_in_force(device, in_force)?);
        progress.step();
    }
    upload::replace(device, model.bytes(), progress)?;
    let (same, _) = expected.count_same(device, 1, 1, &Progress::silent())?;
    Ok(UploadFindings {
        blob_bytes: new.bytes().len(),
        good_came_into_force: same == 1,
        damaged: plan.damaged_uploads,
        damaged_refused,
        interrupted,
        old_stayed,
    })
}

fn has_in_force<W: Wire>(device: &mut Device<W>, crc_32: u32) -> Result<bool> {
    Ok(device.identify()?.model.is_some_and(|found| found.crc_32 == crc_32))
}

/// Breaks an upload off before its first chunk and after each: how often, and how often the model of
/// `crc_32` was in force afterwards, and after a restart.
fn break_uploads_off<W: Wire>(
    device: &mut Device<W>,
    blob: &[u8],
    chunk_bytes: usize,
    crc_32: u32,
    progress: &Progress,
) -> Result<(usize, usize)> {
    let chunks: Vec<&[u8]> = blob.chunks(chunk_bytes).collect();
    progress.stage("breaking uploads off", chunks.len() + 1);
    let mut stayed = 0;
    for taken in 0..=chunks.len() {
        let length = blob.len() as u32;
        expect_receiving(upload::step(device, UploadStep::Begin { length })?)?;
        for (index, bytes) in chunks.iter().take(taken).enumerate() {
            let offset = (index * chunk_bytes) as u32;
            expect_receiving(upload::step(device, UploadStep::Chunk { offset, bytes })?)?;
        }
        let before = has_in_force(device, crc_32)?;
        device.restart()?;
        device.pause()?;
        stayed += usize::from(before && has_in_force(device, crc_32)?);
        progress.step();
    }
    Ok((chunks.len() + 1, stayed))
}

fn expect_receiving(answer: std::result::Result<UploadState, Refusal>) -> Result<()> {
    match answer {
        Ok(UploadState::Receiving { .. }) => Ok(()),
        other => {
            Err(Error::Failed(format!("the device answers a step of an upload with {other:?}")))
        }
    }
}

/// Ways in which an upload can be damaged.
const KINDS: usize = 7;

/// Uploads `blob` damaged in one of the ways that there are, in turn; whether the device refused it
/// in the end.
fn upload_damaged<W: Wire>(
    device: &mut Device<W>,
    blob: &[u8],
    chunk_bytes: usize,
    index: usize,
    random: &mut Random,
) -> Result<bool> {
    if index % KINDS == KINDS - 1 {
        return upload_with_a_chunk_lost(device, blob, chunk_bytes, random);
    }
    let damaged = damage(blob, index, random);
    let outcome = upload::send(device, &damaged, chunk_bytes, &Progress::silent())?;
    Ok(outcome.is_err())
}

/// `blob` with damage within.
fn damage(blob: &[u8], index: usize, random: &mut Random) -> Vec<u8> {
    let mut damaged = blob.to_vec();
    match index % KINDS {
        0 => damaged[random.below(blob.len())] ^= 1 << random.below(8),
        1 => {
            let start = random.below(blob.len() - 64);
            damaged[start..start + 64]
                .iter_mut()
                .for_each(|byte| *byte ^= 1 + random.below(255) as u8);
        }
        2 => damaged.truncate(4 * random.below(blob.len() / 4)),
        3 => damaged.extend([0; 4]),
        4 => {
            // Not a number, where a weight stood, under a CRC that says all is well.
            let start = blob.len() - 8 - 4 * random.below(64);
            damaged[start..start + 4].copy_from_slice(&f32::NAN.to_le_bytes());
            seal(&mut damaged);
        }
        _ => {
            // A number of the shape, under such a CRC.
            damaged[9 + random.below(5)] ^= 1 << random.below(7);
            seal(&mut damaged);
        }
    }
    damaged
}

/// Renews the closing CRC-32.
fn seal(blob: &mut [u8]) {
    if let Some((covered, crc)) = blob.split_last_chunk_mut::<4>() {
        *crc = CRC_32.checksum(covered).to_le_bytes();
    }
}

/// As a host would that does not look at answers: one chunk is damaged on the line, the rest follow.
fn upload_with_a_chunk_lost<W: Wire>(
    device: &mut Device<W>,
    blob: &[u8],
    chunk_bytes: usize,
    random: &mut Random,
) -> Result<bool> {
    expect_receiving(upload::step(device, UploadStep::Begin { length: blob.len() as u32 })?)?;
    let chunks: Vec<&[u8]> = blob.chunks(chunk_bytes).collect();
    let lost = random.below(chunks.len());
    for (index, bytes) in chunks.iter().enumerate() {
        let offset = (index * chunk_bytes) as u32;
        let chunk = UploadStep::Chunk { offset, bytes };
        if index == lost {
            let mut sent = super::request_bytes(1, &Request::Upload(chunk))?;
            let place = random.below(sent.len() - 1);
            sent[place] ^= 1 << random.below(8);
            sent.push(0); // the flip may have taken the end
            device.send_raw(&sent)?;
        } else if upload::step(device, chunk)?.is_ok() != (index < lost) {
            return Ok(false);
        }
    }
    Ok(upload::step(device, UploadStep::Commit)?.is_err())
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
    let in_force = identity.model.is_some_and(|found| found.crc_32 == model.model().crc());
    Ok(GarbageFindings { bytes, requests_until_answer, decodes_as_before: in_force && same == 1 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn good() -> Findings {
        let device = DeviceIdentity {
            board: "b".into(),
            firmware: "0".into(),
            rows: 1,
            columns: 1,
            outputs: 1,
            kernel: "libm".into(),
            model: None,
            slot_bytes: 0,
            chunk_bytes: 0,
            memory: firmware::link::message::Memory::default(),
        };
        let uploads = UploadFindings {
            blob_bytes: 1,
            good_came_into_force: true,
            damaged: 7,
            damaged_refused: 7,
            interrupted: 3,
            old_stayed: 3,
        };
        let garbage =
            GarbageFindings { bytes: 9, requests_until_answer: 2, decodes_as_before: true };
        Findings {
            device,
            statistics: Statistics::default(),
            frames: FrameFindings { frames: 5, bit_identical: 5, frames_per_s: 1.0 },
            scans: None,
            uploads: Some(uploads),
            garbage: Some(garbage),
            repeated: 0,
            damaged: 0,
        }
    }

    #[test]
    fn any_one_thing_wrong_is_not_all_good() {
        assert!(good().all_good());
        let spoilers: [fn(&mut Findings); 8] = [
            |f| f.frames.bit_identical = 4,
            |f| f.uploads.as_mut().unwrap().good_came_into_force = false,
            |f| f.uploads.as_mut().unwrap().damaged_refused = 6,
            |f| f.uploads.as_mut().unwrap().old_stayed = 2,
            |f| f.garbage.as_mut().unwrap().decodes_as_before = false,
            |f| f.garbage.as_mut().unwrap().requests_until_answer = 3,
            |f| f.repeated = 1,
            |f| f.damaged = 1,
        ];
        for (index, spoil) in spoilers.iter().enumerate() {
            let mut findings = good();
            spoil(&mut findings);
            assert!(!findings.all_good(), "{index}");
        }
    }

    #[test]
    fn one_bit_of_one_output_makes_a_frame_another() {
        let expected = Expected {
            readings_ohm: vec![60.0; 4],
            outputs: vec![0.5, -0.25, 0.0, 1.0],
            per_frame: [2, 2],
        };
        assert!(expected.is_same(1, [0.0, 1.0].into_iter()));
        let next = f32::from_bits(1.0_f32.to_bits() + 1);
        for wrong in [&[0.0, next][..], &[-0.0, 1.0], &[0.0], &[0.0, 1.0, 2.0], &[0.5, -0.25]] {
            assert!(!expected.is_same(1, wrong.iter().copied()), "{wrong:?}");
        }
        assert!(!expected.is_same(2, std::iter::empty()));
    }

    #[test]
    fn every_kind_of_damage_makes_a_blob_that_is_refused() {
        let scene = Scene::load("press").unwrap();
        let blob = small_model(&scene, 1).unwrap().bytes().to_vec();
        for index in (0..70).filter(|index| index % KINDS != KINDS - 1) {
            let mut random = Random::new(1, Stream::Test, Purpose::Damage, index as u64, 0);
            let damaged = damage(&blob, index, &mut random);
            assert_ne!(damaged, blob, "{index}");
            assert!(LoadedModel::from_bytes("damaged".as_ref(), &damaged).is_err(), "{index}");
        }
    }
}
