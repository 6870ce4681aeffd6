//! Contacts: where and how something presses, and with which force.
//!
//! The force is that of an elastic foundation (Winkler's, see K. L. Johnson, *Contact Mechanics*, 1985, §4.3): the
//! pressure at a place depends on the compression there alone, p = k·Δz. The stiffness per area k is that of the
//! sensor's electrodes: each stands for an equal part of the face.

#![allow(clippy::needless_range_loop, reason = "lanes of several arrays are indexed alike")]

use std::f64::consts::TAU;
use std::fmt::Debug;

use taxel_data::{LANES, Lanes, normal_share_below, widest};

use crate::sensor::{Sensor, Vector3};

/// Numbers that fix the form of a dent: its radius, and what else its [`Profile`] needs.
pub type Form<T = Lanes> = [T; 4];

/// Sides of the face along x and y in mm, as seen from a dent's centre: `[axis][low, high]`.
pub type Sides = [[f64; 2]; 2];

/// Profile of a dent: how deep it is at each place, as a share of its depth.
pub trait Profile: Debug + Sync {
    /// Writes the share of the depth at these distances in mm from the centre, along x and y.
    fn shares(&self, form: &Form, offset_mm: &[Lanes; 2], shares: &mut Lanes);

    /// Volume in mm³ of a dent of this depth on a face with these sides.
    fn volume_mm3(&self, depth_mm: f64, form: Form<f64>, sides_mm: &Sides) -> f64;

    /// Whether it is a single dent, which has one centre, depth and shear.
    fn is_single(&self) -> bool {
        true
    }
}

/// Contact in each lane: a dent with shear.
///
/// Deformation: Δz = d·f(x, y) at a place as seen from the centre, and (Δx, Δy) in a fixed ratio to Δz.
#[derive(Debug, Clone)]
pub struct Contact {
    /// Place of the centre on the face, x and y in mm.
    pub centre_mm: [Lanes; 2],
    /// Depth d of the dent in mm: compression at its centre.
    pub dent_depth_mm: Lanes,
    /// Shear ratio along x and y: Δx/Δz and Δy/Δz.
    pub shear: [Lanes; 2],
    /// Numbers that fix the dent's form.
    pub form: Form,
    /// Profiles of the dents.
    pub profiles: Vec<&'static dyn Profile>,
    /// Index of each lane's profile.
    pub profile_of: Lanes<u8>,
}

impl Contact {
    /// Contact that is in each lane the one of these `contacts` that the lane's number in `which` says.
    ///
    /// # Panics
    /// If there is no such contact.
    pub fn pick(contacts: &[Self], which: Lanes<u8>) -> Self {
        let mut picked = contacts[0].clone();
        picked.profiles = contacts.iter().flat_map(|it| it.profiles.clone()).collect();
        let mut first = 0;
        for (number, contact) in (0..).zip(contacts) {
            for lane in (0..LANES).filter(|lane| which[*lane] == number) {
                for axis in 0..2 {
                    picked.centre_mm[axis][lane] = contact.centre_mm[axis][lane];
                    picked.shear[axis][lane] = contact.shear[axis][lane];
                }
                picked.dent_depth_mm[lane] = contact.dent_depth_mm[lane];
                for (picked, number) in picked.form.iter_mut().zip(&contact.form) {
                    picked[lane] = number[lane];
                }
                picked.profile_of[lane] = first + contact.profile_of[lane];
            }
            first += contact.profiles.len() as u8;
        }
        picked
    }

    /// Whether it is a single dent in every lane.
    pub fn is_single(&self) -> bool {
        self.profiles.iter().all(|profile| profile.is_single())
    }

    /// Writes the deformations in mm of electrodes at rest at `electrodes_mm`, by electrode and axis.
    pub(crate) fn deform(&self, electrodes_mm: &[Vector3], deformation_mm: &mut [[Lanes; 3]]) {
        widest!({
            for (delta, electrode_mm) in deformation_mm.iter_mut().zip(electrodes_mm) {
                self.deform_one(electrode_mm, delta);
            }
        });
    }

