//! Motion by two contacts at once.

use serde::Deserialize;
use taxel_data::{LANES, Lanes, exp, widest};

use super::dent::{Dent, Quantity, of_direction};
use crate::contact::{Form, Profile, Sides, gaussian_mm3, sides_from};
use crate::sensor::Vector3;

/// Two Gaussian contacts, whose dents add up. The centre, depth and shear are those of the first.
///
/// The second one lies at a distance in a direction, mirrored along x or y where it would leave the face.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pair {
    /// Range of the radius s of both dents in mm.
    pub dent_radius_mm: [f64; 2],
    /// Range of the distance between their centres in mm.
    pub distance_mm: [f64; 2],
    /// Range of the direction from the first to the second in degrees, from x towards y; any direction unless a scene says
    /// otherwise.
    pub direction_deg: Option<[f64; 2]>,
    /// Range of the second dent's depth over that of the first, up to 1.
    pub second_depth_ratio: [f64; 2],
    /// Range of the first dent's depth d in mm.
    pub dent_depth_mm: [f64; 2],
    /// Range of the shear ratio μ of both.
    pub shear_ratio: [f64; 2],
}

impl Dent for Pair {
    fn depth_and_shear(&self) -> [[f64; 2]; 2] {
        [self.dent_depth_mm, self.shear_ratio]
    }

    fn quantities(&self) -> Vec<Quantity> {
        let is_share = (|ratio: f64| (0.0..=1.0).contains(&ratio)) as fn(f64) -> bool;
        vec![
            Quantity::length("dent_radius_mm", self.dent_radius_mm),
            Quantity::length("distance_mm", self.distance_mm),
            Quantity::direction(self.direction_deg, 360.0),
            Quantity {
                field: "second_depth_ratio",
                range: self.second_depth_ratio,
                allowed: (is_share, "it must be from 0 to 1; the first dent is the deeper one"),
            },
        ]
    }

    fn profile(&self) -> &'static dyn Profile {
        &Two
    }

    fn form(
        &self,
        [radius, distance, degrees, ratio]: Form<f64>,
        centre_mm: [f64; 2],
        size_mm: &Vector3,
    ) -> Form<f64> {
        let direction = of_direction(degrees);
        let [x, y] = [0, 1].map(|axis| {
            let (offset, at) = (distance * direction[axis], centre_mm[axis]);
            let on_face = |offset: f64| (0.0..=size_mm[axis]).contains(&(at + offset));
            if !on_face(offset) && on_face(-offset) { -offset } else { offset }
        });
        [radius, x, y, ratio]
    }

    fn gaussian_radius_mm(&self) -> [f64; 2] {
        self.dent_radius_mm
    }

    /// At every place one of both centres is half their distance away, or farther.
    fn most(&self) -> f64 {
        most(self.dent_radius_mm[1], self.distance_mm[0], self.second_depth_ratio[1])
    }
}

/// Greatest share of the depth where two dents of this radius add up.
pub(super) fn most(radius_mm: f64, distance_mm: f64, ratio: f64) -> f64 {
    1.0 + ratio * exp(-(distance_mm / radius_mm).powi(2) / 8.0)
}

/// Profile of two dents; its form is their radius, the place of the second along x and y, and the ratio of depths.
#[derive(Debug)]
struct Two;

impl Profile for Two {
    fn shares(
        &self,
        [radius_mm, to_x, to_y, ratio]: &Form,
        [x, y]: &[Lanes; 2],
        shares: &mut Lanes,
    ) {
        widest!({
            for frame in 0..LANES {
                let (x, y, radius) = (x[frame], y[frame], radius_mm[frame]);
                let (to_x, to_y) = (x - to_x[frame], y - to_y[frame]);
                let of = |squares: f64| exp(-squares / (2.0 * radius * radius));
                shares[frame] = of(x * x + y * y) + ratio[frame] * of(to_x * to_x + to_y * to_y);
            }
        });
    }

    fn volume_mm3(&self, depth_mm: f64, [radius, x, y, ratio]: Form<f64>, sides_mm: &Sides) -> f64 {
        gaussian_mm3(depth_mm, radius, sides_mm)
            + gaussian_mm3(ratio * depth_mm, radius, &sides_from(sides_mm, [x, y]))
    }

    fn is_single(&self) -> bool {
        false
    }
}
