//! What a sensor can know: the least possible error of any decoder, and the directions that its noise hides.
//!
//! The least mean square error of all decoders is that of the posterior mean E[Δ | readings]. A [`Limit`] computes it
//! by adaptive importance sampling, for worlds whose prior and noise are known; a [`Reference`] compares decoders
//! with it. `docs/what-the-sensor-knows.md` explains both. Modules stand from the ground up; each imports only what
//! stands before it.
//!
#![doc = include_str!("../README.md")]

pub mod error;
pub mod target;
pub mod weights;
pub mod samples;
mod slopes;
mod mixture;
mod maps;
pub mod population;
pub mod frame;
pub mod limit;
mod moving;
pub mod reference;
pub mod identify;

pub use error::Refusal;
pub use limit::Limit;
pub use reference::{Ratio, Reference};
