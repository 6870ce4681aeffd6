//! How the rubber follows what moves it: one type a kind of rubber, each an implementation of [`Rubber`].

use std::fmt::Debug;

use serde::Deserialize;
use taxel_data::simd::Lanes;

use crate::kinds::kinds;

/// A material between what pushes an electrode and where the electrode goes.
pub trait Rubber: Debug + Send + Sync {
    /// Rubber at rest under one row-wire, one trajectory a lane; it remembers what was done to it.
    fn at_rest(&self, electrodes: usize) -> Box<dyn Response>;
}

/// The rubber under one row-wire, with its memory of earlier steps.
pub trait Response {
    /// Replaces the deformation that is wanted at the next step, `step_s` later, by the one that is reached.
    ///
    /// Deformations are in mm, by electrode and axis.
    fn respond(&mut self, step_s: f64, deformation_mm: &mut [[Lanes; 3]]);
}

/// Rubber that follows at once and remembers nothing: the paper's ideal sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Elastic {}

impl Rubber for Elastic {
    fn at_rest(&self, _electrodes: usize) -> Box<dyn Response> {
        Box::new(*self)
    }
}

impl Response for Elastic {
    fn respond(&mut self, _step_s: f64, _deformation_mm: &mut [[Lanes; 3]]) {}
}

kinds! {
    /// One of the kinds of rubber.
    Rubber: Elastic
}

impl Default for Kind {
    fn default() -> Self {
        Elastic {}.into()
    }
}
