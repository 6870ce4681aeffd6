//! Check of uploads: damaged and interrupted ones must not become active, and a good one must.

use serde::Serialize;
use taxel_core::checksum::CRC_32;
use taxel_data::{Dataset, Progress, Purpose, Random, Silent, Stream, Table};
use taxel_firmware::link::message::{Refusal, Request, UploadState, UploadStep};
use taxel_learn::train::train;
use taxel_learn::{Exponential, ModelBlob, Options, Origin, pack};

use super::Plan;
use crate::device::expected::Expected;
use crate::device::{Device, request_bytes, upload};
use crate::error::{Error, Result};

/// Findings about uploads.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UploadFindings {
    /// Size in bytes of the model that was uploaded again and again.
    pub blob_bytes: usize,
    /// Whether a good model became active, and then the previous one again.
    pub good_came_into_force: bool,
    /// Number of damaged models uploaded.
    pub damaged: usize,
    /// Number of damaged models that the device refused, with the previous model still active.
    pub damaged_refused: usize,
    /// Number of uploads broken off.
    pub interrupted: usize,
    /// Number of these after which, also after a restart, the previous model was active.
    pub old_stayed: usize,
}

/// Name of the small models.
const SMALL: &str = "small";

/// Small model of `model`'s shape, quick to upload. It learns what `model` makes of `readings`.
fn small_model(
    model: &ModelBlob,
    readings: &Table,
    centres: usize,
    seed: u64,
) -> Result<ModelBlob> {
    let rows = model.parse().shape().rows;
    let few = readings.cycled(64);
    let outputs = model.prepare(Exponential::default()).of_inputs().decode_table(&few);
    let mut frames =
        Dataset { inputs: few, outputs, rows, common_span: false, relative_inputs: false };
    // Long names would be most of the blob. Those of readings tell their wires.
    frames.outputs.names.fill("x".into());
    let options = Options { centres, affine_tail: false, seed, ..Options::default() };
    let trained = train(&frames, &options, &Silent)?;
    Ok(pack(&trained, &frames, &Origin::of_data(SMALL, 0, seed, &frames))?)
}

pub(super) fn check_uploads(
    device: &mut Device,
    readings: &Table,
    model: &ModelBlob,
    expected: &Expected,
    plan: &Plan,
    progress: &dyn Progress,
) -> Result<UploadFindings> {
    let chunk_bytes = device.identify()?.chunk_bytes;
    let small = |centres| small_model(model, readings, centres, plan.seed);
    let (old, new) = (small(2)?, small(1)?);
    // Interruptions come first, while the model is where it was when the device started. An emulator
    // that restarts puts it there again, over whatever had been written to that slot, but not to the
    // other.
    let (interrupted, old_stayed) = if plan.interruptions {
        break_uploads_off(device, new.bytes(), chunk_bytes, model.parse().crc(), progress)?
    } else {
        (0, 0)
    };
    // `replace` fails unless the device then reports the model as active.
    upload::replace(device, old.bytes(), progress)?;
    let in_force = old.parse().crc();

    progress.stage("uploading damaged models", plan.damaged_uploads);
    let mut damaged_refused = 0;
    for index in 0..plan.damaged_uploads {
        let mut random = Random::new(plan.seed, Stream::Test, Purpose::Damage, index as u64, 0);
        let refused = upload_damaged(device, new.bytes(), chunk_bytes, index, &mut random)?;
        damaged_refused += usize::from(refused && device.identify()?.has_in_force(in_force));
        progress.step();
    }
    upload::replace(device, model.bytes(), progress)?;
    let (same, _) = expected.count_same(device, 1, 1, &Silent)?;
    Ok(UploadFindings {
        blob_bytes: new.bytes().len(),
        good_came_into_force: same == 1,
        damaged: plan.damaged_uploads,
        damaged_refused,
        interrupted,
        old_stayed,
    })
}

