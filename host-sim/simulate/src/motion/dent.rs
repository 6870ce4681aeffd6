//! Motion by one contact, whose dent has some profile.

#![allow(clippy::needless_range_loop, reason = "lanes of several arrays are indexed alike")]

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use taxel_data::{
    BadValue, LANES, Lanes, Purpose, exp, normal_share_below, require, sin_cos, widest,
};

use super::{Draws, Motion, check_range};
use crate::contact::Contact;
use crate::profile::{Form, Profile};
use crate::sensor::Sensor;

/// One contact, centred anywhere on the face.
///
/// Deformation: Δz = d·f(x, y) as seen from the centre, with the profile f, and (Δx, Δy) = μ·Δz·(cos θ, sin θ) with θ
/// uniform on the circle. All other quantities are uniform on their ranges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dent {
    /// Profile f of the dent.
    pub profile: Profile,
    /// Ranges of the [quantities](Profile::quantities) that fix its form; what it does not have is 0.
    pub quantities: Form<[f64; 2]>,
    /// Range of the depth d in mm.
    pub dent_depth_mm: [f64; 2],
    /// Range of the shear ratio μ.
    pub shear_ratio: [f64; 2],
}

/// Number of latents of a contact besides those of its form: centre, depth, and two of its shear.
const LATENTS: usize = 5;

impl Dent {
    /// Contact of this `profile` with these ranges of its quantities, its depth in mm and its shear ratio.
    ///
    /// # Panics
    /// If there is not a range for each quantity.
    pub fn new(
        profile: Profile,
        ranges: &[[f64; 2]],
        [dent_depth_mm, shear_ratio]: [[f64; 2]; 2],
    ) -> Self {
        let mut quantities = [[0.0; 2]; 4];
        quantities[..profile.quantities().len()].copy_from_slice(ranges);
        Self { profile, quantities, dent_depth_mm, shear_ratio }
    }

    /// Contact of this `profile` with the ranges of a scene, by field.
    pub(super) fn of_fields(
        profile: Profile,
        fields: &BTreeMap<String, [f64; 2]>,
    ) -> Result<Self, String> {
        let of_form = profile.quantities().iter().map(|it| (it.field, it.default));
        let wanted = of_form.chain([("dent_depth_mm", None), ("shear_ratio", None)]);
        let wanted: Vec<(&str, Option<[f64; 2]>)> = wanted.collect();
        if let Some(name) = fields.keys().find(|name| wanted.iter().all(|it| it.0 != *name)) {
            let names: Vec<String> = wanted.iter().map(|(name, _)| format!("`{name}`")).collect();
            return Err(format!("unknown field `{name}`, expected {}", names.join(", ")));
        }
        let range = |(name, default): &(&str, Option<[f64; 2]>)| {
            let range = fields.get(*name).copied().or(*default);
            range.ok_or_else(|| format!("missing field `{name}`"))
        };
        let ranges = wanted.iter().map(range).collect::<Result<Vec<_>, _>>()?;
        let (of_form, depth_and_shear) = ranges.split_at(profile.quantities().len());
        Ok(Self::new(profile, of_form, [depth_and_shear[0], depth_and_shear[1]]))
    }

    /// Contact from numbers on [0, 1]: one each for the centre's x and y, the quantities of the form, and the depth.
    ///
    /// # Panics
    /// If there are fewer.
    pub fn of_units(&self, mut units: Vec<Lanes>, shear: &[Lanes; 2], sensor: &Sensor) -> Contact {
        let [x_mm, y_mm, _] = sensor.size_mm;
        let of_form = &self.quantities[..self.profile.quantities().len()];
        let ranges = [&[[0.0, x_mm], [0.0, y_mm]], of_form, &[self.dent_depth_mm]].concat();
        for (unit, [low, high]) in units.iter_mut().zip(ranges) {
            unit.iter_mut().for_each(|unit| *unit = low + (high - low) * *unit);
        }
        let [x_mm, y_mm, quantities @ .., depth_mm] = &units[..] else {
            unreachable!("a depth at least")
        };
        let mut form = [[0.0; LANES]; 4];
        for frame in 0..LANES {
            let mut of_frame = [0.0; 4];
            of_frame.iter_mut().zip(quantities).for_each(|(number, lanes)| *number = lanes[frame]);
            let of_frame = self.profile.form(of_frame, [x_mm[frame], y_mm[frame]], &sensor.size_mm);
            form.iter_mut().zip(of_frame).for_each(|(lanes, number)| lanes[frame] = number);
        }
        Contact {
            centre_mm: [*x_mm, *y_mm],
            dent_depth_mm: *depth_mm,
            shear: *shear,
            profile: [self.profile; LANES],
            form,
        }
    }
}

