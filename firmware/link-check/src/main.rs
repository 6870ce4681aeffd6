//! Proves that no panic is reachable from what a device calls: the program for the target has a
//! panic handler that calls a function which nobody defines, so it links only if the optimiser
//! has removed every panic. `cargo xtask firmware` builds it twice, as it stands and with the
//! feature `must-fail`, which adds a reachable panic: a check that cannot fail proves nothing.
//!
//! The program is never run. To find a panic that it reports, link nevertheless, with
//! `cargo rustc … -- -C link-arg=--unresolved-symbols=ignore-all`, and disassemble: what branches to
//! a function of `core::panicking` is its source.
#![cfg_attr(target_os = "none", no_std, no_main)]

// From the ground up: a module imports only what is declared before it.
#[cfg(target_os = "none")]
mod opaque;
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
