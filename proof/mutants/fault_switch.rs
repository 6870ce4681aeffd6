//! The switch of all planted faults, for the copy of the source that `cargo xtask mutants` builds.

use std::io::Write;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};
use std::{env, fs::OpenOptions};

const UNREAD: u32 = u32::MAX;
const TRACE: u32 = u32::MAX - 1;
static CHOSEN: AtomicU32 = AtomicU32::new(UNREAD);
static REACHED: [AtomicBool; 4096] = [const { AtomicBool::new(false) }; 4096];

/// Whether this fault is on: the environment variable `TAXEL_FAULT` has its number.
///
/// If `TAXEL_FAULT_TRACE` names a file, no fault is on, and the numbers of the faults that are reached are added to it.
#[inline(always)]
#[must_use]
pub fn on(fault: u32) -> bool {
    let chosen = CHOSEN.load(Relaxed);
    if chosen < TRACE { chosen == fault } else { look(fault) }
}

#[cold]
#[inline(never)]
fn look(fault: u32) -> bool {
    if CHOSEN.load(Relaxed) == UNREAD {
        let chosen = env::var("TAXEL_FAULT").ok().and_then(|text| text.parse().ok()).unwrap_or(0);
        let trace = env::var_os("TAXEL_FAULT_TRACE").is_some();
        CHOSEN.store(if trace { TRACE } else { chosen }, Relaxed);
        return on(fault);
    }
    if !REACHED[fault as usize].swap(true, Relaxed) {
        let file = env::var_os("TAXEL_FAULT_TRACE").unwrap_or_default();
        let file = OpenOptions::new().append(true).create(true).open(file);
        let written = file.and_then(|mut file| file.write_all(format!("{fault}\n").as_bytes()));
        assert!(written.is_ok(), "the trace of faults cannot be written: {written:?}");
    }
    false
}
