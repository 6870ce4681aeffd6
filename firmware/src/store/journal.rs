//! A journal in two pages of flash: settings, and the models that were confirmed.
//!
//! One page is in use. Items are added behind the last one, and the newest item of a kind counts. When the page is
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
//!   highest number wins. There are two, since one may decay.
//! - A page is written only behind an erase that was not cut: weak bits may read as erased.
//! - So a start [recovers](Journal::recover). A page without a firm start item gets another one. What counts
//!   moves to the other page if the last item is not firm: nothing but a start item is ever added behind one. A page with
//!   a start item that does not count, but may do so at another start, is erased.

use taxel_core::checksum::CRC_32;

use super::{FlashError, Slot};
use crate::link::message::Setting;

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

/// Kind of a start item, whose content is its page's number.
const START: u8 = 0xFF;

/// Second word of a start item: its kind and length.
const START_HEAD: [u8; 4] = [START, 0, 4, 0];

/// Number of start items of a page.
const COPIES: usize = 2;

/// Bytes of a page that are left for start items, more than two behind cuts.
const ROOM: usize = 4 * CELL;

/// Number of times that an item is written, each time behind the last, until it is given up.
const ATTEMPTS: usize = 4;

/// Kind of an item.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The configuration at the start.
    Configuration,
    /// The circuit's constants at the start.
    Constants,
    /// The baseline at the start.
    Baseline,
    /// Which model is in force ([`ConfirmedModels`](super::ConfirmedModels)).
    Models,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Configuration, Self::Constants, Self::Baseline, Self::Models];
}

impl From<Setting> for Kind {
    fn from(setting: Setting) -> Self {
        match setting {
            Setting::Configuration => Self::Configuration,
            Setting::Constants => Self::Constants,
            Setting::Baseline => Self::Baseline,
        }
    }
}

/// Why something was not kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeepError {
    /// It is too large for a page.
    TooLarge,
    /// A page could not be erased or written.
    Failed,
}

/// A journal in two pages of flash, each of which is erased as a whole. It may be cut off from power at any moment: then
/// either the old or the new content is kept.
///
/// A page has at least [`PAGE_BYTES`]; if it is shorter, nothing can be kept.
#[derive(Clone)]
pub struct Journal<S>([S; 2]);

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
    /// Number of start items that are firm.
    starts: usize,
    /// Newest content of each kind.
    items: [&'p [u8]; Kind::ALL.len()],
    /// Whether the last item that counts is firm, and its end.
    is_firm: bool,
    end: usize,
}

impl<'p> Contents<'p> {
    /// Reads the page of these `bytes`; a page that is too short counts as empty.
    fn new(bytes: &'p [u8]) -> Self {
        let page = bytes.get(..PAGE_BYTES).unwrap_or_default();
        let mut contents =
            Self { number: None, starts: 0, items: [&[]; _], is_firm: false, end: 0 };
        let mut place = 0;
        while place < page.len() {
            let Some(item) = Item::at(page, place) else {
                place += CELL;
                continue;
            };
            if item.kind == START {
                contents.number = item.number();
                contents.starts += usize::from(item.is_firm);
            } else if let Some(newest) = contents.items.get_mut(usize::from(item.kind)) {
                *newest = item.content;
            }
            (contents.is_firm, contents.end) = (item.is_firm, item.end);
            place = item.end;
        }
        contents
    }

    /// Newest content of this `kind`.
    fn content(&self, kind: Kind) -> &'p [u8] {
        self.items.get(kind as usize).copied().unwrap_or_default()
    }
}

