//! Motion by one contact with a Gaussian dent, pressed into the face.

use serde::Deserialize;
use taxel_data::{LANES, Lanes, exp, widest};

use super::dent::{Dent, Quantity};
use crate::contact::{Form, Profile, Sides, gaussian_mm3};

/// One Gaussian contact, centred anywhere on the face: its share of the depth is exp(−ρ²/2s²) at a distance ρ.
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

impl Dent for Press {
    fn depth_and_shear(&self) -> [[f64; 2]; 2] {
        [self.dent_depth_mm, self.shear_ratio]
    }

    fn quantities(&self) -> Vec<Quantity> {
        vec![Quantity::length("dent_radius_mm", self.dent_radius_mm)]
    }

    fn profile(&self) -> &'static dyn Profile {
        &Gaussian
    }

    fn gaussian_radius_mm(&self) -> [f64; 2] {
        self.dent_radius_mm
    }
}

/// Profile of a Gaussian dent; its form is the radius s.
#[derive(Debug)]
struct Gaussian;

impl Profile for Gaussian {
    fn shares(&self, [radius_mm, ..]: &Form, [x, y]: &[Lanes; 2], shares: &mut Lanes) {
        widest!({
            for frame in 0..LANES {
                let (x, y, radius) = (x[frame], y[frame], radius_mm[frame]);
                shares[frame] = exp(-(x * x + y * y) / (2.0 * radius * radius));
            }
        });
    }

    fn volume_mm3(&self, depth_mm: f64, [radius_mm, ..]: Form<f64>, sides_mm: &Sides) -> f64 {
        gaussian_mm3(depth_mm, radius_mm, sides_mm)
    }
}
