//! A live view of a tactile sensor in the browser.
//!
//! [`View`] serves the page and what it shows; a device, a simulation or a recording feeds it. [`message`] is the contract with
//! the page, [`Command`] what its buttons ask for. Modules stand from the ground up; each imports only what stands before it.
//!
#![doc = include_str!("../README.md")]

pub mod message;
mod command;
mod http;
mod guard;
mod shared;
mod server;
mod view;

pub use command::{Action, Command};
pub use message::{Frame, Layout, Status};
pub use view::View;
