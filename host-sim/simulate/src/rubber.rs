//! Rubber, which follows the motion that deforms it: one type a kind, each an implementation of
//! [`Rubber`].

use std::fmt::Debug;

use serde::Deserialize;
use taxel_data::simd::Lanes;

use crate::kinds::kinds;

/// Material between whatever pushes an electrode and the place where the electrode goes.
pub trait Rubber: Debug + Send + Sync {
    /// Rubber at rest under one row-wire, one trajectory a lane, with a memory of its own.
    fn at_rest(&self, electrodes: usize) -> Box<dyn Response>;
}

/// Rubber under one row-wire, with its memory of earlier steps.
pub trait Response {
    /// Replaces the deformation that is wanted at the next step by the deformation that is reached.
    ///
    /// The step is `step_s` later than the previous one. Deformations are in mm, by electrode and axis.
    fn respond(&mut self, step_s: f64, deformation_mm: &mut [[Lanes; 3]]);
}

/// Elastic rubber that follows at once and remembers nothing: the paper's ideal sensor.
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
    /// Kind of rubber.
    Rubber: Elastic
}

impl Default for Kind {
    fn default() -> Self {
        Elastic {}.into()
    }
}
