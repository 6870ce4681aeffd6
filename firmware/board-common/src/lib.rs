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
use firmware::app::{App, Buffers};
#[cfg(target_os = "none")]
use firmware::capacity::Capacity;

/// What the image has room for: the paper's sensor, unless `TAXEL_CAPACITY` says otherwise when it is built, such as
/// `TAXEL_CAPACITY=16x32x18` for 16 rows, 32 columns and 18 outputs a row.
#[cfg(target_os = "none")]
pub const CAPACITY: Capacity = match option_env!("TAXEL_CAPACITY") {
    Some(text) => Capacity::parse(text),
    None => Capacity::PAPER,
};

/// Number of MCP3208 converters that sample all columns.
#[cfg(target_os = "none")]
pub const CONVERTERS: usize = CAPACITY.columns.div_ceil(8);

/// The application with room for [`CAPACITY`].
#[cfg(target_os = "none")]
pub type BoardApp<P, F> = App<'static, P, F, { CAPACITY.rows }>;

/// The application's buffers.
#[cfg(target_os = "none")]
pub type BoardBuffers = Buffers<
    { CAPACITY.rows },
    { CAPACITY.columns },
    { CAPACITY.outputs },
    { CAPACITY.message_bytes() },
>;

/// Takes the application's buffers; `None` after the first call. A separate function builds them, so that its
/// stack is free again when the application runs.
#[cfg(target_os = "none")]
#[inline(never)]
#[must_use]
pub fn buffers() -> Option<&'static mut BoardBuffers> {
    cortex_m::singleton!(: BoardBuffers = BoardBuffers::new())
}
