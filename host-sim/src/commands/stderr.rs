//! What is said on stderr beside errors and warnings of bad use: remarks, and details for those who ask.

use std::fmt::Display;
use std::sync::atomic::{AtomicU8, Ordering};

use super::captured;

const QUIET: u8 = 0;
const USUAL: u8 = 1;
const VERBOSE: u8 = 2;

static LEVEL: AtomicU8 = AtomicU8::new(USUAL);

/// Sets how much is said from now on (`--quiet`, `--verbose`).
pub fn set(quiet: bool, verbose: bool) {
    let level = match (quiet, verbose) {
        (true, _) => QUIET,
        (_, true) => VERBOSE,
        _ => USUAL,
    };
    LEVEL.store(level, Ordering::Relaxed);
}

pub fn is_quiet() -> bool {
    LEVEL.load(Ordering::Relaxed) == QUIET
}

pub fn is_verbose() -> bool {
    LEVEL.load(Ordering::Relaxed) == VERBOSE
}

/// Says `text` on a line, unless it is to be quiet.
pub fn remark(text: impl Display) {
    let text = text.to_string();
    if !captured::keep_remark(&text) && !is_quiet() {
        eprintln!("{text}");
    }
}
