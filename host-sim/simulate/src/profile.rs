//! Profiles of dents: how deep a dent is at each place, as a share of its depth at the centre.

#![allow(clippy::needless_range_loop, reason = "lanes of several arrays are indexed alike")]

use std::f64::consts::{LN_2, TAU};

use taxel_data::{BadValue, LANES, Lanes, exp, normal_share_below, require, sin_cos};

use crate::sensor::Vector3;

/// Four numbers that fix a dent's form; a profile may need fewer.
pub type Form<T = f64> = [T; 4];

/// Profile f of a dent, by the name that a scene gives it. ρ is the distance from the centre; u lies along the line or the
/// longer radius, v across it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// Gaussian: exp(−ρ²/2s²) with the radius s.
    Press,
    /// Flat round punch: 1 within its radius a, and exp(−(ρ − a)/w) outside, as a surface decays beside a straight edge on
    /// Pasternak's foundation (Kerr, "Elastic and viscoelastic foundation models", 1964).
    Punch,
    /// Edge: Gaussian dents of radius w side by side along a line of length l, exp(−v²/2w²)·[Φ((u + l/2)/w) −
    /// Φ((u − l/2)/w)] over its value at the centre.
    Edge,
    /// Ellipse: exp(−u²/2s₁² − v²/2s₂²) with the radii s₁ = s·√q and s₂ = s/√q, so of the same volume as a round dent of
    /// radius s.
    Ellipse,
    /// Long tail: (1 + ρ²/s²)^(−5/2). That is Boussinesq's pressure below a point force on an elastic cover of thickness s
    /// (K. L. Johnson, *Contact Mechanics*, 1985, §3.2), on a foundation whose compression follows the pressure. It falls
    /// with the fifth power of the distance, where a Gaussian dent has long vanished.
    Tail,
    /// Two Gaussian dents that add up; centre, depth and shear are those of the first. The second lies at a distance in a
    /// direction, mirrored along x or y where it would leave the face.
    Pair,
}

/// Quantity that fixes a dent's form: a field of a scene, with a range.
#[derive(Debug, Clone, Copy)]
pub struct Quantity {
    /// Name of the field.
    pub field: &'static str,
    /// Range of a scene that leaves it out; `None` if it may not.
    pub default: Option<[f64; 2]>,
    /// Least and greatest value, and the rule in words.
    allowed: ([f64; 2], &'static str),
}

impl Quantity {
    /// Length in mm, which is positive.
    const fn length(field: &'static str) -> Self {
        let allowed = ([f64::MIN_POSITIVE, f64::MAX], "it must be a positive number");
        Self { field, default: None, allowed }
    }

    /// Direction in degrees from x towards y; all of them, unless a scene says otherwise.
    const fn direction(all: f64) -> Self {
        let allowed = ([-360.0, 360.0], "it must be from -360 to 360");
        Self { field: "direction_deg", default: Some([0.0, all]), allowed }
    }

    /// Checks a range of values.
    pub fn check(&self, [low, high]: [f64; 2]) -> Result<(), BadValue> {
        let ([least, most], rule) = self.allowed;
        for (value, end) in [(low, "low"), (high, "high")] {
            let field = format!("deformation.{} ({end})", self.field);
            let holds = (least..=most).contains(&value);
            require(holds, field, format!("{value:?}"), || rule.into())?;
        }
        Ok(())
    }
}

const RADIUS: Quantity = Quantity::length("dent_radius_mm");
const ASPECT_RATIO: Quantity = Quantity {
    field: "aspect_ratio",
    default: None,
    allowed: ([1.0, 100.0], "it must be from 1 to 100"),
};
const DEPTH_RATIO: Quantity = Quantity {
    field: "second_depth_ratio",
    default: None,
    allowed: ([0.0, 1.0], "it must be from 0 to 1; the first dent is the deeper one"),
};
/// Radius of the Gaussian dent that is as wide at half its depth as a tail, over the cover's thickness.
const OF_COVER: f64 = 0.480_1;
/// Deviations, and lengths of decay, beyond which a dent has less than 1e-6 and 1e-3 of its volume.
const GAUSSIAN_REACH: f64 = 5.7;
const DECAY_REACH: f64 = 10.0;

impl Profile {
    /// All profiles.
    pub const ALL: [Self; 6] =
        [Self::Press, Self::Punch, Self::Edge, Self::Ellipse, Self::Tail, Self::Pair];

