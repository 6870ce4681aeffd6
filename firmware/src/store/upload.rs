//! Upload of a blob in chunks.

use super::{ERASES_AT_ONCE, FlashError, Slot};
use crate::link::message::{Refusal, UploadState};

/// State of an upload, whose bytes are in the spare slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Upload {
    state: UploadState,
    /// Announced length of the blob in bytes.
    length: usize,
    /// Whether the spare slot was erased for an upload, and no chunk was written since.
    is_empty: bool,
    /// Time in µs until which the erases so far last, each for [`Slot::erase_interval_s`].
    worn_until_us: u64,
}

impl Default for Upload {
    fn default() -> Self {
        Self::new()
    }
}

impl Upload {
    /// Makes a state in which no upload is going on.
    pub const fn new() -> Self {
        Self { state: UploadState::Idle, length: 0, is_empty: false, worn_until_us: 0 }
    }

    /// Progress of the upload.
    pub fn state(&self) -> UploadState {
        self.state
    }

    /// Prepares `spare` for a blob of `length` bytes at the time `now_us` since the start. The slot is erased unless it
    /// still is from the last begin.
    ///
    /// Calls `prepare` just before an erase. It must write down that no model of the slot counts any more.
    ///
    /// # Errors
    /// [`Refusal::TooLarge`] if the blob does not fit, [`Refusal::TooSoon`] after too many erases,
    /// [`Refusal::Flash`] if erasing or preparing fails.
    pub fn begin<S: Slot>(
        &mut self,
        spare: &mut S,
        length: usize,
        now_us: u64,
        prepare: impl FnOnce() -> Result<(), FlashError>,
    ) -> Result<(), Refusal> {
        let slot_bytes = spare.bytes().len();
        if length > slot_bytes {
            return Err(Refusal::TooLarge { slot_bytes: slot_bytes as u32 });
        }
        if !self.is_empty {
            self.wear(now_us, spare.erase_interval_s())?;
            let erased = prepare().and_then(|()| spare.erase());
            self.flash(erased)?;
        }
        self.is_empty = true;
        (self.state, self.length) = (UploadState::Receiving { received: 0 }, length);
        Ok(())
    }

    /// Takes note of an erase, unless there were too many: more than [`ERASES_AT_ONCE`] beyond one in each interval.
    fn wear(&mut self, now_us: u64, interval_s: u32) -> Result<(), Refusal> {
        let interval_us = u64::from(interval_s) * 1_000_000;
        let worn_until_us = self.worn_until_us.max(now_us) + interval_us;
        let allowed_us = now_us + u64::from(ERASES_AT_ONCE) * interval_us;
        if worn_until_us > allowed_us {
            return Err(Refusal::TooSoon { wait_us: worn_until_us - allowed_us });
        }
        self.worn_until_us = worn_until_us;
        Ok(())
    }

    /// Writes the next chunk to `spare`. Bytes that were received before are skipped.
    ///
    /// # Errors
    /// [`Refusal::NoUpload`] without a begin, [`Refusal::OutOfPlace`] for a chunk that leaves a gap or does not
    /// fit, [`Refusal::Flash`] if writing fails.
    pub fn chunk<S: Slot>(
        &mut self,
        spare: &mut S,
        offset: u32,
        bytes: &[u8],
    ) -> Result<(), Refusal> {
        let UploadState::Receiving { received } = self.state else {
            return Err(Refusal::NoUpload);
        };
        let (offset, here) = (offset as usize, received as usize);
        let end = offset.saturating_add(bytes.len());
        if end <= here {
            return Ok(());
        }
        let whole_words = end.is_multiple_of(4) || end == self.length;
        if offset != here || end > self.length || !whole_words {
            return Err(Refusal::OutOfPlace { received });
        }
        self.is_empty = false;
        let (words, last) = bytes.as_chunks::<4>();
        let mut written = spare.write(offset, words.as_flattened());
        if !last.is_empty() {
            let mut padded = [0xFF; 4];
            padded.iter_mut().zip(last).for_each(|(place, byte)| *place = *byte);
            let place = offset.saturating_add(bytes.len() - last.len());
            written = written.and_then(|()| spare.write(place, &padded));
        }
        self.flash(written)?;
        self.state = UploadState::Receiving { received: end as u32 };
        Ok(())
    }

    /// The blob in `spare`, once all its bytes are there.
    ///
    /// # Errors
    /// [`Refusal::NoUpload`] without a begin, [`Refusal::OutOfPlace`] while bytes are missing.
    pub fn complete<'s, S: Slot>(&self, spare: &'s S) -> Result<&'s [u8], Refusal> {
        let UploadState::Receiving { received } = self.state else {
            return Err(Refusal::NoUpload);
        };
        let whole = (received as usize == self.length).then(|| spare.bytes().get(..self.length));
        whole.flatten().ok_or(Refusal::OutOfPlace { received })
    }

    /// Notes that the blob, which must have been found sound, is on trial.
    pub fn begin_trial(&mut self, crc_32: u32) {
        self.state = UploadState::OnTrial { crc_32 };
    }

    /// Notes that the trial was not confirmed in time.
    pub fn end_late_trial(&mut self) {
        if let UploadState::OnTrial { crc_32 } = self.state {
            self.state = UploadState::TrialOver { crc_32 };
        }
    }

    /// Notes that the blob on trial is confirmed.
    pub fn confirm(&mut self, crc_32: u32) {
        self.state = UploadState::Confirmed { crc_32 };
    }

    /// Ends the upload, and forgets the bytes received.
    pub fn abort(&mut self) {
        self.state = UploadState::Idle;
    }

    /// Converts an outcome of the flash; a failure ends the upload.
    fn flash(&mut self, outcome: Result<(), FlashError>) -> Result<(), Refusal> {
        outcome.map_err(|FlashError| {
            self.abort();
            Refusal::Flash
        })
    }
}
