//! Code shared by all images: use of memory, model slots, the application's buffers, and linker scripts.
//!
//! On the target, an image links this library; on a host, an image's build script calls it.
#![cfg_attr(target_os = "none", no_std)]

// From the ground up: a module imports only what is declared before it.
#[cfg(not(target_os = "none"))]
pub mod link_scripts;
#[cfg(target_os = "none")]
pub mod memory;
#[cfg(target_os = "none")]
pub mod region;

#[cfg(target_os = "none")]
use firmware::app::PaperBuffers;

/// Takes the application's buffers; `None` after the first call. A separate function builds them, so that its
/// stack is free again when the application runs.
#[cfg(target_os = "none")]
#[inline(never)]
#[must_use]
pub fn buffers() -> Option<&'static mut PaperBuffers> {
    cortex_m::singleton!(: PaperBuffers = PaperBuffers::new())
}
