//! Upload of models to a device.

use std::time::Duration;

use firmware::link::message::{Refusal, Report, Request, UploadState, UploadStep};
use model_core::blob::Model;
use taxel_data::progress::Progress;

use super::{Device, DeviceIdentity, Wire};
use crate::error::{Error, Result};

/// Longest time for erasing flash: a sector of 128 KiB takes up to 4 s on an STM32F4.
pub(super) const ERASE: Duration = Duration::from_secs(6);

/// Sends one step of an upload and returns the device's answer.
///
/// # Errors
/// [`Error::NoAnswer`] if there is none.
pub fn step<W: Wire>(
    device: &mut Device<W>,
    step: UploadStep<'_>,
) -> Result<std::result::Result<UploadState, Refusal>> {
    let timeout = if matches!(step, UploadStep::Begin { .. }) {
        ERASE.max(device.patience)
    } else {
        device.patience
    };
    device.ask(&Request::Upload(step), timeout, |report| match report {
        Report::Upload(state) => Some(*state),
        _ => None,
    })
}

/// First step of the upload of `blob`.
#[must_use]
pub fn begin(blob: &[u8]) -> UploadStep<'_> {
    UploadStep::Begin { head: &blob[..blob.len().min(Model::HEAD_BYTES)] }
}

/// Sends `blob` from beginning to commit, until the device refuses a step.
///
/// # Errors
/// [`Error::NoAnswer`] if the device stops answering, [`Error::ChunkSize`] if no chunk can be sent.
pub fn send<W: Wire>(
    device: &mut Device<W>,
    blob: &[u8],
    chunk_bytes: usize,
    progress: &dyn Progress,
) -> Result<std::result::Result<UploadState, Refusal>> {
    if chunk_bytes == 0 || !chunk_bytes.is_multiple_of(4) {
        return Err(Error::ChunkSize(chunk_bytes));
    }
    let chunks = blob.chunks(chunk_bytes);
    progress.stage("uploading the model", chunks.len());
    let mut answer = step(device, begin(blob))?;
    for (index, bytes) in chunks.enumerate() {
        if answer.is_err() {
            return Ok(answer);
        }
        let offset = (index * chunk_bytes) as u32;
        answer = step(device, UploadStep::Chunk { offset, bytes })?;
        progress.step();
    }
    if answer.is_err() { Ok(answer) } else { step(device, UploadStep::Commit) }
}

/// Uploads `blob`, makes it the active model, and checks that it is.
///
/// # Errors
/// [`Error`] if the device refuses it or has no room for it, or the work is interrupted before the last step; its
/// previous model then stays active.
pub fn replace<W: Wire>(
    device: &mut Device<W>,
    blob: &[u8],
    progress: &dyn Progress,
) -> Result<DeviceIdentity> {
    let identity = device.identify()?;
    let capacity = identity.capacity();
    if let Some((_, shape)) = Model::declared(blob)
        && capacity.wires_for(shape).is_none()
    {
        return Err(Error::NoRoom { capacity, shape });
    }
    let outcome = send(device, blob, identity.chunk_bytes, progress);
    if matches!(outcome, Err(Error::Interrupted)) {
        // The device has forgotten the upload when it resumes its work.
        let _ = device.uninterrupted(|device| step(device, UploadStep::Abort));
    }
    let crc_32 = match outcome?.map_err(Error::Refused)? {
        UploadState::Committed { crc_32 } => crc_32,
        other => {
            let (request, answer) = ("a commit".into(), format!("{other:?}"));
            return Err(Error::Unexpected { request, answer });
        }
    };
    let identity = device.identify()?;
    match identity.model {
        Some(model) if model.crc_32 == crc_32 => Ok(identity),
        other => Err(Error::NotInForce { committed: crc_32, in_force: format!("{other:?}") }),
    }
}
