//! Motion by a flat round punch.

use serde::Deserialize;
use taxel_data::{LANES, Lanes, exp, ln, widest};

use super::dent::{Dent, Quantity};
use crate::contact::{Form, Profile, Sides, integral};

/// Flat round punch: the depth is the same within its radius a. Outside it decays as exp(−(ρ − a)/w), as a surface does
/// beside a straight edge on Pasternak's foundation (Kerr, "Elastic and viscoelastic foundation models", 1964).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Punch {
    /// Range of the punch's radius a in mm.
    pub punch_radius_mm: [f64; 2],
    /// Range of the length w in mm on which the depth decays outside.
    pub decay_mm: [f64; 2],
    /// Range of the depth d in mm.
    pub dent_depth_mm: [f64; 2],
    /// Range of the shear ratio μ.
    pub shear_ratio: [f64; 2],
}

impl Dent for Punch {
    fn depth_and_shear(&self) -> [[f64; 2]; 2] {
        [self.dent_depth_mm, self.shear_ratio]
    }

    fn quantities(&self) -> Vec<Quantity> {
        let radius = Quantity::length("punch_radius_mm", self.punch_radius_mm);
        vec![radius, Quantity::length("decay_mm", self.decay_mm)]
    }

    fn profile(&self) -> &'static dyn Profile {
        &Flat
    }

    fn gaussian_radius_mm(&self) -> [f64; 2] {
        let half = |i: usize| self.punch_radius_mm[i] + self.decay_mm[i] * std::f64::consts::LN_2;
        [0, 1].map(|i| half(i) / (2.0 * std::f64::consts::LN_2).sqrt())
    }
}

/// Profile of a flat punch; its form is the radius a and the length w of the decay.
#[derive(Debug)]
struct Flat;

impl Profile for Flat {
    fn shares(&self, [radius_mm, decay_mm, ..]: &Form, [x, y]: &[Lanes; 2], shares: &mut Lanes) {
        widest!({
            for frame in 0..LANES {
                let distance = (x[frame] * x[frame] + y[frame] * y[frame]).sqrt();
                shares[frame] = exp(-(distance - radius_mm[frame]).max(0.0) / decay_mm[frame]);
            }
        });
    }

    /// ∮ G(ρ) dφ along the sides, where G is the integral of f·ρ from the centre to the side. A side at a distance h is
    /// passed by ρ = h·cosh u, dφ = du/cosh u.
    fn volume_mm3(
        &self,
        depth_mm: f64,
        [radius_mm, decay_mm, ..]: Form<f64>,
        sides_mm: &Sides,
    ) -> f64 {
        const STEPS: usize = 48;
        let [[left, right], [low, high]] = *sides_mm;
        let out_to = |distance: f64| {
            let inside = 0.5 * distance.min(radius_mm).powi(2);
            let beyond = (distance - radius_mm).max(0.0);
            let whole = decay_mm * (radius_mm + decay_mm);
            inside + whole - decay_mm * (radius_mm + beyond + decay_mm) * exp(-beyond / decay_mm)
        };
        let triangle = |height: f64, end: f64| {
            if height <= 0.0 || end <= 0.0 {
                return 0.0;
            }
            let tangent = end / height;
            integral(0.0, ln(tangent + (tangent * tangent + 1.0).sqrt()), STEPS, |u| {
                let cosh = 0.5 * (exp(-u) + 1.0 / exp(-u));
                out_to(height * cosh) / cosh
            })
        };
        let (across, along) = ([-left, right], [-low, high]);
        let pairs = across.iter().flat_map(|x| along.iter().map(move |y| (*x, *y)));
        depth_mm * pairs.map(|(x, y)| triangle(x, y) + triangle(y, x)).sum::<f64>()
    }
}
