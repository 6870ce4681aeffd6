//! Settings in two pages of flash.
//!
//! The pages are a map of `sequential-storage`: an item is added behind the last one, and the newest one counts.
//! When a page is full, the newest items move to the other page, and the full one is erased. Every item has a
//! CRC-32, so power that fails in the middle of any word leaves the old item or the new one. Pages that hold
//! something else, such as a part of an older program, count as empty.
//!
//! `sequential-storage` has functions that can panic: the compiler cannot prove that none of them does. So the link
//! check leaves this file out, and `tests/settings.rs` shows that whatever the pages hold does no harm.

use core::future::Future;
use core::pin::pin;
use core::task::{Context, Poll, Waker};

use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use model_core::checksum::CRC_32;
use sequential_storage::Error;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage, SerializationError, Value};

use super::{KeepError, Keeper};
use crate::link::message::Setting;
use crate::store::{FlashError, Slot};

/// Bytes of a page that are used, from its start. The time that moving the items takes grows with their square.
pub const PAGE_BYTES: usize = 8 * 1024;

/// Number of times that an item is written, each time at another place, until it is given up.
const ATTEMPTS: usize = 4;

/// Settings in two pages of flash, each of which is erased as a whole.
///
/// A page has at least [`PAGE_BYTES`]; if it is shorter, nothing can be kept.
pub struct SettingPages<S>([S; 2]);

/// The map in its pages.
type Map<'s, S> = MapStorage<u8, Pages<'s, S>, Cache<Uncached, Uncached, Uncached, u8>>;

impl<S: Slot> SettingPages<S> {
    /// Makes a keeper of these pages, whatever they hold.
    pub const fn new(pages: [S; 2]) -> Self {
        Self(pages)
    }

    /// The pages, for tests that inspect them.
    pub fn pages(&mut self) -> &mut [S; 2] {
        &mut self.0
    }

    /// The map, which takes the page number `hidden` for blank, if there is one.
    fn map(&mut self, hidden: Option<usize>) -> Map<'_, S> {
        let config = const { MapConfig::new(0..2 * PAGE_BYTES as u32) };
        MapStorage::new(Pages { slots: &mut self.0, hidden }, config, Cache::new_uncached())
    }

    /// Number of the page that was being erased at the end of an exchange when the power was cut, if it still counts as
    /// in use.
    ///
    /// Such a page may have any bits set. The map would take it for the one that is written to, or would move its items,
    /// damaged as they are, once more. Until an erase begins, no item of the new page differs from the old page's.
    fn left_over(&mut self, buffer: &mut [u8]) -> Option<usize> {
        let marks = self.0.each_ref().map(|page| {
            let bytes = page.bytes().get(..PAGE_BYTES).unwrap_or_default();
            (is_marked(bytes.first()), is_marked(bytes.last()))
        });
        if marks.iter().any(|(start, _)| !start) {
            return None;
        }
        let mut alone = |hidden| {
            Setting::ALL.map(|setting| {
                self.fetch(setting, Some(hidden), buffer).map(|bytes| CRC_32.checksum(bytes))
            })
        };
        let [first, second] = [alone(1), alone(0)];
        let differs = |old: &[Option<u32>; 3], new: &[Option<u32>; 3]| {
            old.iter().zip(new).any(|(old, new)| new.is_some() && old != new)
        };
        match marks {
            [_, (_, false)] if differs(&first, &second) => Some(0),
            [(_, false), _] if differs(&second, &first) => Some(1),
            _ => None,
        }
    }

    fn fetch<'b>(
        &mut self,
        setting: Setting,
        hidden: Option<usize>,
        buffer: &'b mut [u8],
    ) -> Option<&'b [u8]> {
        let mut map = self.map(hidden);
        let fetched = at_once(map.fetch_item::<&[u8]>(buffer, &(setting as u8)));
        fetched?.ok()?
    }

    fn store(
        &mut self,
        setting: Setting,
        parts: &[&[u8]],
        buffer: &mut [u8],
    ) -> Result<(), KeepError> {
        match at_once(self.map(None).store_item(buffer, &(setting as u8), &Parts(parts))) {
            Some(Ok(())) => Ok(()),
            Some(Err(Error::SerializationError(_) | Error::ItemTooBig | Error::FullStorage)) => {
                Err(KeepError::TooLarge)
            }
            _ => Err(KeepError::Failed),
        }
    }

    /// Erases pages that count as free without being blank, and one that is left over: something else left them, or an
    /// erase that was cut.
    fn blank_free_pages(&mut self, buffer: &mut [u8]) -> Result<(), KeepError> {
        let left_over = self.left_over(buffer);
        for (number, page) in self.0.iter_mut().enumerate() {
            let bytes = page.bytes().get(..PAGE_BYTES).ok_or(KeepError::Failed)?;
            let in_use = is_marked(bytes.first()) && left_over != Some(number);
            if !in_use && bytes.iter().any(|byte| *byte != 0xFF) {
                page.erase().map_err(|FlashError| KeepError::Failed)?;
            }
        }
        Ok(())
    }
}

