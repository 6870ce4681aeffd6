//! Motion by an elliptic contact.

use std::f64::consts::TAU;

use serde::Deserialize;
use taxel_data::{LANES, Lanes, exp, widest};

use super::dent::{Dent, Quantity, of_direction};
use crate::contact::{Form, Profile, Sides, gaussian_mm3, integral, sides_from};
use crate::sensor::Vector3;

/// Elliptic contact: Gaussian with the radii s·√q and s/√q, so of the same volume as a round one of radius s.
///
/// The share of the depth is exp(−u²/2s₁² − v²/2s₂²) at a distance u along the longer radius and v across it.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ellipse {
    /// Range of the geometric mean s of both radii in mm.
    pub dent_radius_mm: [f64; 2],
    /// Range of the ratio q of both radii, from 1.
    pub aspect_ratio: [f64; 2],
    /// Range of the longer radius' direction in degrees, from x towards y; any direction unless a scene says otherwise.
    pub direction_deg: Option<[f64; 2]>,
    /// Range of the depth d in mm.
    pub dent_depth_mm: [f64; 2],
    /// Range of the shear ratio μ.
    pub shear_ratio: [f64; 2],
}

impl Dent for Ellipse {
    fn depth_and_shear(&self) -> [[f64; 2]; 2] {
        [self.dent_depth_mm, self.shear_ratio]
    }

    fn quantities(&self) -> Vec<Quantity> {
        let is_ratio = (|ratio: f64| (1.0..=100.0).contains(&ratio)) as fn(f64) -> bool;
        vec![
            Quantity::length("dent_radius_mm", self.dent_radius_mm),
            Quantity {
                field: "aspect_ratio",
                range: self.aspect_ratio,
                allowed: (is_ratio, "it must be from 1 to 100"),
            },
            Quantity::direction(self.direction_deg, 180.0),
        ]
    }

    fn profile(&self) -> &'static dyn Profile {
        &Elliptic
    }

    fn form(&self, [radius, ratio, degrees, _]: Form<f64>, _: [f64; 2], _: &Vector3) -> Form<f64> {
        let [cosine, sine] = of_direction(degrees);
        [radius * ratio.sqrt(), radius / ratio.sqrt(), cosine, sine]
    }

    fn gaussian_radius_mm(&self) -> [f64; 2] {
        self.dent_radius_mm
    }
}

/// Profile of an elliptic dent; its form is the longer and the shorter radius, and cosine and sine of the direction.
#[derive(Debug)]
struct Elliptic;

impl Profile for Elliptic {
    fn shares(
        &self,
        [long_mm, short_mm, cosine, sine]: &Form,
        [x, y]: &[Lanes; 2],
        shares: &mut Lanes,
    ) {
        widest!({
            for frame in 0..LANES {
                let along = cosine[frame] * x[frame] + sine[frame] * y[frame];
                let across = cosine[frame] * y[frame] - sine[frame] * x[frame];
                let (along, across) = (along / long_mm[frame], across / short_mm[frame]);
                shares[frame] = exp(-0.5 * (along * along + across * across));
            }
        });
    }

    /// The dent is a normal distribution, along the longer radius, of round ones of the shorter radius.
    fn volume_mm3(
        &self,
        depth_mm: f64,
        [long, short, cosine, sine]: Form<f64>,
        sides_mm: &Sides,
    ) -> f64 {
        /// Deviations to which the distribution is followed.
        const FAR: f64 = 7.0;
        let deviation = (long * long - short * short).max(0.0).sqrt();
        if deviation < 1e-6 * short {
            return gaussian_mm3(depth_mm, short, sides_mm);
        }
        let steps = (8.0 * FAR * deviation / short).ceil().clamp(64.0, 1000.0) as usize;
        let mean = integral(-FAR, FAR, steps, |at| {
            let offset_mm = [at * deviation * cosine, at * deviation * sine];
            exp(-0.5 * at * at) * gaussian_mm3(1.0, short, &sides_from(sides_mm, offset_mm))
        });
        depth_mm * long / short * mean / TAU.sqrt()
    }
}
