//! Contacts: where and how something presses, and with which force.
//!
//! The force is that of an elastic foundation (Winkler's, see K. L. Johnson, *Contact Mechanics*, 1985, §4.3): the
//! pressure at a place depends on the compression there alone, p = k·Δz. The stiffness per area k is that of the
//! sensor's electrodes: each stands for an equal part of the face.

#![allow(clippy::needless_range_loop, reason = "lanes of several arrays are indexed alike")]

use std::f64::consts::TAU;

use taxel_data::simd::{LANES, Lanes};
use taxel_data::{exp, normal_share_below};

use crate::sensor::{Sensor, Vector3};

/// Contact in each lane: a Gaussian dent with shear.
///
/// Deformation: Δz = d·exp(−ρ²/2s²) at a distance ρ from the centre, and (Δx, Δy) in a fixed ratio to Δz.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// Place of the centre on the face, x and y in mm.
    pub centre_mm: [Lanes; 2],
    /// Radius s of the dent in mm.
    pub dent_radius_mm: Lanes,
    /// Depth d of the dent in mm: compression at its centre.
    pub dent_depth_mm: Lanes,
    /// Shear ratio along x and y: Δx/Δz and Δy/Δz.
    pub shear: [Lanes; 2],
}

impl Contact {
    /// Writes the deformation in mm of the electrode at rest at `electrode_mm`.
    #[inline(always)]
    pub(crate) fn deform(&self, electrode_mm: &Vector3, [dx_mm, dy_mm, dz_mm]: &mut [Lanes; 3]) {
        let mut exponents = [0.0; LANES];
        for frame in 0..LANES {
            let x = electrode_mm[0] - self.centre_mm[0][frame];
            let y = electrode_mm[1] - self.centre_mm[1][frame];
            let radius = self.dent_radius_mm[frame];
            exponents[frame] = -(x * x + y * y) / (2.0 * radius * radius);
        }
        for frame in 0..LANES {
            dz_mm[frame] = self.dent_depth_mm[frame] * exp(exponents[frame]);
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
            let radius = self.dent_radius_mm[frame];
            // ∫ exp(−(x − c)²/2s²) dx over the face, along x and along y, in mm.
            let along = |axis: usize| {
                let centre = self.centre_mm[axis][frame];
                let inside = normal_share_below((sensor.size_mm[axis] - centre) / radius)
                    - normal_share_below(-centre / radius);
                radius * TAU.sqrt() * inside
            };
            let volume_mm3 = self.dent_depth_mm[frame] * along(0) * along(1);
            force_n[frame] = stiffness_n_per_mm3 * volume_mm3;
        }
        force_n
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contact(centre_mm: [f64; 2], radius_mm: f64, depth_mm: f64, shear: [f64; 2]) -> Contact {
        Contact {
            centre_mm: centre_mm.map(|c| [c; LANES]),
            dent_radius_mm: [radius_mm; LANES],
            dent_depth_mm: [depth_mm; LANES],
            shear: shear.map(|ratio| [ratio; LANES]),
        }
    }

    #[test]
    fn the_force_is_the_integral_of_the_pressure_over_the_face() {
        let sensor = Sensor::paper();
        // 2 N/mm an electrode, 48 of them on 20 mm × 18 mm.
        let stiffness = sensor.foundation_n_per_mm3();
        assert!((stiffness - 2.0 * 48.0 / 360.0).abs() < 1e-15);
        for (centre_mm, radius_mm) in [([10.0, 9.0], 2.0), ([0.0, 18.0], 3.0), ([17.5, 4.0], 5.0)] {
            let contact = contact(centre_mm, radius_mm, 0.5, [0.0, 0.0]);
            // Sum over cells of 0.05 mm × 0.05 mm.
            let (cell, mut sum) = (0.05, 0.0);
            for i in 0..400 {
                for j in 0..360 {
                    let place = [(f64::from(i) + 0.5) * cell, (f64::from(j) + 0.5) * cell, 5.0];
                    let mut delta = [[0.0; LANES]; 3];
                    contact.deform(&place, &mut delta);
                    sum += stiffness * delta[2][0] * cell * cell;
                }
            }
            let found = contact.force_n(&sensor)[LANES - 1];
            assert!((found / sum - 1.0).abs() < 1e-5, "{centre_mm:?}: {found} N, {sum} N");
        }
        // By hand: a dent well inside has the volume 2π·s²·d; at a corner a quarter of it.
        let volume_mm3 = TAU * 1.0 * 0.5;
        let inside = contact([10.0, 9.0], 1.0, 0.5, [0.0; 2]).force_n(&sensor)[0];
        assert!((inside - stiffness * volume_mm3).abs() < 1e-9, "{inside}");
        let corner = contact([20.0, 0.0], 1.0, 0.5, [0.0; 2]).force_n(&sensor)[0];
        assert!((corner - 0.25 * stiffness * volume_mm3).abs() < 1e-9, "{corner}");
    }

    #[test]
    fn shear_and_depth_are_those_of_an_electrode_at_the_centre() {
        let contact = contact([3.0, 4.0], 2.5, 0.8, [0.3, -0.4]);
        let mut delta = [[0.0; LANES]; 3];
        contact.deform(&[3.0, 4.0, 5.0], &mut delta);
        assert_eq!([delta[0], delta[1]], contact.shear_mm());
        assert_eq!(delta[2], contact.dent_depth_mm);
        assert!((contact.shear_mm()[1][0] + 0.32).abs() < 1e-15);
    }
}
