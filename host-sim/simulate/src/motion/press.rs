//! Motion by one contact, pressed into the face.

#![allow(clippy::needless_range_loop, reason = "lanes of several arrays are indexed alike")]

use std::f64::consts::TAU;

use serde::Deserialize;
use taxel_data::random::{Purpose, RandomLanes};
use taxel_data::simd::{self, LANES, Lanes};
use taxel_data::{BadValue, exp, normal_share_below, sin_cos};

use super::{Draws, Motion, Trajectories, check_range};
use crate::contact::Contact;
use crate::sensor::{Sensor, Vector3};

/// One contact, centred anywhere on the face.
///
/// Deformation: Δz = d·exp(−ρ²/2s²) at a distance ρ from the centre, and (Δx, Δy) = μ·Δz·(cos θ, sin θ)
/// with θ uniform on the circle. The other parameters are uniform on their ranges.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Press {
    /// Range of the dent's radius s in mm.
    pub dent_radius_mm: [f64; 2],
    /// Range of the dent's depth d in mm.
    pub dent_depth_mm: [f64; 2],
    /// Range of the shear ratio μ.
    pub shear_ratio: [f64; 2],
}

impl Motion for Press {
    fn range_mm(&self) -> [[f64; 2]; 3] {
        let [depth, ratio] = [self.dent_depth_mm[1], self.shear_ratio[1]];
        let shear = depth * ratio;
        [[-shear, shear], [-shear, shear], [0.0, depth]]
    }

    fn check(&self) -> Result<(), BadValue> {
        let lowest = self.dent_radius_mm[0];
        if !(lowest.is_finite() && lowest > 0.0) {
            let field = "deformation.dent_radius_mm (low)";
            return Err(BadValue::new(
                field,
                format!("{lowest:?}"),
                "it must be a positive number",
            ));
        }
        for (field, range, rule) in [
            ("dent_depth_mm", self.dent_depth_mm, "a depth is not negative"),
            ("shear_ratio", self.shear_ratio, "a ratio is not negative"),
        ] {
            if range[0].is_nan() || range[0] < 0.0 {
                return Err(BadValue::new(
                    format!("deformation.{field}"),
                    format!("{range:?}"),
                    rule,
                ));
            }
        }
        check_range("dent_radius_mm", self.dent_radius_mm)?;
        check_range("dent_depth_mm", self.dent_depth_mm)?;
        check_range("shear_ratio", self.shear_ratio)
    }

    fn latents(&self, _electrodes: usize) -> usize {
        6
    }

    fn has_independent_rows(&self) -> bool {
        false
    }

    fn place(
        &self,
        sensor: &Sensor,
        row: usize,
        latents: &[Lanes],
        deformation_mm: &mut [[Lanes; 3]],
    ) {
        let electrodes_mm = sensor.row_electrodes_mm(row);
        simd::widest(
            #[inline(always)]
            || {
                let contact = self.contact_of(latents, &sensor.size_mm);
                for (delta, electrode_mm) in deformation_mm.iter_mut().zip(electrodes_mm) {
                    contact.deform(electrode_mm, delta);
                }
            },
        );
    }

    fn largest_contact(&self, sensor: &Sensor) -> Option<Contact> {
        let [x_mm, y_mm, _] = sensor.size_mm;
        let [radius_mm, depth_mm, ratio] =
            [self.dent_radius_mm, self.dent_depth_mm, self.shear_ratio].map(|[_, high]| high);
        Some(Contact {
            centre_mm: [[0.5 * x_mm; LANES], [0.5 * y_mm; LANES]],
            dent_radius_mm: [radius_mm; LANES],
            dent_depth_mm: [depth_mm; LANES],
            shear: [[ratio; LANES]; 2],
        })
    }

    fn place_contact(&self, sensor: &Sensor, latents: &[Lanes]) -> Option<Contact> {
        Some(simd::widest(
            #[inline(always)]
            || self.contact_of(latents, &sensor.size_mm),
        ))
    }

