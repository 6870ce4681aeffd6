//! Contacts: where and how something presses, and with which force.
//!
//! The force is that of an elastic foundation (Winkler's, see K. L. Johnson, *Contact Mechanics*, 1985, §4.3): the
//! pressure at a place depends on the compression there alone, p = k·Δz. The stiffness per area k is that of the
//! sensor's electrodes: each stands for an equal part of the face.

#![allow(clippy::needless_range_loop, reason = "lanes of several arrays are indexed alike")]

use taxel_data::{LANES, Lanes, widest};

use crate::profile::{Form, Profile};
use crate::sensor::{Sensor, Vector3};

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
    /// Profile f of the dent, and the numbers that fix it.
    pub profile: Lanes<Profile>,
    pub form: Form<Lanes>,
}

impl Contact {
    /// Contact that is in each lane the one of these `contacts` that the lane's number in `which` says.
    ///
    /// # Panics
    /// If there is no such contact.
    pub fn pick(contacts: &[Self], which: Lanes<u8>) -> Self {
        let mut picked = contacts[0].clone();
        for (lane, which) in which.into_iter().enumerate() {
            let contact = &contacts[usize::from(which)];
            for axis in 0..2 {
                picked.centre_mm[axis][lane] = contact.centre_mm[axis][lane];
                picked.shear[axis][lane] = contact.shear[axis][lane];
            }
            picked.dent_depth_mm[lane] = contact.dent_depth_mm[lane];
            picked.profile[lane] = contact.profile[lane];
            for (picked, number) in picked.form.iter_mut().zip(&contact.form) {
                picked[lane] = number[lane];
            }
        }
        picked
    }

    /// Whether it is a single dent in every lane, which has one centre, depth and shear.
    pub fn is_single(&self) -> bool {
        !self.profile.contains(&Profile::Pair)
    }

    /// Profiles of the lanes, each once.
    fn profiles(&self) -> Vec<Profile> {
        Profile::ALL.into_iter().filter(|profile| self.profile.contains(profile)).collect()
    }

    /// Share of the depth in each lane at these distances in mm from the centre, along x and y. `profiles` are those of
    /// the lanes.
    #[inline(always)]
    fn shares(&self, profiles: &[Profile], offset_mm: &[Lanes; 2]) -> Lanes {
        let mut shares = [0.0; LANES];
        for profile in profiles {
            let of_profile = profile.shares(&self.form, offset_mm);
            for frame in 0..LANES {
                if self.profile[frame] == *profile {
                    shares[frame] = of_profile[frame];
                }
            }
        }
        shares
    }

    /// Writes the deformations in mm of electrodes at rest at `electrodes_mm`, by electrode and axis.
    pub fn deform(&self, electrodes_mm: &[Vector3], deformation_mm: &mut [[Lanes; 3]]) {
        let profiles = self.profiles();
        widest!({
            for (delta, electrode_mm) in deformation_mm.iter_mut().zip(electrodes_mm) {
                let [dx_mm, dy_mm, dz_mm] = delta;
                let mut offset_mm = [[0.0; LANES]; 2];
                for frame in 0..LANES {
                    offset_mm[0][frame] = electrode_mm[0] - self.centre_mm[0][frame];
                    offset_mm[1][frame] = electrode_mm[1] - self.centre_mm[1][frame];
                }
                let shares = self.shares(&profiles, &offset_mm);
                for frame in 0..LANES {
                    dz_mm[frame] = self.dent_depth_mm[frame] * shares[frame];
                    dx_mm[frame] = self.shear[0][frame] * dz_mm[frame];
                    dy_mm[frame] = self.shear[1][frame] * dz_mm[frame];
                }
            }
        });
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
    ///
    /// The integral is Gauss's rule of four nodes, on 10 × 10 equal panels of the part of the face that
    /// the dent reaches. It is within 1e-5 of the volume for Gaussian dents, and within 5e-3 for punches, which have a
    /// kink at their rim.
    pub fn force_n(&self, sensor: &Sensor) -> Lanes {
        let (mut low_mm, mut length_mm) = ([[0.0; LANES]; 2], [[0.0; LANES]; 2]);
        for frame in 0..LANES {
            let form = self.form.map(|lanes| lanes[frame]);
            let reach_mm = self.profile[frame].reach_mm(form);
            for axis in 0..2 {
                let (centre, [low, high]) = (self.centre_mm[axis][frame], reach_mm[axis]);
                low_mm[axis][frame] = low.max(-centre);
                let high = high.min(sensor.size_mm[axis] - centre);
                length_mm[axis][frame] = (high - low_mm[axis][frame]).max(0.0);
            }
        }
        let (profiles, mut sum) = (self.profiles(), [0.0; LANES]);
        widest!({
            let mut offset_mm = [[0.0; LANES]; 2];
            for (x, x_weight) in nodes() {
                for frame in 0..LANES {
                    offset_mm[0][frame] = low_mm[0][frame] + length_mm[0][frame] * x;
                }
                for (y, y_weight) in nodes() {
                    for frame in 0..LANES {
                        offset_mm[1][frame] = low_mm[1][frame] + length_mm[1][frame] * y;
                    }
                    let shares = self.shares(&profiles, &offset_mm);
                    for frame in 0..LANES {
                        sum[frame] += x_weight * y_weight * shares[frame];
                    }
                }
            }
        });
        let stiffness_n_per_mm3 = sensor.foundation_n_per_mm3();
        for frame in 0..LANES {
            let area_mm2 = length_mm[0][frame] * length_mm[1][frame];
            sum[frame] *= stiffness_n_per_mm3 * self.dent_depth_mm[frame] * area_mm2;
        }
        sum
    }
}

/// Panels along each side of the face in an integral over it.
const PANELS: usize = 10;

/// Nodes on [0, 1] of Gauss's rule of four nodes in each of [`PANELS`] panels, with their weights.
#[inline(always)]
fn nodes() -> impl Iterator<Item = (f64, f64)> {
    // Abramowitz & Stegun, *Handbook of Mathematical Functions*, 1964, table 25.4.
    const INNER: [f64; 2] = [0.339_981_043_584_856_26, 0.652_145_154_862_546_1];
    const OUTER: [f64; 2] = [0.861_136_311_594_052_6, 0.347_854_845_137_453_85];
    let rule = [[-OUTER[0], OUTER[1]], [-INNER[0], INNER[1]], INNER, OUTER];
    let of_panel = move |panel: usize| {
        rule.into_iter().map(move |[at, weight]| {
            let width = 1.0 / PANELS as f64;
            (width * (panel as f64 + 0.5 + 0.5 * at), 0.5 * width * weight)
        })
    };
    (0..PANELS).flat_map(of_panel)
}
