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
use core::cell::UnsafeCell;
#[cfg(target_os = "none")]
use core::sync::atomic::{AtomicBool, Ordering};

#[cfg(target_os = "none")]
use taxel_firmware::app::{App, Buffers};
#[cfg(target_os = "none")]
use taxel_firmware::capacity::Capacity;

/// What the image has room for: the paper's sensor, unless `TAXEL_CAPACITY` says otherwise when it is built, such as
/// `TAXEL_CAPACITY=16x18x18` for 16 rows, 18 columns and 18 outputs a row.
#[cfg(target_os = "none")]
pub const CAPACITY: Capacity = match option_env!("TAXEL_CAPACITY") {
    Some(text) => Capacity::parse(text),
    None => Capacity::PAPER,
};

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

#[cfg(target_os = "none")]
struct Place(UnsafeCell<BoardBuffers>);

#[cfg(target_os = "none")]
// SAFETY: only `buffers` uses the place, and lends it once.
unsafe impl Sync for Place {}

/// Takes the application's buffers; `None` after the first call. They are zero at first, so that they need neither
/// flash nor stack.
#[cfg(target_os = "none")]
pub fn buffers() -> Option<&'static mut BoardBuffers> {
    static BUFFERS: Place = Place(UnsafeCell::new(BoardBuffers::new()));
    static TAKEN: AtomicBool = AtomicBool::new(false);
    let first = !TAKEN.swap(true, Ordering::Relaxed);
    // SAFETY: this is reached once, so no other reference exists.
    first.then(|| unsafe { &mut *BUFFERS.0.get() })
}