    #[inline(always)]
    fn deform_one(&self, electrode_mm: &Vector3, [dx_mm, dy_mm, dz_mm]: &mut [Lanes; 3]) {
        let mut offset_mm = [[0.0; LANES]; 2];
        for frame in 0..LANES {
            offset_mm[0][frame] = electrode_mm[0] - self.centre_mm[0][frame];
            offset_mm[1][frame] = electrode_mm[1] - self.centre_mm[1][frame];
        }
        let mut shares = [0.0; LANES];
        for (number, profile) in (0..).zip(&self.profiles) {
            profile.shares(&self.form, &offset_mm, &mut shares);
            for frame in 0..LANES {
                if self.profile_of[frame] == number {
                    dz_mm[frame] = self.dent_depth_mm[frame] * shares[frame];
                }
            }
        }
        for frame in 0..LANES {
            dx_mm[frame] = self.shear[0][frame] * dz_mm[frame];
            dy_mm[frame] = self.shear[1][frame] * dz_mm[frame];
        }
    }

    /// Shear at the centre: Δx and Δy in mm.
    pub fn shear_mm(&self) -> [Lanes; 2] {
        let mut shear_mm = self.shear;
        for along in &mut shear_mm {
            for frame in 0..LANES {
                along[frame] *= self.dent_depth_mm[frame];
            }
        }
        shear_mm
    }

    /// Normal force in N on the face of `sensor`: the integral of k·Δz over the face. What of the dent lies beyond the
    /// face does not count.
    pub fn force_n(&self, sensor: &Sensor) -> Lanes {
        let stiffness_n_per_mm3 = sensor.foundation_n_per_mm3();
        let mut force_n = [0.0; LANES];
        for frame in 0..LANES {
            let side = |axis: usize| {
                let centre = self.centre_mm[axis][frame];
                [-centre, sensor.size_mm[axis] - centre]
            };
            let profile = self.profiles[usize::from(self.profile_of[frame])];
            let (depth_mm, form) = (self.dent_depth_mm[frame], self.form.map(|lanes| lanes[frame]));
            force_n[frame] =
                stiffness_n_per_mm3 * profile.volume_mm3(depth_mm, form, &[side(0), side(1)]);
        }
        force_n
    }
}

/// Volume in mm³ of a Gaussian dent d·exp(−ρ²/2s²) on a face with these sides.
pub fn gaussian_mm3(depth_mm: f64, radius_mm: f64, sides_mm: &Sides) -> f64 {
    // ∫ exp(−x²/2s²) dx over the face, along x and along y, in mm.
    let along = |[low, high]: [f64; 2]| {
        let inside = normal_share_below(high / radius_mm) - normal_share_below(low / radius_mm);
        radius_mm * TAU.sqrt() * inside
    };
    depth_mm * along(sides_mm[0]) * along(sides_mm[1])
}

/// Sides of the face as seen from a place that is so far from the dent's centre.
pub fn sides_from(sides_mm: &Sides, offset_mm: [f64; 2]) -> Sides {
    [0, 1].map(|axis| sides_mm[axis].map(|side| side - offset_mm[axis]))
}

/// Simpson's rule for the integral of `f` from `low` to `high`, in at least so many `steps`.
pub fn integral(low: f64, high: f64, steps: usize, f: impl Fn(f64) -> f64) -> f64 {
    let steps = 2 * steps.div_ceil(2).max(1);
    let step = (high - low) / steps as f64;
    let weight = |i: usize| match i {
        0 => 1.0,
        i if i == steps => 1.0,
        i => 2.0 + 2.0 * (i % 2) as f64,
    };
    let sum: f64 = (0..=steps).map(|i| weight(i) * f(low + step * i as f64)).sum();
    sum * step / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrals_are_exact_for_cubics_and_sides_move_with_the_place() {
        // By hand: ∫ 4x³ + 2 from −1 to 2 is 16 − 1 + 6.
        for steps in [1, 2, 7] {
            let found = integral(-1.0, 2.0, steps, |x| 4.0 * x * x * x + 2.0);
            assert!((found - 21.0).abs() < 1e-12, "{steps}: {found}");
        }
        let moved = sides_from(&[[-3.0, 17.0], [-4.0, 14.0]], [2.0, -1.0]);
        assert_eq!(moved, [[-5.0, 15.0], [-3.0, 15.0]]);
        // By hand: a dent well inside has the volume 2π·s²·d; at a corner a quarter of it.
        let inside = gaussian_mm3(0.5, 1.0, &[[-10.0, 10.0], [-9.0, 9.0]]);
        assert!((inside - 0.5 * TAU).abs() < 1e-9, "{inside}");
        let corner = gaussian_mm3(0.5, 1.0, &[[0.0, 20.0], [-18.0, 0.0]]);
        assert!((corner - 0.125 * TAU).abs() < 1e-9, "{corner}");
    }
}
