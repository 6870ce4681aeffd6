//! Upload of models to a device.

use std::time::{Duration, Instant};

use taxel_core::blob::{Floats, Model, ModelShape};
use taxel_data::Progress;
use taxel_firmware::link::message::{
    EstimateReport, Refusal, Report, Request, UploadState, UploadStep,
};

use super::{Device, DeviceIdentity, WRITING};
use crate::error::{Error, Result, check_room, no_room};

/// Longest time for erasing flash: a sector of 128 KiB takes up to 4 s on an STM32F4.
const ERASE: Duration = Duration::from_secs(6);

/// Time in ms that a trial lasts unless it is confirmed: longer than [`see_frames`] takes.
const TRIAL_MS: u32 = 60_000;

/// Longest time between scans that is waited for.
const SLOWEST_SCANS: Duration = Duration::from_secs(5);
/// Reading in Ω that no configuration is likely to find faulty.
const ANY_OHM: f32 = 60.0;

/// Sends one step of an upload and returns the device's answer.
pub fn step(
    device: &mut Device,
    step: UploadStep<'_>,
) -> Result<std::result::Result<UploadState, Refusal>> {
    let least = match step {
        UploadStep::Begin { .. } => ERASE,
        UploadStep::Confirm => WRITING,
        _ => Duration::ZERO,
    };
    let timeout = device.patience.max(least);
    device.ask(&Request::Upload(step), timeout, |report| match report {
        Report::Upload(state) => Some(*state),
        _ => None,
    })
}

/// First step of the upload of `blob`.
pub fn begin(blob: &[u8]) -> UploadStep<'_> {
    UploadStep::Begin { head: &blob[..blob.len().min(Model::HEAD_BYTES)] }
}

/// Sends `blob` and puts it on trial, until the device refuses a step. A trial that is going on ends.
///
/// # Errors
/// [`Error::NoAnswer`] if the device stops answering, and a failure if no chunk can be sent.
pub fn send(
    device: &mut Device,
    blob: &[u8],
    chunk_bytes: usize,
    progress: &dyn Progress,
) -> Result<std::result::Result<UploadState, Refusal>> {
    if chunk_bytes == 0 || !chunk_bytes.is_multiple_of(4) {
        return Err(Error::failed(format!(
            "the device offers chunks of {chunk_bytes} bytes; they must be a positive multiple of 4"
        )));
    }
    let chunks = blob.chunks(chunk_bytes);
    progress.stage("uploading the model", chunks.len());
    let mut answer = step(device, begin(blob))?;
    if answer == Err(Refusal::OnTrial) {
        step(device, UploadStep::Abort)?.map_err(Error::Refused)?;
        answer = step(device, begin(blob))?;
    }
    for (index, bytes) in chunks.enumerate() {
        if answer.is_err() {
            return Ok(answer);
        }
        let offset = (index * chunk_bytes) as u32;
        answer = step(device, UploadStep::Chunk { offset, bytes })?;
        progress.step();
    }
    if answer.is_err() { Ok(answer) } else { step(device, UploadStep::Try { trial_ms: TRIAL_MS }) }
}

/// Uploads `blob` and makes it the active model, on trial, and checks that the device decodes with it. Until
/// [`confirm`] a restart brings the previous model back.
///
/// # Errors
/// [`Error`] if the device refuses it, has no room for it or does not decode with it, or the work is interrupted; its
/// previous model is then active again.
pub fn start_trial(
    device: &mut Device,
    blob: &[u8],
    progress: &dyn Progress,
) -> Result<DeviceIdentity> {
    let identity = device.identify()?;
    let capacity = identity.capacity();
    if let Ok(model) = Model::decode(blob) {
        check_room(capacity, &model)?;
    } else if let Some((_, shape)) = Model::declared(blob)
        && !capacity.has_room_for(shape)
    {
        let ModelShape { rows, inputs, outputs } = shape;
        let needs = format!("{rows} rows of {inputs} readings and {outputs} outputs");
        return Err(no_room(capacity, &format!("which says that it has {needs}: check its file")));
    }
    or_abort(device, |device| {
        let outcome = send(device, blob, identity.chunk_bytes, progress)?;
        let crc_32 = match outcome.map_err(Error::Refused)? {
            UploadState::OnTrial { crc_32 } => crc_32,
            other => return Err(unexpected("a trial", other)),
        };
        see_estimate(device, crc_32)
    })
}

