//! The link between device and host: messages, and how they become bytes.
//!
//! A [`message`] consists of postcard fields. A [`packet`] puts the protocol's version and a number before it and
//! a CRC-32 behind it. [`cobs`] makes that a frame without zeros, and a zero ends every frame. Whatever bytes
//! arrive, a [`Receiver`](receive::Receiver) finds the next whole frame at the next zero. `docs/link.md` is the
//! specification, with worked bytes.

pub mod cobs;
pub mod message;
pub mod packet;
pub mod receive;
