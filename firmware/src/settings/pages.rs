//! Settings in two pages of flash.
//!
//! One page is in use. Items are added behind the last one, and the newest item of a setting counts. When the page is
//! full, the other page is erased, and the newest items are written there.
//!
//! An item begins at a multiple of [`CELL`] bytes. Its words, in the order in which they are written: a mark, what it
//! is and its length, the content, a CRC-32, and a word of zeros. They tell what a cut of the power has left, however
//! often a weak bit changes its mind:
//!
//! - An item counts if its CRC-32 is right.
//! - The word of zeros is begun only when the item is whole. Without it, a last item may be weak, so that it counts at
//!   one start and not at the next.
//! - A page is in use from its start item on, which is written behind the items that were moved. The start item with the
//!   highest number wins.
//! - A page is written only behind an erase that was not cut: weak bits may read as erased.
//! - So a start [recovers](Keeper::recover). A start item that is not firm gets another one. What counts
//!   moves to the other page if the last item is not firm: nothing but a start item is ever added behind one. A page with
//!   a start item that does not count, but may do so at another start, is erased.

use model_core::checksum::CRC_32;

use super::{KeepError, Keeper};
use crate::link::message::Setting;
use crate::store::{FlashError, Slot};

/// Bytes of a page that are used, from its start.
pub const PAGE_BYTES: usize = 8 * 1024;

/// Items begin at multiples of so many bytes. A start item must fit in: then what is added behind a weak one touches none
/// of its words.
const CELL: usize = 32;

/// First word of an item.
const MARK: [u8; 4] = *b"ITEM";

/// Last word of an item.
const FIRM: [u8; 4] = [0; 4];

/// Bytes of an item besides its content: mark, kind and length, CRC-32, and the word of zeros.
const FRAME_BYTES: usize = 16;

/// Kind of a start item, whose content is its page's number. Other kinds are those of [`Setting`].
const START: u8 = 0xFF;

/// Second word of a start item: its kind and length.
const START_HEAD: [u8; 4] = [START, 0, 4, 0];

/// Bytes of a page that are left for start items. It has two, since one may decay, and more behind cuts.
const ROOM_FOR_STARTS: usize = 4 * CELL;

/// Number of times that an item is written, each time behind the last, until it is given up.
const ATTEMPTS: usize = 4;

/// Settings in two pages of flash, each of which is erased as a whole.
///
/// A page has at least [`PAGE_BYTES`]; if it is shorter, nothing can be kept.
pub struct SettingPages<S>([S; 2]);

/// An item that counts.
struct Item<'p> {
    kind: u8,
    content: &'p [u8],
    /// Whether it was whole before its word of zeros was begun.
    is_firm: bool,
    /// Place of the next item.
    end: usize,
}

impl<'p> Item<'p> {
    /// The item at `place` in a page.
    fn at(page: &'p [u8], place: usize) -> Option<Self> {
        let rest = page.get(place..)?.strip_prefix(&MARK)?;
        let (head, rest) = rest.split_first_chunk::<4>()?;
        let [kind, _, low, high] = *head;
        let length = usize::from(u16::from_le_bytes([low, high]));
        let content = rest.get(..length)?;
        let (crc, rest) = rest.get(padded(length)..)?.split_first_chunk::<4>()?;
        let (last, _) = rest.split_first_chunk::<4>()?;
        let mut digest = CRC_32.digest();
        digest.update(head);
        digest.update(content);
        let is_right = digest.finalize().to_le_bytes() == *crc;
        let end = place + item_bytes(length);
        is_right.then_some(Self { kind, content, is_firm: *last != [0xFF; 4], end })
    }

    /// The page's number in a start item.
    fn number(&self) -> Option<u32> {
        self.content.first_chunk().map(|number| u32::from_le_bytes(*number))
    }
}

/// `length` in whole words.
const fn padded(length: usize) -> usize {
    length.next_multiple_of(4)
}

/// Bytes that an item takes of a page, for content of this `length`.
const fn item_bytes(length: usize) -> usize {
    (FRAME_BYTES + padded(length)).next_multiple_of(CELL)
}