/// Breaks an upload off before its first chunk, after each, and on trial. Returns how often, and how often the
/// model with CRC-32 `crc_32` was active afterwards (unless another one is on trial) and after a restart.
fn break_uploads_off(
    device: &mut Device,
    blob: &[u8],
    chunk_bytes: usize,
    crc_32: u32,
    progress: &dyn Progress,
) -> Result<(usize, usize)> {
    let chunks: Vec<&[u8]> = blob.chunks(chunk_bytes).collect();
    progress.stage("breaking uploads off", chunks.len() + 2);
    let mut stayed = 0;
    for taken in 0..=chunks.len() + 1 {
        expect_receiving(upload::step(device, upload::begin(blob))?)?;
        for (index, bytes) in chunks.iter().take(taken).enumerate() {
            let offset = (index * chunk_bytes) as u32;
            expect_receiving(upload::step(device, UploadStep::Chunk { offset, bytes })?)?;
        }
        let is_tried = taken > chunks.len();
        if is_tried {
            upload::step(device, UploadStep::Try { lease_ms: 60_000 })?.map_err(Error::Refused)?;
        }
        let before = device.identify()?.has_in_force(crc_32) != is_tried;
        device.restart()?;
        device.pause()?;
        stayed += usize::from(before && device.identify()?.has_in_force(crc_32));
        progress.step();
    }
    Ok((chunks.len() + 2, stayed))
}

fn expect_receiving(answer: std::result::Result<UploadState, Refusal>) -> Result<()> {
    match answer {
        Ok(UploadState::Receiving { .. }) => Ok(()),
        other => {
            let (request, answer) = ("a step of an upload".into(), format!("{other:?}"));
            Err(Error::Unexpected { request, answer })
        }
    }
}

/// Number of ways in which an upload is damaged.
const KINDS: usize = 7;

/// Uploads `blob` damaged in one of these ways, in turn, and returns whether the device refused it in
/// the end.
fn upload_damaged(
    device: &mut Device,
    blob: &[u8],
    chunk_bytes: usize,
    index: usize,
    random: &mut Random,
) -> Result<bool> {
    if index % KINDS == KINDS - 1 {
        return upload_with_a_chunk_lost(device, blob, chunk_bytes, random);
    }
    let damaged = damage(blob, index, random);
    let outcome = upload::send(device, &damaged, chunk_bytes, &Silent)?;
    Ok(outcome.is_err())
}

/// Copy of `blob` with damage within.
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
            // A weight that is not a number, under a correct CRC.
            let start = blob.len() - 8 - 4 * random.below(64);
            damaged[start..start + 4].copy_from_slice(&f32::NAN.to_le_bytes());
            seal(&mut damaged);
        }
        _ => {
            // A wrong number in the shape, under a correct CRC.
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

/// Uploads with one damaged chunk, like a host that does not look at answers and sends the rest.
fn upload_with_a_chunk_lost(
    device: &mut Device,
    blob: &[u8],
    chunk_bytes: usize,
    random: &mut Random,
) -> Result<bool> {
    expect_receiving(upload::step(device, upload::begin(blob))?)?;
    let chunks: Vec<&[u8]> = blob.chunks(chunk_bytes).collect();
    let lost = random.below(chunks.len());
    for (index, bytes) in chunks.iter().enumerate() {
        let offset = (index * chunk_bytes) as u32;
        let chunk = UploadStep::Chunk { offset, bytes };
        if index == lost {
            let mut sent = request_bytes(1, &Request::Upload(chunk))?;
            let place = random.below(sent.len() - 1);
            sent[place] ^= 1 << random.below(8);
            sent.push(0); // the flip may have taken the end
            device.send_raw(&sent)?;
        } else if upload::step(device, chunk)?.is_ok() != (index < lost) {
            return Ok(false);
        }
    }
    Ok(upload::step(device, UploadStep::Try { lease_ms: 60_000 })?.is_err())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_damage_makes_a_blob_that_is_refused() {
        let frames =
            taxel_simulate::synthesise(&taxel_simulate::World::press(), Stream::Training, 64);
        let options = Options { centres: 1, affine_tail: false, ..Options::default() };
        let trained = train(&frames, &options, &Silent).unwrap();
        let packed = pack(&trained, &frames, &Origin::of_data(SMALL, 0, 1, &frames)).unwrap();
        let blob = small_model(&packed, &frames.inputs, 1, 1).unwrap().bytes().to_vec();
        for index in (0..70).filter(|index| index % KINDS != KINDS - 1) {
            let mut random = Random::new(1, Stream::Test, Purpose::Damage, index as u64, 0);
            let damaged = damage(&blob, index, &mut random);
            assert_ne!(damaged, blob, "{index}");
            assert!(ModelBlob::of_bytes(&damaged).is_err(), "{index}");
        }
    }
}
