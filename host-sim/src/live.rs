//! A sensor watched live: frames from a device, a simulation or a recording, decoded where nobody has, for whoever shows or records
//! them.
//!
//! A [`Feed`](feed::Feed) brings frames; [`watch`](watch::watch) shows them. Modules stand from the ground up; each imports only
//! what is declared before it.

pub mod moment;
pub mod sheet;
mod contact;
mod touch;
pub mod decode;
pub mod feed;
pub mod device;
pub mod simulation;
pub mod replay;
mod wires;
mod shown;
pub mod recorder;
pub mod watch;
