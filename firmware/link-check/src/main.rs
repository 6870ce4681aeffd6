//! Proof by linking that no panic is reachable from any function that a device calls.
//!
//! The program's panic handler calls a function that is defined nowhere, so the program links only if the
//! optimiser has removed every panic. `cargo xtask firmware` builds it twice: as it is, and with the feature
//! `must-fail`, which adds a reachable panic, because a check that cannot fail proves nothing.
//!
//! The program is never run. To find a panic that it reports, link anyway with
//! `cargo rustc … -- -C link-arg=--unresolved-symbols=ignore-all`, and disassemble: code that branches to
//! a function of `core::panicking` is the source.
#![cfg_attr(target_os = "none", no_std, no_main)]

// From the ground up: a module imports only what is declared before it.
#[cfg(target_os = "none")]
mod opaque;
#[cfg(target_os = "none")]
#[path = "../../examples/minimal.rs"]
mod minimal;
#[cfg(target_os = "none")]
mod readout;
#[cfg(target_os = "none")]
mod application;
#[cfg(target_os = "none")]
mod device;

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("a link check for Cortex-M: run `cargo xtask firmware`");
}