impl<S: Slot> Keeper for SettingPages<S> {
    fn read<'b>(&mut self, setting: Setting, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
        let left_over = self.left_over(buffer);
        self.fetch(setting, left_over, buffer).filter(|bytes| !bytes.is_empty())
    }

    fn keep(
        &mut self,
        setting: Setting,
        parts: &[&[u8]],
        buffer: &mut [u8],
    ) -> Result<bool, KeepError> {
        let kept = self.read(setting, buffer).unwrap_or_default();
        if kept.iter().eq(parts.iter().copied().flatten()) {
            return Ok(false);
        }
        self.blank_free_pages(buffer)?;
        let mut stored = Err(KeepError::Failed);
        for _ in 0..ATTEMPTS {
            if stored == Err(KeepError::Failed) {
                stored = self.store(setting, parts, buffer); // behind an item that could not be written
            }
        }
        if stored == Err(KeepError::Failed)
            && Setting::ALL.iter().all(|setting| self.read(*setting, buffer).is_none())
        {
            // Nothing can be lost.
            at_once(self.map(None).erase_all()).and_then(Result::ok).ok_or(KeepError::Failed)?;
            stored = self.store(setting, parts, buffer);
        }
        stored.map(|()| true)
    }
}

/// Whether the byte of a mark counts as marked: half of its bits are programmed. `sequential-storage` says so.
fn is_marked(byte: Option<&u8>) -> bool {
    byte.is_some_and(|mark| mark.count_zeros() >= 4)
}

/// The output of `future`, which waits for nothing.
fn at_once<T>(future: impl Future<Output = T>) -> Option<T> {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(output) => Some(output),
        Poll::Pending => None,
    }
}

/// Parts of a setting, which are kept one after the other.
struct Parts<'a>(&'a [&'a [u8]]);

impl<'a> Value<'a> for Parts<'a> {
    fn serialize_into(&self, buffer: &mut [u8]) -> Result<usize, SerializationError> {
        let mut rest = &mut *buffer;
        let mut length = 0_usize;
        for part in self.0 {
            let (place, behind) = core::mem::take(&mut rest)
                .split_at_mut_checked(part.len())
                .ok_or(SerializationError::BufferTooSmall)?;
            place.copy_from_slice(part);
            rest = behind;
            length += part.len();
        }
        Ok(length)
    }

    fn deserialize_from(_: &'a [u8]) -> Result<(Self, usize), SerializationError> {
        Err(SerializationError::InvalidData) // settings are read as bytes
    }
}

/// Two pages, one behind the other, as flash for `sequential-storage`.
struct Pages<'s, S> {
    slots: &'s mut [S; 2],
    /// Number of a page that reads as blank.
    hidden: Option<usize>,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl<S> ErrorType for Pages<'_, S> {
    type Error = FlashError;
}

impl<S: Slot> ReadNorFlash for Pages<'_, S> {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        let (number, place) = place(offset);
        if self.hidden == Some(number) {
            bytes.fill(0xFF);
            return Ok(());
        }
        let page = self.slots.get(number).ok_or(FlashError)?;
        let source = page.bytes().get(place..).and_then(|rest| rest.get(..bytes.len()));
        source.map(|source| bytes.copy_from_slice(source)).ok_or(FlashError)
    }

    fn capacity(&self) -> usize {
        2 * PAGE_BYTES
    }
}

impl<S: Slot> NorFlash for Pages<'_, S> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = PAGE_BYTES;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        for (page, start) in self.slots.iter_mut().zip((0..).step_by(PAGE_BYTES)) {
            if (from..to).contains(&start) {
                page.erase()?;
            }
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let (page, place) = place(offset);
        self.slots.get_mut(page).ok_or(FlashError)?.write(place, bytes)
    }
}

/// Number of the page at `offset`, and the place in it.
fn place(offset: u32) -> (usize, usize) {
    let offset = offset as usize;
    (offset / PAGE_BYTES, offset % PAGE_BYTES)
}
