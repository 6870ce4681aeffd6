//! The model in force: which slot it comes from, and whether the image has room for it.

use taxel_core::blob::{Columns, DecodeError, Model};
use taxel_core::checksum::CRC_32;
use taxel_core::track::Tracker;
use taxel_core::{Decoder, scratch_floats};

use crate::capacity::Capacity;
use crate::link::message::{ModelFault, ModelIdentity};
use crate::store::{ConfirmedModels, Slot, blob_in_slot};

/// The model in force, if there is one.
pub struct InForce<'a, const ROWS: usize> {
    pub decoder: Option<Decoder<'a, ROWS>>,
    pub tracker: Option<Tracker<'a>>,
    pub identity: Option<ModelIdentity>,
    /// Its blob, which the decoder borrows.
    pub blob: &'a [u8],
    /// The blob in its slot, if `blob` is a copy.
    pub stored: Option<&'a [u8]>,
}

impl<'a, const ROWS: usize> InForce<'a, ROWS> {
    pub const NONE: Self =
        Self { decoder: None, tracker: None, identity: None, blob: &[], stored: None };

    /// Puts the model in `bytes` in force, which start with its blob; `None` if it is not sound, or there is no room
    /// for it.
    // In place: a model that is returned is on the stack several times.
    pub fn load(
        &mut self,
        capacity: Capacity,
        bytes: &'a [u8],
        Candidate { slot, on_trial }: Candidate,
        in_ram: bool,
    ) -> Option<()> {
        let blob = blob_in_slot(bytes);
        let model = check(capacity, blob).ok()?;
        self.tracker = model.tracker();
        let decoder = Self::put(&mut self.decoder, model)?;
        let (shape, metadata) = (decoder.shape(), decoder.metadata());
        let identity = ModelIdentity {
            crc_32: decoder.model_crc(),
            slot: slot as u8,
            generation: 0,
            rows: shape.rows as u8,
            inputs: shape.inputs as u16,
            outputs: shape.outputs as u16,
            in_ram,
            scene_digest: metadata.scene_digest,
            inputs_crc_32: crc_of(metadata.input_names, metadata.input_units),
            outputs_crc_32: crc_of(metadata.output_names, metadata.output_units),
            on_trial,
        };
        (self.identity, self.blob) = (Some(identity), blob);
        Some(())
    }

    /// Makes a decoder of a model in its place.
    #[inline(never)] // so that a model is checked before this takes stack
    fn put<'d>(
        place: &'d mut Option<Decoder<'a, ROWS>>,
        model: Model<'a>,
    ) -> Option<&'d Decoder<'a, ROWS>> {
        Some(place.insert(Decoder::new(model).ok()?))
    }

    /// Name of the model's scene or data set, cut after [`MOST_NAME_BYTES`].
    pub fn name(&self) -> &str {
        let name = self.decoder.as_ref().map_or("", |decoder| decoder.metadata().name);
        let cut = (0..=MOST_NAME_BYTES.min(name.len())).rev().find_map(|end| name.get(..end));
        cut.unwrap_or_default()
    }

    /// Number of the slot that is not in force: 1 without a model.
    pub fn spare_slot(&self) -> usize {
        self.identity.map_or(1, |model| 1 - usize::from(model.slot.min(1)))
    }

    /// CRC-32 of the model in force, if it is sound in its slot.
    pub fn stored_crc(&self, capacity: Capacity) -> Option<u32> {
        Some(check(capacity, self.stored.unwrap_or(self.blob)).ok()?.crc())
    }
}

/// Longest name of a model in an identity, in bytes: every image has room for such a report.
const MOST_NAME_BYTES: usize = 40;

/// CRC-32 of the columns' `names` and then of their `units`.
fn crc_of(names: Columns<'_>, units: Columns<'_>) -> u32 {
    let mut digest = CRC_32.digest();
    digest.update(names.0.as_bytes());
    digest.update(units.0.as_bytes());
    digest.finalize()
}

/// Checks the `head` of a blob: that it is one, that there is more of it, and that the image has room for a model of its shape.
/// Returns the blob's length.
pub fn check_head(capacity: Capacity, head: &[u8]) -> Result<usize, ModelFault> {
    let (length, shape) = Model::declared(head).ok_or(ModelFault::NotABlob)?;
    if length <= Model::HEAD_BYTES {
        return Err(ModelFault::Length);
    }
    if capacity.has_room_for(shape) { Ok(length) } else { Err(ModelFault::Shape) }
}

/// Checks a blob from end to end, that the image has room for its model, and that the board has its wires.
pub fn check(capacity: Capacity, blob: &[u8]) -> Result<Model<'_>, ModelFault> {
    let model = Model::decode(blob).map_err(|error| fault(&error))?;
    let (shape, names) = (model.shape(), model.metadata().input_names);
    let room = scratch_floats(&model) <= capacity.scratch_floats();
    if !room || !capacity.has_room_for(shape) {
        return Err(ModelFault::Shape);
    }
    if capacity.cells(names, shape).any(|cell| cell.is_err()) {
        return Err(ModelFault::Wires);
    }
    Ok(model)
}

/// A slot whose model may come into force, if it is sound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Candidate {
    pub slot: usize,
    pub on_trial: bool,
}

/// The first of the `candidates` whose model is sound and has room.
pub fn choose<S: Slot>(
    capacity: Capacity,
    slots: &[S; 2],
    candidates: [Option<Candidate>; 3],
) -> Option<Candidate> {
    candidates.into_iter().flatten().find(|candidate| {
        let slot = slots.get(candidate.slot);
        slot.is_some_and(|slot| check(capacity, blob_in_slot(slot.bytes())).is_ok())
    })
}

/// The slots that may be in force, in the order in which they are tried: the one `on_trial`, and then those whose models
/// were `confirmed`.
pub fn candidates<S: Slot>(
    slots: &[S; 2],
    confirmed: &ConfirmedModels,
    on_trial: Option<usize>,
) -> [Option<Candidate>; 3] {
    let of_slot = |slot: usize| {
        let bytes = slots.get(slot)?.bytes();
        confirmed.has(slot, bytes).then_some(Candidate { slot, on_trial: false })
    };
    let tried = on_trial.map(|slot| Candidate { slot, on_trial: true });
    [tried, of_slot(confirmed.in_force), of_slot(1 - confirmed.in_force.min(1))]
}

/// Copies the blob at the start of `bytes` to `room`, if it fits; returns the copy.
pub fn copy_to<'r>(room: &'r mut [u32], bytes: &[u8]) -> Option<&'r [u8]> {
    let blob = blob_in_slot(bytes);
    let (words, last) = blob.as_chunks::<4>();
    let copy = room.get_mut(..words.len() + usize::from(!last.is_empty()))?;
    let mut padded = [0; 4];
    padded.iter_mut().zip(last).for_each(|(place, byte)| *place = *byte);
    for (place, word) in copy.iter_mut().zip(words.iter().chain([&padded])) {
        *place = u32::from_le_bytes(*word);
    }
    Some(bytemuck::cast_slice(copy).get(..blob.len()).unwrap_or_default())
}

/// The link's code for a fault of a model.
fn fault(error: &DecodeError) -> ModelFault {
    match error {
        DecodeError::BadMagic | DecodeError::UnsupportedVersion { .. } => ModelFault::NotABlob,
        DecodeError::Truncated { .. } | DecodeError::TrailingBytes { .. } => ModelFault::Length,
        DecodeError::Corrupt { .. } => ModelFault::Corrupt,
        DecodeError::TooManyRows { .. } => ModelFault::Shape,
        _ => ModelFault::Invalid,
    }
}
