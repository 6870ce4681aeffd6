//! Motion by a contact with a long tail: a touch through a soft cover.

use serde::Deserialize;
use taxel_data::{LANES, Lanes, widest};

use super::dent::{Dent, Quantity};
use crate::contact::{Form, Profile, Sides};

/// Contact with a long tail: its share of the depth is (1 + ρ²/s²)^(−5/2) at a distance ρ.
///
/// That is Boussinesq's pressure σ = 3F/2π·s³/(ρ² + s²)^(5/2) below a point force on an elastic cover of thickness s (K. L.
/// Johnson, *Contact Mechanics*, 1985, §3.2), on a foundation whose compression follows the pressure. It falls with the
/// fifth power of the distance, where a Gaussian dent has long vanished.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tail {
    /// Range of the cover's thickness s in mm. At half its depth the dent is as wide as a Gaussian one of radius 0.48·s.
    pub cover_mm: [f64; 2],
    /// Range of the depth d in mm.
    pub dent_depth_mm: [f64; 2],
    /// Range of the shear ratio μ.
    pub shear_ratio: [f64; 2],
}

/// Radius of the Gaussian dent that is as wide at half its depth, over the cover's thickness.
pub(super) const GAUSSIAN_RADIUS: f64 = 0.480_1;

impl Dent for Tail {
    fn depth_and_shear(&self) -> [[f64; 2]; 2] {
        [self.dent_depth_mm, self.shear_ratio]
    }

    fn quantities(&self) -> Vec<Quantity> {
        vec![Quantity::length("cover_mm", self.cover_mm)]
    }

    fn profile(&self) -> &'static dyn Profile {
        &Covered
    }

    fn gaussian_radius_mm(&self) -> [f64; 2] {
        self.cover_mm.map(|mm| GAUSSIAN_RADIUS * mm)
    }
}

/// Profile of a dent through a cover; its form is the cover's thickness s.
#[derive(Debug)]
struct Covered;

impl Profile for Covered {
    fn shares(&self, [cover_mm, ..]: &Form, [x, y]: &[Lanes; 2], shares: &mut Lanes) {
        widest!({
            for frame in 0..LANES {
                let (x, y) = (x[frame] / cover_mm[frame], y[frame] / cover_mm[frame]);
                let far = 1.0 + x * x + y * y;
                shares[frame] = 1.0 / (far * far * far.sqrt());
            }
        });
    }

    /// Pressure below the corner of an evenly loaded rectangle (Holl, 1940), which by reciprocity is the share of a point
    /// force's pressure on the rectangle.
    fn volume_mm3(&self, depth_mm: f64, [s, ..]: Form<f64>, sides_mm: &Sides) -> f64 {
        let corner = |x: f64, y: f64| {
            let distance = (x * x + y * y + s * s).sqrt();
            let (p, q) = (x * x + s * s, y * y + s * s);
            libm::atan(x * y / (s * distance)) + x * y * s / distance * (1.0 / p + 1.0 / q)
        };
        let [[left, right], [low, high]] = *sides_mm;
        let corners =
            corner(right, high) - corner(left, high) - corner(right, low) + corner(left, low);
        depth_mm * s * s / 3.0 * corners
    }
}
