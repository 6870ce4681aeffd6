//! Every integration test in one program: it is linked once.

#[path = "../qemu/src/checks.rs"]
mod checks;
#[path = "../qemu/src/fixed.rs"]
mod fixed;

mod mock;

mod app;
mod bit_for_bit;
mod journal;
mod link_format;
mod power_cuts;
mod settings;
mod trial;
mod upload;
