//! Whether stdout was closed when the program began.
//!
//! Rust's runtime opens `/dev/null` in the place of a closed stdout, where an output would be lost without an error. So
//! this is looked at before the runtime begins.

#![cfg_attr(target_os = "linux", expect(unsafe_code, reason = "the loader's list of functions"))]

use std::sync::atomic::{AtomicBool, Ordering};

static WAS_CLOSED: AtomicBool = AtomicBool::new(false);

/// Whether stdout was closed when the program began, as far as that can be told.
pub fn was_closed() -> bool {
    WAS_CLOSED.load(Ordering::Relaxed)
}

// SAFETY: the loader calls each function in this section once, before `main` and with what C's `main` gets. It may
// ignore that; it starts no thread and uses nothing of the runtime that is not there yet.
#[cfg(target_os = "linux")]
#[used]
#[unsafe(link_section = ".init_array")]
static LOOK: extern "C" fn() = {
    extern "C" fn look() {
        let missing = |path| {
            let found = std::fs::symlink_metadata(path);
            found.is_err_and(|cause| cause.kind() == std::io::ErrorKind::NotFound)
        };
        WAS_CLOSED
            .store(!missing("/proc/self/fd") && missing("/proc/self/fd/1"), Ordering::Relaxed);
    }
    look
};
