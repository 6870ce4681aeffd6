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

#[cfg(test)]
mod tests {
    use super::*;

    const SOLID: StandardLinearSolid =
        StandardLinearSolid { instant_share: 0.7, time_constant_ms: 80.0 };

    /// Deformation of one electrode that this wants along all axes.
    fn of(wanted_mm: f64) -> [[Lanes; 3]; 1] {
        [[[wanted_mm; LANES], [-wanted_mm; LANES], [2.0 * wanted_mm; LANES]]]
    }

    fn reached_mm(response: &dyn Response, after_s: f64, wanted_mm: f64) -> f64 {
        let mut deformation_mm = of(wanted_mm);
        response.reach(after_s, &mut deformation_mm);
        let [[x, y, z]] = deformation_mm.map(|axes| axes.map(|lanes| lanes[LANES - 1]));
        assert!((x + y).abs() < 1e-15 && (z - 2.0 * x).abs() < 1e-15, "{x} {y} {z}");
        x
    }

    #[test]
    fn a_load_step_reaches_its_instant_share_and_creeps_to_the_rest() {
        for (share, constant_ms) in [(0.7, 80.0), (0.0, 5.0), (1.0, 80.0), (0.4, 1e6)] {
            let solid = StandardLinearSolid { instant_share: share, time_constant_ms: constant_ms };
            let mut response = solid.at_rest(1).unwrap();
            response.advance(0.0, &of(0.5));
            let mut time_s = 0.0;
            for step_s in [0.0, 0.003, 1e-9, 0.2, 0.05, 7.0] {
                let closed = |time_s: f64| {
                    0.5 * (1.0 - (1.0 - share) * (-time_s / (0.001 * constant_ms)).exp())
                };
                let ahead_mm = reached_mm(&*response, step_s, 0.5);
                response.advance(step_s, &of(0.5));
                time_s += step_s;
                assert!((ahead_mm - closed(time_s)).abs() < 1e-14, "{ahead_mm} at {time_s} s");
                assert!((reached_mm(&*response, 0.0, 0.5) - ahead_mm).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn a_ramp_is_followed_exactly_in_steps_of_any_length() {
        let (rate_mm_per_s, constant_s) = (3.0_f64, 0.08_f64);
        let mut response = SOLID.at_rest(1).unwrap();
        let mut time_s = 0.0_f64;
        for step_s in [0.001, 1e-7, 0.04, 0.3, 0.002] {
            time_s += step_s;
            let wanted_mm = rate_mm_per_s * time_s;
            let lag_mm = rate_mm_per_s * constant_s * (1.0 - (-time_s / constant_s).exp());
            let ahead_mm = reached_mm(&*response, step_s, wanted_mm);
            assert!((ahead_mm - (wanted_mm - 0.3 * lag_mm)).abs() < 1e-9, "{ahead_mm} {time_s}");
            response.advance(step_s, &of(wanted_mm));
            assert!((reached_mm(&*response, 0.0, wanted_mm) - ahead_mm).abs() < 1e-12);
        }
    }

    #[test]
    fn settings_that_cannot_be_used_are_refused_by_name() {
        SOLID.check().unwrap();
        for (solid, field) in [
            (StandardLinearSolid { instant_share: -0.1, ..SOLID }, "rubber.instant_share = -0.1"),
            (StandardLinearSolid { instant_share: f64::NAN, ..SOLID }, "rubber.instant_share"),
            (StandardLinearSolid { time_constant_ms: 0.0, ..SOLID }, "rubber.time_constant_ms = 0"),
            (StandardLinearSolid { time_constant_ms: 1e7, ..SOLID }, "rubber.time_constant_ms"),
        ] {
            let refused = solid.check().unwrap_err().to_string();
            assert!(refused.contains(field), "{refused}");
        }
    }
}