    fn start<'m>(&'m self, sensor: &'m Sensor, draws: &mut Draws) -> Box<dyn Trajectories + 'm> {
        let contact = simd::widest(
            #[inline(always)]
            || self.draw(draws.of(Purpose::Contact, 0), &sensor.size_mm),
        );
        Box::new(Contacts { sensor, contact })
    }
}

/// Contacts that have been drawn, and the sensor that they are pressed into.
struct Contacts<'m> {
    sensor: &'m Sensor,
    contact: Contact,
}

impl Trajectories for Contacts<'_> {
    fn deform(&mut self, row: usize, _: &mut Draws, deformation_mm: &mut [[Lanes; 3]]) {
        let electrodes_mm = self.sensor.row_electrodes_mm(row);
        simd::widest(
            #[inline(always)]
            || {
                for (delta, electrode_mm) in deformation_mm.iter_mut().zip(electrodes_mm) {
                    self.contact.deform(electrode_mm, delta);
                }
            },
        );
    }

    fn contact(&self) -> Option<&Contact> {
        Some(&self.contact)
    }

    fn move_to(&mut self, centre_mm: [Lanes; 2], depth_mm: Lanes) {
        self.contact.centre_mm = centre_mm;
        self.contact.dent_depth_mm = depth_mm;
    }
}

impl Press {
    /// Draws one contact a lane, its centre uniform over the face.
    #[inline(always)]
    fn draw(&self, random: &mut RandomLanes, size_mm: &Vector3) -> Contact {
        let ranges = [
            [0.0, size_mm[0]],
            [0.0, size_mm[1]],
            self.dent_radius_mm,
            self.dent_depth_mm,
            self.shear_ratio,
            [0.0, 1.0],
        ];
        let mut drawn = [[0.0; LANES]; 6];
        random.between(ranges, &mut drawn);
        let [x_mm, y_mm, dent_radius_mm, dent_depth_mm, ratios, turns] = drawn;
        let mut shear = [[0.0; LANES]; 2];
        for frame in 0..LANES {
            let (sine, cosine) = sin_cos(TAU * turns[frame]);
            shear[0][frame] = ratios[frame] * cosine;
            shear[1][frame] = ratios[frame] * sine;
        }
        Contact { centre_mm: [x_mm, y_mm], dent_radius_mm, dent_depth_mm, shear }
    }

    /// Contacts that `latents` stand for: one each for the centre's x and y, the dent's radius and depth, and two
    /// for the shear. These two are a vector in the shear's direction, so nothing jumps at θ = 2π.
    #[inline(always)]
    fn contact_of(&self, latents: &[Lanes], size_mm: &Vector3) -> Contact {
        let ranges =
            [[0.0, size_mm[0]], [0.0, size_mm[1]], self.dent_radius_mm, self.dent_depth_mm];
        let mut uniform = [[0.0; LANES]; 4];
        let mut shear = [[0.0; LANES]; 2];
        for (i, [low, high]) in ranges.into_iter().enumerate() {
            for frame in 0..LANES {
                uniform[i][frame] = low + (high - low) * normal_share_below(latents[i][frame]);
            }
        }
        let [low, high] = self.shear_ratio;
        for frame in 0..LANES {
            let (x, y) = (latents[4][frame], latents[5][frame]);
            let squared = x * x + y * y;
            // 1 − exp(−½r²) is uniform; the square is kept from 0, where the direction does not exist.
            let ratio = low + (high - low) * (1.0 - exp(-0.5 * squared));
            let factor = ratio / squared.max(1e-300).sqrt();
            shear[0][frame] = factor * x;
            shear[1][frame] = factor * y;
        }
        let [x_mm, y_mm, dent_radius_mm, dent_depth_mm] = uniform;
        Contact { centre_mm: [x_mm, y_mm], dent_radius_mm, dent_depth_mm, shear }
    }
}
