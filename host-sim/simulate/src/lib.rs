//! Simulation of a resistive tactile sensor: the ideal sensor of Wang et al. (2014), its motion, the
//! noise on its readings, and when they are read.
//!
//! A [`World`] holds the settings; [`Synthesis`] draws frames of it. Nothing that a world does not ask
//! for is computed. Modules stand from the ground up; each imports only what stands before it.
//!
#![doc = include_str!("../README.md")]
#![allow(missing_docs, clippy::missing_errors_doc)] // a name that says all needs no more

mod kinds;
pub mod sensor;
pub mod profile;
pub mod contact;
pub mod motion;
pub mod path;
pub mod timetable;
pub mod rubber;
pub mod noise;
pub mod drift;
pub mod outputs;
pub mod world;
pub mod synth;
pub mod forward;

pub use synth::{Synthesis, synthesise};
pub use taxel_data::error::{Error, Result};
pub use world::World;