/// Runs `work` on an upload. If it is interrupted, or the device does not decode with the model, the device leaves the
/// model.
fn or_abort<T>(device: &mut Device, work: impl FnOnce(&mut Device) -> Result<T>) -> Result<T> {
    let outcome = work(device);
    let abort = Error::is_settled_by_abort;
    if outcome.as_ref().is_err_and(abort) {
        // The device has forgotten the upload when it resumes its work.
        let _ = device.uninterrupted(|device| step(device, UploadStep::Abort));
    }
    outcome
}

/// Checks that the model with this CRC-32 is active, and that the device decodes a frame with it.
fn see_estimate(device: &mut Device, crc_32: u32) -> Result<DeviceIdentity> {
    let identity = device.identify()?;
    if !identity.has_in_force(crc_32) {
        let in_force = format!("{:08x?}", identity.model.map(|model| model.crc_32));
        return Err(Error::NotInForce { committed: crc_32, in_force });
    }
    let frame = vec![ANY_OHM; identity.readings()];
    let request = Request::Decode { frame: 0, start_us: 0, readings_ohm: Floats::new(&frame) };
    let flags = device.ask_plainly(&request, |report| match report {
        Report::Estimate(estimate) => Some(estimate.flags),
        _ => None,
    })?;
    if flags & EstimateReport::NO_MODEL != 0 {
        return Err(Error::NotDecoding("it decodes no frame with the new model".into()));
    }
    Ok(identity)
}

/// Waits until the device, by its own configuration, has scanned and decoded two frames. Ends at once if it does not
/// scan, or less often than every five seconds.
///
/// # Errors
/// [`Error::NotDecoding`] if no frames come, and errors of [`ask`](Device::ask); the device has then left a model on
/// trial.
pub fn see_frames(device: &mut Device) -> Result<()> {
    or_abort(device, |device| {
        let period_us = device.configuration()?.frame_period_us;
        let period = Duration::from_micros(period_us.into());
        if period_us == 0 || period > SLOWEST_SCANS {
            return Ok(());
        }
        let deadline = Instant::now() + 2 * period + SLOWEST_SCANS;
        let before = device.statistics()?.frames_decoded;
        while device.statistics()?.frames_decoded.wrapping_sub(before) < 2 {
            if Instant::now() > deadline {
                return Err(Error::NotDecoding("it scans no frames with the new model".into()));
            }
            // Looking on all the time would keep a slow line busy.
            std::thread::sleep(period.min(Duration::from_millis(50)));
        }
        Ok(())
    })
}

/// Lets the trial that is going on last for so many `minutes` from now on.
pub fn prolong_trial(device: &mut Device, minutes: u32) -> Result<()> {
    let again = UploadStep::Try { trial_ms: 60_000 * minutes };
    match step(device, again)?.map_err(Error::Refused)? {
        UploadState::OnTrial { .. } => Ok(()),
        other => Err(unexpected("a longer trial", other)),
    }
}

/// Confirms the model on trial, so that it stays active over restarts.
pub fn confirm(device: &mut Device) -> Result<DeviceIdentity> {
    match step(device, UploadStep::Confirm)?.map_err(Error::Refused)? {
        UploadState::Confirmed { crc_32 } => {
            let identity = device.identify()?;
            match identity.model {
                Some(model) if model.crc_32 == crc_32 && !model.on_trial => Ok(identity),
                other => {
                    Err(Error::NotInForce { committed: crc_32, in_force: format!("{other:?}") })
                }
            }
        }
        other => Err(unexpected("a confirmation", other)),
    }
}

/// Puts the model before the active one in its place again, over restarts as well; returns its CRC-32.
///
/// # Errors
/// [`Error::Refused`] if there is none; errors of [`ask`](Device::ask).
pub fn undo(device: &mut Device) -> Result<u32> {
    let active = device.identify()?.model.ok_or(Error::Refused(Refusal::NothingToUndo))?;
    let request = Request::Undo { crc_32: active.crc_32 };
    let answer = device.ask(&request, device.patience.max(WRITING), |report| match report {
        Report::Upload(state) => Some(*state),
        _ => None,
    })?;
    match answer.map_err(Error::Refused)? {
        UploadState::Confirmed { crc_32 } => Ok(crc_32),
        other => Err(unexpected("an undo", other)),
    }
}

/// Uploads `blob`, makes it the active model, checks that the device decodes with it, and confirms it.
pub fn replace(
    device: &mut Device,
    blob: &[u8],
    progress: &dyn Progress,
) -> Result<DeviceIdentity> {
    start_trial(device, blob, progress)?;
    or_abort(device, confirm)
}

fn unexpected(request: &str, answer: UploadState) -> Error {
    Error::Unexpected { request: request.into(), answer: format!("{answer:?}") }
}

#[cfg(test)]
pub(super) mod tests;