impl Motion for Dent {
    fn range_mm(&self) -> [[f64; 2]; 3] {
        let deepest = self.dent_depth_mm[1] * self.profile.most(self.quantities);
        let shear = deepest * self.shear_ratio[1];
        [[-shear, shear], [-shear, shear], [0.0, deepest]]
    }

    fn deepest_mm(&self) -> f64 {
        self.dent_depth_mm[1]
    }

    fn check(&self) -> Result<(), BadValue> {
        for (quantity, range) in self.profile.quantities().iter().zip(self.quantities) {
            quantity.check(range)?;
            check_range(quantity.field, range)?;
        }
        for (field, range, rule) in [
            ("dent_depth_mm", self.dent_depth_mm, "a depth is not negative"),
            ("shear_ratio", self.shear_ratio, "a ratio is not negative"),
        ] {
            let holds = !(range[0].is_nan() || range[0] < 0.0);
            require(holds, format!("deformation.{field}"), format!("{range:?}"), || rule.into())?;
            check_range(field, range)?;
        }
        Ok(())
    }

    fn latents(&self, _electrodes: usize) -> usize {
        LATENTS + self.profile.quantities().len()
    }

    fn as_press(&self) -> Option<Self> {
        let end = |end: usize| self.quantities.map(|range| range[end]);
        let radius_mm = [0, 1].map(|it| self.profile.gaussian_radius_mm(end(it)));
        Some(Self::new(Profile::Press, &[radius_mm], [self.dent_depth_mm, self.shear_ratio]))
    }

    fn largest_contact(&self, sensor: &Sensor) -> Option<Contact> {
        let mut units = vec![[1.0; LANES]; 3 + self.profile.quantities().len()];
        units[..2].fill([0.5; LANES]);
        Some(self.of_units(units, &[[self.shear_ratio[1]; LANES]; 2], sensor))
    }

    /// There is a latent each for the centre's x and y, the quantities of the form and the depth, and two for the shear.
    /// These two are a vector in the shear's direction, so nothing jumps at θ = 2π.
    fn place_contact(&self, sensor: &Sensor, latents: &[Lanes]) -> Option<Contact> {
        let [low, high] = self.shear_ratio;
        let (mut units, mut shear) = (latents[..self.latents(0) - 2].to_vec(), [[0.0; LANES]; 2]);
        let across = &latents[units.len()..][..2];
        widest!({
            for unit in units.as_flattened_mut() {
                *unit = normal_share_below(*unit);
            }
            for frame in 0..LANES {
                let (x, y) = (across[0][frame], across[1][frame]);
                let squared = x * x + y * y;
                // 1 − exp(−½r²) is uniform; the square is kept from 0, where the direction does not exist.
                let ratio = low + (high - low) * (1.0 - exp(-0.5 * squared));
                let factor = ratio / squared.max(1e-300).sqrt();
                shear[0][frame] = factor * x;
                shear[1][frame] = factor * y;
            }
        });
        Some(self.of_units(units, &shear, sensor))
    }

    fn draw_contact(&self, sensor: &Sensor, draws: &mut Draws) -> Option<Contact> {
        let mut units = vec![[0.0; LANES]; 3 + self.profile.quantities().len()];
        let mut shear = [[0.0; LANES]; 2];
        widest!({
            let random = draws.of(Purpose::Contact, 0);
            for unit in &mut units {
                random.between([[0.0, 1.0]], std::array::from_mut(unit));
            }
            let mut drawn = [[0.0; LANES]; 2];
            random.between([self.shear_ratio, [0.0, 1.0]], &mut drawn);
            let [ratios, turns] = drawn;
            for frame in 0..LANES {
                let (sine, cosine) = sin_cos(TAU * turns[frame]);
                shear[0][frame] = ratios[frame] * cosine;
                shear[1][frame] = ratios[frame] * sine;
            }
        });
        Some(self.of_units(units, &shear, sensor))
    }
}