/// What a page holds.
#[derive(Clone, Copy)]
struct Contents<'p> {
    /// Number of the page, if it is or was in use: each has a higher one than the page before it.
    number: Option<u32>,
    /// Whether a start item is firm.
    is_started: bool,
    /// Newest content of each setting.
    settings: [Option<&'p [u8]>; Setting::ALL.len()],
    /// First place behind everything that is not erased.
    end: usize,
    /// Whether a firm item is the last.
    is_firm: bool,
}

impl<'p> Contents<'p> {
    /// Reads the page of these `bytes`; a page that is too short counts as empty.
    fn new(bytes: &'p [u8]) -> Self {
        let page = bytes.get(..PAGE_BYTES).unwrap_or_default();
        let mut contents =
            Self { number: None, is_started: false, settings: [None; _], end: 0, is_firm: false };
        let (mut place, mut end_of_items) = (0, 0);
        while place < page.len() {
            let Some(item) = Item::at(page, place) else {
                place += CELL;
                continue;
            };
            if item.kind == START {
                contents.number = item.number();
                contents.is_started |= item.is_firm;
            } else if let Some(newest) = contents.settings.get_mut(usize::from(item.kind)) {
                *newest = Some(item.content);
            }
            contents.is_firm = item.is_firm;
            (place, end_of_items) = (item.end, item.end);
        }
        contents.end = used(page);
        contents.is_firm &= end_of_items >= contents.end;
        contents
    }

    /// Newest content of `setting`.
    fn content(&self, setting: Setting) -> &'p [u8] {
        self.settings.get(setting as usize).copied().flatten().unwrap_or_default()
    }
}

/// First place of a `page` behind everything that is not erased.
fn used(page: &[u8]) -> usize {
    let last = page.iter().take(PAGE_BYTES).rposition(|byte| *byte != 0xFF);
    last.map_or(0, |last| (last + 1).next_multiple_of(CELL))
}

/// Index of the page in use, and what it holds.
fn in_use<S: Slot>(pages: &[S; 2]) -> Option<(usize, Contents<'_>)> {
    let [first, second] = pages.each_ref().map(|page| Contents::new(page.bytes()));
    match (first.number, second.number) {
        (Some(one), Some(other)) if other.wrapping_sub(one).cast_signed() > 0 => Some((1, second)),
        (Some(_), _) => Some((0, first)),
        (None, Some(_)) => Some((1, second)),
        (None, None) => None,
    }
}

/// Adds an item of `parts`, joined, to a page.
fn append<S: Slot>(page: &mut S, kind: u8, parts: &[&[u8]]) -> Result<(), KeepError> {
    for _ in 0..ATTEMPTS {
        let place = used(page.bytes());
        let length: usize = parts.iter().map(|part| part.len()).sum();
        if place + item_bytes(length) > PAGE_BYTES {
            break;
        }
        if write(page, place, kind, length, parts).is_ok() {
            return Ok(());
        }
    }
    Err(KeepError::Failed)
}

/// Writes an item of `length` bytes to `place`.
fn write<S: Slot>(
    page: &mut S,
    place: usize,
    kind: u8,
    length: usize,
    parts: &[&[u8]],
) -> Result<(), FlashError> {
    let [low, high, ..] = length.to_le_bytes();
    let head = [kind, 0, low, high];
    let mut digest = CRC_32.digest();
    digest.update(&head);
    parts.iter().for_each(|part| digest.update(part));
    page.write(place, &MARK)?;
    page.write(place + 4, &head)?;
    let mut bytes = parts.iter().copied().flatten();
    let mut place = place + 8;
    for _ in 0..padded(length) / 4 {
        let mut word = [0xFF; 4];
        word.iter_mut().zip(bytes.by_ref()).for_each(|(to, from)| *to = *from);
        page.write(place, &word)?;
        place += 4;
    }
    page.write(place, &digest.finalize().to_le_bytes())?;
    page.write(place + 4, &FIRM)
}

/// Whether a start item may be at `place`, even if it does not count now. Its head is whole if its CRC-32 is begun, but its
/// mark may be weak: it is overwritten before an erase.
fn may_start(page: &[u8], place: usize) -> bool {
    page.get(place + 4..).is_some_and(|rest| rest.starts_with(&START_HEAD))
}

