//! Rubber, which follows the motion that deforms it: one type a kind, each an implementation of
//! [`Rubber`].
//!
//! A motion says which deformation is *wanted*: where the load would hold an electrode in the end. Rubber says which one is
//! *reached* by now. A still frame is of a contact that was held until nothing creeps any more, so both are the same there.

#![allow(clippy::needless_range_loop, reason = "lanes of several arrays are indexed alike")]

use std::fmt::Debug;

use serde::Deserialize;
use taxel_data::{BadValue, LANES, Lanes, exp, require, widest};

use crate::kinds::kinds;

/// Material between whatever pushes an electrode and the place where the electrode goes.
pub trait Rubber: Debug + Send + Sync {
    /// Checks the rubber's settings.
    fn check(&self) -> Result<(), BadValue>;

    /// Memory of rubber at rest under one row-wire, one trajectory a lane; `None` for rubber that follows at once.
    fn at_rest(&self, electrodes: usize) -> Option<Box<dyn Response>>;
}

/// Rubber under one row-wire, with its memory of what was wanted. Deformations are in mm, by electrode and axis.
pub trait Response {
    /// Goes on by `step_s`, in which the wanted deformation changes linearly to this one. A step of 0 s is a jump.
    fn advance(&mut self, step_s: f64, wanted_mm: &[[Lanes; 3]]);

    /// Replaces the deformation that is wanted `after_s` later, to which it changes linearly, by the one that is reached
    /// then. Nothing is remembered.
    fn reach(&self, after_s: f64, deformation_mm: &mut [[Lanes; 3]]);
}

/// Elastic rubber that follows at once and remembers nothing: the paper's ideal sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Elastic {}

impl Rubber for Elastic {
    fn check(&self) -> Result<(), BadValue> {
        Ok(())
    }

    fn at_rest(&self, _electrodes: usize) -> Option<Box<dyn Response>> {
        None
    }
}

/// Standard linear solid: a spring in series with a spring and a dashpot side by side, under each electrode and along each
/// axis.
///
/// A load that sets in at t = 0 and would deform it by w in the end has deformed it by w·(1 − (1 − s)·exp(−t/τ)) at t: s·w at
/// once, the rest by creep. Any load deforms it by s·w + (1 − s)·v, where τ·dv/dt = w − v. See W. N. Findley, J. S. Lai,
/// K. Onaran, *Creep and Relaxation of Nonlinear Viscoelastic Materials*, 1976, chapter 5.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StandardLinearSolid {
    /// Share s of a deformation that is reached at once: delayed modulus over instant modulus.
    pub instant_share: f64,
    /// Time constant τ of the creep under a constant load, in ms. That of the relaxation at a constant deformation is s·τ.
    pub time_constant_ms: f64,
}

/// Standard linear solid under one row-wire.
struct Creep {
    solid: StandardLinearSolid,
    /// Wanted deformation w, and deformation v of the part that creeps, in mm; of each electrode along each axis.
    memory_mm: Vec<[[Lanes; 2]; 3]>,
}

impl Rubber for StandardLinearSolid {
    fn check(&self) -> Result<(), BadValue> {
        let (share, constant_ms) = (self.instant_share, self.time_constant_ms);
        require((0.0..=1.0).contains(&share), "rubber.instant_share", share, || {
            "it is a fraction from 0 to 1: delayed modulus over instant modulus".into()
        })?;
        let field = "rubber.time_constant_ms";
        require((0.1..=1e6).contains(&constant_ms), field, constant_ms, || {
            "it must be from 0.1 to 1000000".into()
        })
    }

    fn at_rest(&self, electrodes: usize) -> Option<Box<dyn Response>> {
        let memory_mm = vec![[[[0.0; LANES]; 2]; 3]; electrodes];
        Some(Box::new(Creep { solid: *self, memory_mm }))
    }
}

impl Creep {
    /// What is left after `step_s` of the difference between w and v, and v's lag behind a w that changes by 1 meanwhile.
    fn rest_and_lag(&self, step_s: f64) -> [f64; 2] {
        let constants = step_s * 1000.0 / self.solid.time_constant_ms;
        let rest = exp(-constants);
        // A jump takes no time: v stays, and lags behind by all of it.
        [rest, if constants > 0.0 { (1.0 - rest) / constants } else { 1.0 }]
    }
}

impl Response for Creep {
    fn advance(&mut self, step_s: f64, wanted_mm: &[[Lanes; 3]]) {
        let [rest, lag] = self.rest_and_lag(step_s);
        widest!({
            let axes = self.memory_mm.as_flattened_mut().iter_mut();
            for ([before, crept], wanted) in axes.zip(wanted_mm.as_flattened()) {
                for lane in 0..LANES {
                    crept[lane] = wanted[lane] - lag * (wanted[lane] - before[lane])
                        + rest * (crept[lane] - before[lane]);
                    before[lane] = wanted[lane];
                }
            }
        });
    }

    fn reach(&self, after_s: f64, deformation_mm: &mut [[Lanes; 3]]) {
        let [rest, lag] = self.rest_and_lag(after_s);
        let behind = 1.0 - self.solid.instant_share;
        widest!({
            let axes = self.memory_mm.as_flattened().iter();
            for ([before, crept], wanted) in axes.zip(deformation_mm.as_flattened_mut()) {
                for lane in 0..LANES {
                    let lagging =
                        lag * (wanted[lane] - before[lane]) - rest * (crept[lane] - before[lane]);
                    wanted[lane] -= behind * lagging;
                }
            }
        });
    }
}

kinds! {
    /// Kind of rubber that a scene can name.
    #[serde(tag = "kind", rename_all = "snake_case")]
    Rubber: Elastic, StandardLinearSolid
}

impl Default for Kind {
    fn default() -> Self {
        Elastic {}.into()
    }
}
