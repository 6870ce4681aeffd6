//! Declaration of the workspace's structure: the one place to change when a crate is added.

/// Side for which a crate is: device or host.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The crate runs on a device, or is linked into an image that does.
    Device,
    /// The crate stands in for a device in tests of crates of the device. It runs on the host only.
    Mock,
    /// The crate runs on the host only.
    Host,
}

/// The workspace's crates from the ground up: each depends only on crates that stand before it.
pub const CRATES: &[(&str, Side)] = &[
    ("model-core", Side::Device),
    ("firmware", Side::Device),
    ("mock-board", Side::Mock),
    ("remote-readout", Side::Device),
    ("board-common", Side::Device),
    ("link-check", Side::Device),
    ("qemu-image", Side::Device),
    ("nucleo-f446re", Side::Device),
    ("taxel-data", Side::Host),
    ("taxel-simulate", Side::Host),
    ("taxel-learn", Side::Host),
    ("taxel-limit", Side::Host),
    ("taxel-rig", Side::Host),
    ("taxel-evaluate", Side::Host),
    ("host-sim", Side::Host),
    ("xtask", Side::Host),
];

/// Files in which `unsafe` may stand, and folders in whose files it may.
pub const UNSAFE: &[&str] = &[
    "model-core/src/confidence.rs",
    "model-core/src/cortex_m4/routines.rs",
    "model-core/src/gate.rs",
    "model-core/src/projection.rs",
    "model-core/src/rbf/expanded.rs",
    "model-core/src/rbf/fixed16.rs",
    "model-core/src/rbf/packed.rs",
    "firmware/board-common/src",
    "firmware/link-check/src",
    "firmware/nucleo-f446re/src",
    "firmware/qemu/src",
];

/// Crates whose modules are not in order yet.
pub const NOT_YET_IN_ORDER: &[&str] = &[];

/// The largest share of all lines of Rust that one crate may hold, in per cent.
pub const LARGEST_SHARE_PERCENT: f64 = 27.0;

/// Whether a larger share is a breach; else it is only printed.
pub const SHARES_MUST_HOLD: bool = true;
