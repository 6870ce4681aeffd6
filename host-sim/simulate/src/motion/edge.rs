//! Motion by an edge: a line contact.

use std::f64::consts::TAU;

use serde::Deserialize;
use taxel_data::{LANES, Lanes, exp, normal_share_below, widest};

use super::dent::{Dent, Quantity, of_direction};
use crate::contact::{Form, Profile, Sides, gaussian_mm3, integral, sides_from};
use crate::sensor::Vector3;

/// Edge: Gaussian dents of radius w side by side along a line of length l.
///
/// The share of the depth is exp(−v²/2w²)·[Φ((u + l/2)/w) − Φ((u − l/2)/w)] at a distance u along the line and v across
/// it, over its value at the centre.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Edge {
    /// Range of the line's length l in mm.
    pub edge_length_mm: [f64; 2],
    /// Range of the radius w in mm across the line.
    pub edge_width_mm: [f64; 2],
    /// Range of the line's direction in degrees, from x towards y; any direction unless a scene says otherwise.
    pub direction_deg: Option<[f64; 2]>,
    /// Range of the depth d in mm.
    pub dent_depth_mm: [f64; 2],
    /// Range of the shear ratio μ.
    pub shear_ratio: [f64; 2],
}

impl Dent for Edge {
    fn depth_and_shear(&self) -> [[f64; 2]; 2] {
        [self.dent_depth_mm, self.shear_ratio]
    }

    fn quantities(&self) -> Vec<Quantity> {
        vec![
            Quantity::length("edge_length_mm", self.edge_length_mm),
            Quantity::length("edge_width_mm", self.edge_width_mm),
            Quantity::direction(self.direction_deg, 180.0),
        ]
    }

    fn profile(&self) -> &'static dyn Profile {
        &Line
    }

    fn form(&self, [length, width, degrees, _]: Form<f64>, _: [f64; 2], _: &Vector3) -> Form<f64> {
        let [cosine, sine] = of_direction(degrees);
        [0.5 * length, width, cosine, sine]
    }

    fn gaussian_radius_mm(&self) -> [f64; 2] {
        self.edge_width_mm
    }
}

/// Profile of an edge; its form is half the length, the width w, and cosine and sine of the direction.
#[derive(Debug)]
struct Line;

/// Share of a normal distribution within so many deviations.
#[inline(always)]
fn within(deviations: f64) -> f64 {
    2.0 * normal_share_below(deviations) - 1.0
}

impl Profile for Line {
    fn shares(
        &self,
        [half_mm, width_mm, cosine, sine]: &Form,
        [x, y]: &[Lanes; 2],
        shares: &mut Lanes,
    ) {
        widest!({
            for frame in 0..LANES {
                let (half, width) = (half_mm[frame], width_mm[frame]);
                let along = cosine[frame] * x[frame] + sine[frame] * y[frame];
                let across = cosine[frame] * y[frame] - sine[frame] * x[frame];
                let of_line = normal_share_below((along + half) / width)
                    - normal_share_below((along - half) / width);
                let across = exp(-across * across / (2.0 * width * width));
                shares[frame] = across * of_line / within(half / width);
            }
        });
    }

    fn volume_mm3(
        &self,
        depth_mm: f64,
        [half, width, cosine, sine]: Form<f64>,
        sides_mm: &Sides,
    ) -> f64 {
        let steps = (8.0 * half / width).ceil().clamp(16.0, 1000.0) as usize;
        let volumes = integral(-half, half, steps, |at| {
            gaussian_mm3(1.0, width, &sides_from(sides_mm, [at * cosine, at * sine]))
        });
        depth_mm * volumes / (width * TAU.sqrt() * within(half / width))
    }
}
