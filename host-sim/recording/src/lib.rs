//! Recordings of a tactile sensor, as MCAP files with ROS 2 messages.
//!
//! [`Writer`] writes frames as they come; [`Reader`] reads them back in bounded memory; [`recover`] mends a recording that
//! was cut. Modules stand from the ground up; each imports only what stands before it.
//!
#![doc = include_str!("../README.md")]

mod error;
mod bytes;
mod record;
mod layout;
mod frame;
mod topic;
mod message;
mod diagnostics;
mod chunk;
mod file;
mod summary;
mod mcap;
mod output;
mod writer;
mod reader;
mod mend;

pub use error::{Error, Result};
pub use frame::{Frame, Health, Status};
pub use layout::{Column, Electrode, Extras, Layout};
pub use mend::{Recovered, mend, recover};
pub use reader::Reader;
pub use writer::{Replace, Writer};
