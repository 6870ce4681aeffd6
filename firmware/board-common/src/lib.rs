//! What the images share: where memory goes, where models lie, the application's buffers, and, for their
//! build scripts, the linker's scripts.
//!
//! On the target the library is what an image links; on a host it is what an image's build script calls.
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

/// The application's buffers, once. They are put together in a function of its own, whose stack is free again
/// when the application runs.
#[cfg(target_os = "none")]
#[inline(never)]
#[must_use]
pub fn buffers() -> Option<&'static mut PaperBuffers> {
    cortex_m::singleton!(: PaperBuffers = PaperBuffers::new())
}