    /// Name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Press => "press",
            Self::Punch => "punch",
            Self::Edge => "edge",
            Self::Ellipse => "ellipse",
            Self::Tail => "tail",
            Self::Pair => "pair",
        }
    }

    /// Quantities that fix the form, in the order in which they are drawn.
    pub fn quantities(self) -> &'static [Quantity] {
        const PUNCH: [Quantity; 2] =
            [Quantity::length("punch_radius_mm"), Quantity::length("decay_mm")];
        const EDGE: [Quantity; 3] = [
            Quantity::length("edge_length_mm"),
            Quantity::length("edge_width_mm"),
            Quantity::direction(180.0),
        ];
        const ELLIPSE: [Quantity; 3] = [RADIUS, ASPECT_RATIO, Quantity::direction(180.0)];
        const PAIR: [Quantity; 4] =
            [RADIUS, Quantity::length("distance_mm"), Quantity::direction(360.0), DEPTH_RATIO];
        match self {
            Self::Press => &[RADIUS],
            Self::Punch => &PUNCH,
            Self::Edge => &EDGE,
            Self::Ellipse => &ELLIPSE,
            Self::Tail => const { &[Quantity::length("cover_mm")] },
            Self::Pair => &PAIR,
        }
    }

    /// Form of a dent with these quantities, at this centre on a face of this size.
    pub fn form(self, quantities: Form, centre_mm: [f64; 2], size_mm: &Vector3) -> Form {
        let [first, second, degrees, ratio] = quantities;
        let turns = degrees / 360.0;
        let (sine, cosine) = sin_cos(TAU * (turns - turns.floor()));
        match self {
            Self::Press | Self::Punch | Self::Tail => quantities,
            Self::Edge => [0.5 * first, second, cosine, sine],
            Self::Ellipse => [first * second.sqrt(), first / second.sqrt(), cosine, sine],
            Self::Pair => {
                let direction = [cosine, sine];
                let [x, y] = [0, 1].map(|axis| {
                    let offset = second * direction[axis];
                    let on_face =
                        |offset: f64| (0.0..=size_mm[axis]).contains(&(centre_mm[axis] + offset));
                    if !on_face(offset) && on_face(-offset) { -offset } else { offset }
                });
                [first, x, y, ratio]
            }
        }
    }

    /// Share of the depth in each lane, at these distances in mm from the centre along x and y.
    #[inline(always)]
    pub fn shares(self, form: &Form<Lanes>, offset_mm: &[Lanes; 2]) -> Lanes {
        match self {
            Self::Press => each(form, offset_mm, |[radius, ..], x, y| {
                exp(-(x * x + y * y) / (2.0 * radius * radius))
            }),
            Self::Punch => each(form, offset_mm, |[radius, decay, ..], x, y| {
                exp(-((x * x + y * y).sqrt() - radius).max(0.0) / decay)
            }),
            Self::Edge => each(form, offset_mm, |[half, width, cosine, sine], x, y| {
                let along = cosine * x + sine * y;
                let across = cosine * y - sine * x;
                let of_line = normal_share_below((along + half) / width)
                    - normal_share_below((along - half) / width);
                let across = exp(-across * across / (2.0 * width * width));
                across * of_line / (2.0 * normal_share_below(half / width) - 1.0)
            }),
            Self::Ellipse => each(form, offset_mm, |[long, short, cosine, sine], x, y| {
                let along = (cosine * x + sine * y) / long;
                let across = (cosine * y - sine * x) / short;
                exp(-0.5 * (along * along + across * across))
            }),
            Self::Tail => each(form, offset_mm, |[cover, ..], x, y| {
                let (x, y) = (x / cover, y / cover);
                let far = 1.0 + x * x + y * y;
                1.0 / (far * far * far.sqrt())
            }),
            Self::Pair => each(form, offset_mm, |[radius, to_x, to_y, ratio], x, y| {
                let (to_x, to_y) = (x - to_x, y - to_y);
                let of = |squares: f64| exp(-squares / (2.0 * radius * radius));
                of(x * x + y * y) + ratio * of(to_x * to_x + to_y * to_y)
            }),
        }
    }

    /// Distances in mm from the centre within which the dent lies, along x and y: `[axis][low, high]`.
    pub fn reach_mm(self, form: Form) -> [[f64; 2]; 2] {
        let [first, second, third, fourth] = form;
        let around = |mm: [f64; 2]| mm.map(|mm| [-mm, mm]);
        let round = |mm: f64| around([mm, mm]);
        match self {
            Self::Press => round(GAUSSIAN_REACH * first),
            Self::Punch => round(first + DECAY_REACH * second),
            Self::Edge => {
                around([third, fourth].map(|of| of.abs() * first + GAUSSIAN_REACH * second))
            }
            Self::Ellipse => {
                let along = |of: [f64; 2]| GAUSSIAN_REACH * (of[0] * first).hypot(of[1] * second);
                around([along([third, fourth]), along([fourth, third])])
            }
            Self::Tail => round(f64::INFINITY),
            Self::Pair => {
                let mm = GAUSSIAN_REACH * first;
                [second, third].map(|to| [to.min(0.0) - mm, to.max(0.0) + mm])
            }
        }
    }

    /// Radius s in mm of the Gaussian dent exp(−ρ²/2s²) that is as wide at half its depth.
    pub fn gaussian_radius_mm(self, quantities: Form) -> f64 {
        let [first, second, ..] = quantities;
        match self {
            Self::Press | Self::Ellipse | Self::Pair => first,
            Self::Punch => (first + second * LN_2) / (2.0 * LN_2).sqrt(),
            Self::Edge => second,
            Self::Tail => OF_COVER * first,
        }
    }

    /// Greatest share of the depth anywhere, for quantities in these ranges.
    pub fn most(self, [radius_mm, distance_mm, _, ratio]: Form<[f64; 2]>) -> f64 {
        if self != Self::Pair {
            return 1.0;
        }
        // At every place one of both centres is half their distance away, or farther.
        1.0 + ratio[1] * exp(-(distance_mm[0] / radius_mm[1]).powi(2) / 8.0)
    }
}

/// Share in each lane, by its form and its distances along x and y.
#[inline(always)]
fn each(
    form: &Form<Lanes>,
    [x_mm, y_mm]: &[Lanes; 2],
    share: impl Fn(Form, f64, f64) -> f64,
) -> Lanes {
    let mut shares = [0.0; LANES];
    for frame in 0..LANES {
        let form = form.each_ref().map(|numbers| numbers[frame]);
        shares[frame] = share(form, x_mm[frame], y_mm[frame]);
    }
    shares
}