/// First place of a `page` behind everything that is not erased.
fn used(page: &[u8]) -> usize {
    let last = page.iter().take(PAGE_BYTES).rposition(|byte| *byte != 0xFF);
    last.map_or(0, |last| (last + 1).next_multiple_of(CELL))
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

impl<S: Slot> Journal<S> {
    /// Makes a journal of these pages, whatever they hold.
    pub const fn new(pages: [S; 2]) -> Self {
        Self(pages)
    }

    /// The pages, for tests that look at them, or damage them.
    pub fn pages(&mut self) -> &mut [S; 2] {
        &mut self.0
    }

    /// Index of the page in use, and what it holds.
    fn in_use(&self) -> Option<(usize, Contents<'_>)> {
        let [first, second] = self.0.each_ref().map(|page| Contents::new(page.bytes()));
        match (first.number, second.number) {
            (Some(one), Some(other)) if other.wrapping_sub(one).cast_signed() > 0 => {
                Some((1, second))
            }
            (Some(_), _) => Some((0, first)),
            (None, Some(_)) => Some((1, second)),
            (None, None) => None,
        }
    }

    /// The page of this `index`, and the other one.
    fn page_and_other(&mut self, index: usize) -> [&mut S; 2] {
        let [first, second] = &mut self.0;
        if index == 0 { [first, second] } else { [second, first] }
    }

    /// Recovers from a cut of the power: every later start reads what this one reads. Must be called at each
    /// start, before anything is read. Writes nothing if there was no cut. May take a second.
    ///
    /// # Errors
    /// [`KeepError::Failed`]; what is kept can still be read.
    pub fn recover(&mut self) -> Result<(), KeepError> {
        let Some((index, contents)) = self.in_use() else {
            let mut written = self.0.iter_mut().filter(|page| used(page.bytes()) > 0);
            return written.try_for_each(erase);
        };
        let is_started = contents.starts > 0;
        let (is_firm, end) = (contents.is_firm, contents.end);
        let has_copies = contents.starts >= COPIES;
        let number = contents.number.unwrap_or_default();
        let [active, other] = self.page_and_other(index);
        let is_whole = has_copies && is_firm && end >= used(active.bytes());
        if !is_started {
            // The other page may be the one that counts at the next start. So it stays until this one is firm.
            append(active, START, &[&number.to_le_bytes()])
        } else if !is_whole {
            self.exchange(index, None, &[])
        } else if is_older(other.bytes(), number) {
            Ok(())
        } else {
            erase(other)
        }
    }

    /// The bytes that are kept as `kind`; `None` if there are none.
    pub fn read(&self, kind: Kind) -> Option<&[u8]> {
        let (_, contents) = self.in_use()?;
        Some(contents.content(kind)).filter(|content| !content.is_empty())
    }

    /// Keeps `parts`, joined, as `kind`; no parts at all forget it. Nothing is written if these bytes are kept
    /// already. Returns whether something was written. May take a second.
    ///
    /// # Errors
    /// Every variant of [`KeepError`]; what was kept before is still kept, or `parts` are.
    pub fn keep(&mut self, kind: Kind, parts: &[&[u8]]) -> Result<bool, KeepError> {
        self.recover()?;
        let found = self.in_use();
        let kept = |kind| found.as_ref().map_or(&[][..], |(_, contents)| contents.content(kind));
        if kept(kind).iter().eq(parts.iter().copied().flatten()) {
            return Ok(false);
        }
        let new = parts.iter().map(|part| part.len()).sum();
        let lengths = Kind::ALL.map(|other| if other == kind { new } else { kept(other).len() });
        let bytes: usize = lengths.iter().map(|length| item_bytes(*length)).sum();
        if bytes + ROOM > PAGE_BYTES {
            return Err(KeepError::TooLarge);
        }
        let index = found.map(|(index, _)| index);
        if let Some(index) = index
            && append(self.page_and_other(index)[0], kind as u8, parts).is_ok()
        {
            return Ok(true);
        }
        self.exchange(index.unwrap_or_default(), Some(kind), parts).map(|()| true)
    }

    /// Moves what counts from the page of this `index` to the other one, with `parts` instead of what `changed` holds.
    fn exchange(
        &mut self,
        index: usize,
        changed: Option<Kind>,
        parts: &[&[u8]],
    ) -> Result<(), KeepError> {
        let [old, new] = self.page_and_other(index);
        let contents = Contents::new(old.bytes());
        erase(new)?;
        for kind in Kind::ALL {
            let content = contents.content(kind);
            if Some(kind) == changed {
                append(new, kind as u8, parts)?;
            } else if !content.is_empty() {
                append(new, kind as u8, &[content])?;
            }
        }
        let number = contents.number.unwrap_or_default().wrapping_add(1).to_le_bytes();
        append(new, START, &[&number])?;
        let _ = append(new, START, &[&number]); // a start moves the page again if it has only one
        Ok(())
    }
}
