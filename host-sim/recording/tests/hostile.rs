//! Any bytes are read in bounded memory or refused, without a panic.

#[path = "all/common.rs"]
mod common;

use std::alloc::{GlobalAlloc, Layout as Size, System};
use std::io::Cursor;
use std::sync::atomic::{AtomicUsize, Ordering};

use common::{assert_same, electrodes, frames, recording};
use taxel_recording::{Error, Frame, Reader, mend};

/// Counts the bytes that are in use, and the most that were.
struct Counting;

static USED: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

#[expect(unsafe_code)]
// SAFETY: every call goes to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, size: Size) -> *mut u8 {
        let used = USED.fetch_add(size.size(), Ordering::Relaxed) + size.size();
        MOST.fetch_max(used, Ordering::Relaxed);
        // SAFETY: as its caller promised.
        unsafe { System.alloc(size) }
    }

    unsafe fn dealloc(&self, at: *mut u8, size: Size) {
        USED.fetch_sub(size.size(), Ordering::Relaxed);
        // SAFETY: as its caller promised.
        unsafe { System.dealloc(at, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const MOST_BYTES: usize = 64 << 20;

/// Reads all that there is, seeks, and mends, in bounded memory.
fn read_all(bytes: &[u8]) -> Result<Vec<Frame>, Error> {
    let before = USED.load(Ordering::Relaxed);
    MOST.store(before, Ordering::Relaxed);
    let outcome = read_and_mend(bytes);
    let most = MOST.load(Ordering::Relaxed) - before;
    assert!(most < MOST_BYTES, "{most} bytes were in use");
    outcome
}

fn read_and_mend(bytes: &[u8]) -> Result<Vec<Frame>, Error> {
    let mut reader = Reader::new(Cursor::new(bytes))?;
    let _ = reader.extras();
    let read: Vec<Frame> = reader.by_ref().filter_map(Result::ok).collect();
    reader.seek(reader.duration() / 2)?;
    reader.by_ref().for_each(drop);
    if reader.was_cut() {
        let mut mended = vec![];
        mend(&mut reader, &mut mended)?;
        assert!(!Reader::new(Cursor::new(mended))?.was_cut());
    }
    Ok(read)
}

#[test]
fn hostile_bytes_do_no_harm() {
    let layout = electrodes();
    let written = frames(&layout, 12);
    let whole = recording(&layout, &written);
    assert_same(&read_all(&whole).unwrap(), &written);
    let mut state = 7_u64;
    let mut below = |bound: usize| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % bound
    };

    // Places that are tried: one of so many, or each where `TAXEL_CASES` is set.
    let [of_bits, of_lengths] =
        if std::env::var_os("TAXEL_CASES").is_some() { [1, 1] } else { [7, 17] };

    // A bit is flipped: its chunk is left out, or what it tells is refused. Frames that come are those that were written,
    // if the bit was in a chunk.
    let chunks = whole.windows(15).position(|it| it == b"/taxel/readings").unwrap();
    for at in (0..whole.len()).step_by(of_bits) {
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << below(8);
        if let Ok(read) = read_all(&bytes)
            && (chunks..chunks + 1000).contains(&at)
        {
            assert_same(&read, &written[written.len() - read.len()..]);
        }
    }

    // A length is huge, wherever there may be one.
    for at in (8..whole.len() - 8).step_by(of_lengths) {
        for length in [u64::MAX, u64::MAX / 2, 1 << 40, 1 << 31, 1 << 25, 0] {
            let mut bytes = whole.clone();
            bytes[at..at + 8].copy_from_slice(&length.to_le_bytes());
            let _ = read_all(&bytes);
        }
    }

    // Bytes are missing, or stand twice.
    for _ in 0..600 {
        let mut bytes = whole.clone();
        let from = below(bytes.len());
        let to = from + below(bytes.len() - from);
        let part = bytes[from..to].to_vec();
        let at = below(bytes.len());
        if below(2) == 0 {
            bytes.drain(from..to);
        } else {
            bytes.splice(at..at, part);
        }
        let _ = read_all(&bytes);
    }

    // Large parts, each of which would be allowed or not, in a file that has their bytes.
    for (kind, megabytes) in [(6, 9_u64), (6, 7), (12, 40), (9, 40), (3, 40)] {
        let mut bytes = whole[..8].to_vec();
        bytes.push(kind);
        bytes.extend((megabytes << 20).to_le_bytes());
        bytes.resize(bytes.len() + ((megabytes as usize) << 20), 0);
        bytes.extend(&whole[8..]);
        let _ = read_all(&bytes);
    }
}