/// Whether a page can never win against the one with this `number`.
fn is_older(page: &[u8], number: u32) -> bool {
    let mut starts = (0..PAGE_BYTES).step_by(CELL).filter(|place| may_start(page, *place));
    starts.all(|place| {
        let other = Item::at(page, place).and_then(|item| item.number());
        other.is_some_and(|other| number.wrapping_sub(other).cast_signed() > 0)
    })
}

/// Erases a page.
///
/// Its start items are overwritten before. They must not count again if the erase is cut, when other items are damaged.
fn erase<S: Slot>(page: &mut S) -> Result<(), KeepError> {
    for place in (0..PAGE_BYTES).step_by(CELL) {
        if may_start(page.bytes(), place) {
            let _ = page.write(place, &[0; 4]); // where that fails, the erase may not
        }
    }
    page.erase().map_err(|FlashError| KeepError::Failed)
}

impl<S: Slot> SettingPages<S> {
    /// Makes a keeper of these pages, whatever they hold.
    pub const fn new(pages: [S; 2]) -> Self {
        Self(pages)
    }

    /// The pages, for tests that inspect them.
    pub fn pages(&mut self) -> &mut [S; 2] {
        &mut self.0
    }

    /// The page of this `index`, and the other one.
    fn page_and_other(&mut self, index: usize) -> [&mut S; 2] {
        let [first, second] = &mut self.0;
        if index == 0 { [first, second] } else { [second, first] }
    }

    /// Moves what counts from the page of this `index` to the other one, with `parts` instead of what `changed` holds.
    fn exchange(
        &mut self,
        index: usize,
        changed: Option<Setting>,
        parts: &[&[u8]],
    ) -> Result<(), KeepError> {
        let [old, new] = self.page_and_other(index);
        erase(new)?;
        let contents = Contents::new(old.bytes());
        for setting in Setting::ALL {
            let content = contents.content(setting);
            if Some(setting) == changed {
                append(new, setting as u8, parts)?;
            } else if !content.is_empty() {
                append(new, setting as u8, &[content])?;
            }
        }
        let number = contents.number.unwrap_or_default().wrapping_add(1).to_le_bytes();
        append(new, START, &[&number])?;
        let _ = append(new, START, &[&number]); // in case that the first one decays
        Ok(())
    }
}

impl<S: Slot> Keeper for SettingPages<S> {
    fn recover(&mut self) -> Result<(), KeepError> {
        let Some((index, contents)) = in_use(&self.0) else {
            let mut written = self.0.iter_mut().filter(|page| used(page.bytes()) > 0);
            return written.try_for_each(erase);
        };
        let (is_started, is_firm) = (contents.is_started, contents.is_firm);
        let number = contents.number.unwrap_or_default();
        let [active, other] = self.page_and_other(index);
        if !is_started {
            // The other page may be the one that counts at the next start. So it stays until this one is firm.
            append(active, START, &[&number.to_le_bytes()])
        } else if !is_firm {
            self.exchange(index, None, &[])
        } else if is_older(other.bytes(), number) {
            Ok(())
        } else {
            erase(other)
        }
    }

    fn read<'b>(&mut self, setting: Setting, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
        let (_, contents) = in_use(&self.0)?;
        let content = contents.content(setting);
        let place = buffer.get_mut(..content.len())?;
        place.copy_from_slice(content);
        (!content.is_empty()).then_some(place)
    }

    fn keep(&mut self, setting: Setting, parts: &[&[u8]]) -> Result<bool, KeepError> {
        self.recover()?;
        let found = in_use(&self.0);
        let contents = found.as_ref().map(|(_, contents)| contents);
        let kept = |setting| contents.map_or(&[][..], |contents| contents.content(setting));
        if kept(setting).iter().eq(parts.iter().copied().flatten()) {
            return Ok(false);
        }
        let others = Setting::ALL.iter().filter(|other| **other != setting);
        let mut bytes: usize = others.map(|other| item_bytes(kept(*other).len())).sum();
        bytes += item_bytes(parts.iter().map(|part| part.len()).sum());
        if bytes + ROOM_FOR_STARTS > PAGE_BYTES {
            return Err(KeepError::TooLarge);
        }
        let index = found.map(|(index, _)| index);
        if let Some(index) = index
            && append(self.page_and_other(index)[0], setting as u8, parts).is_ok()
        {
            return Ok(true);
        }
        self.exchange(index.unwrap_or_default(), Some(setting), parts).map(|()| true)
    }
}
