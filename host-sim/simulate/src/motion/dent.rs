//! Contacts whose dent has some profile: what they share, and how they are drawn.

#![allow(clippy::needless_range_loop, reason = "lanes of several arrays are indexed alike")]

use std::f64::consts::TAU;
use std::fmt::Debug;

use taxel_data::{
    BadValue, LANES, Lanes, Purpose, exp, normal_share_below, require, sin_cos, widest,
};

use super::{Draws, Motion, Press, Trajectories, check_range};
use crate::contact::{Contact, Form, Profile};
use crate::sensor::{Sensor, Vector3};

/// Kind of contact, centred anywhere on the face.
///
/// Deformation: Δz = d·f(x, y) as seen from the centre, with the profile f, and (Δx, Δy) = μ·Δz·(cos θ, sin θ) with θ
/// uniform on the circle. All other quantities are uniform on their ranges.
pub(super) trait Dent: Debug + Send + Sync {
    /// Ranges of the depth d in mm and of the shear ratio μ.
    fn depth_and_shear(&self) -> [[f64; 2]; 2];

    /// Quantities that fix the dent's form, at most four.
    fn quantities(&self) -> Vec<Quantity>;

    /// Profile f of the dent.
    fn profile(&self) -> &'static dyn Profile;

    /// Form of a dent at this centre on a face of this size, from its quantities.
    fn form(&self, quantities: Form<f64>, _centre_mm: [f64; 2], _size_mm: &Vector3) -> Form<f64> {
        quantities
    }

    /// Range of the radius s in mm of Gaussian dents exp(−ρ²/2s²) that are as wide at half their depth.
    fn gaussian_radius_mm(&self) -> [f64; 2];

    /// Greatest share of the depth anywhere.
    fn most(&self) -> f64 {
        1.0
    }
}

/// Quantity of a dent that is uniform on a range.
pub(super) struct Quantity {
    /// Name of its field.
    pub field: &'static str,
    pub range: [f64; 2],
    /// Values that it may have, and the rule in words.
    pub allowed: (fn(f64) -> bool, &'static str),
}

impl Quantity {
    /// Length in mm, which is positive.
    pub fn length(field: &'static str, range: [f64; 2]) -> Self {
        let allowed = (|mm: f64| mm.is_finite() && mm > 0.0) as fn(f64) -> bool;
        Self { field, range, allowed: (allowed, "it must be a positive number") }
    }

    /// Direction in degrees from x towards y; all of them, uniformly, unless a scene says otherwise.
    pub fn direction(range: Option<[f64; 2]>, all: f64) -> Self {
        let allowed = (|degrees: f64| degrees.abs() <= 360.0) as fn(f64) -> bool;
        let range = range.unwrap_or([0.0, all]);
        Self { field: "direction_deg", range, allowed: (allowed, "it must be from -360 to 360") }
    }

    fn check(&self) -> Result<(), BadValue> {
        let ((is_allowed, rule), [low, high]) = (self.allowed, self.range);
        let field = format!("deformation.{}", self.field);
        require(is_allowed(low), format!("{field} (low)"), format!("{low:?}"), || rule.into())?;
        check_range(self.field, self.range)?;
        require(is_allowed(high), format!("{field} (high)"), format!("{high:?}"), || rule.into())
    }
}

/// Cosine and sine of a direction in degrees.
pub(super) fn of_direction(degrees: f64) -> [f64; 2] {
    let (sine, cosine) = sin_cos(TAU * (degrees / 360.0 - (degrees / 360.0).floor()));
    [cosine, sine]
}

/// Number of latents of a contact besides those of its form: centre, depth, and two of its shear.
const LATENTS: usize = 5;

impl<D: Dent> Motion for D {
    fn range_mm(&self) -> [[f64; 2]; 3] {
        let [[_, depth], [_, ratio]] = self.depth_and_shear();
        let deepest = depth * self.most();
        let shear = deepest * ratio;
        [[-shear, shear], [-shear, shear], [0.0, deepest]]
    }

    fn deepest_mm(&self) -> f64 {
        self.depth_and_shear()[0][1]
    }

    fn check(&self) -> Result<(), BadValue> {
        self.quantities().iter().try_for_each(Quantity::check)?;
        let [depth_mm, shear_ratio] = self.depth_and_shear();
        for (field, range, rule) in [
            ("dent_depth_mm", depth_mm, "a depth is not negative"),
            ("shear_ratio", shear_ratio, "a ratio is not negative"),
        ] {
            let holds = !(range[0].is_nan() || range[0] < 0.0);
            require(holds, format!("deformation.{field}"), format!("{range:?}"), || rule.into())?;
            check_range(field, range)?;
        }
        Ok(())
    }

    fn latents(&self, _electrodes: usize) -> usize {
        LATENTS + self.quantities().len()
    }

    fn as_press(&self) -> Option<Press> {
        let [dent_depth_mm, shear_ratio] = self.depth_and_shear();
        Some(Press { dent_radius_mm: self.gaussian_radius_mm(), dent_depth_mm, shear_ratio })
    }

    fn largest_contact(&self, sensor: &Sensor) -> Option<Contact> {
        let [[_, depth], [_, ratio]] = self.depth_and_shear();
        let highest = self.quantities().into_iter().map(|quantity| quantity.range[1]);
        let [x_mm, y_mm, _] = sensor.size_mm;
        let values = [0.5 * x_mm, 0.5 * y_mm].into_iter().chain(highest).chain([depth]);
        let values: Vec<Lanes> = values.map(|value| [value; LANES]).collect();
        Some(contact(self, &values, &[[ratio; LANES]; 2], sensor))
    }

    /// There is a latent each for the centre's x and y, the quantities of the form and the depth, and two for the shear.
    /// These two are a vector in the shear's direction, so nothing jumps at θ = 2π.
    fn place_contact(&self, sensor: &Sensor, latents: &[Lanes]) -> Option<Contact> {
        let [_, [low, high]] = self.depth_and_shear();
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
        Some(from_units(self, units, &shear, sensor))
    }

    fn draw_contact(&self, sensor: &Sensor, draws: &mut Draws) -> Option<Contact> {
        let (mut units, mut shear) =
            (vec![[0.0; LANES]; 3 + self.quantities().len()], [[0.0; LANES]; 2]);
        let [_, ratio] = self.depth_and_shear();
        widest!({
            let random = draws.of(Purpose::Contact, 0);
            for unit in &mut units {
                random.between([[0.0, 1.0]], std::array::from_mut(unit));
            }
            let mut drawn = [[0.0; LANES]; 2];
            random.between([ratio, [0.0, 1.0]], &mut drawn);
            let [ratios, turns] = drawn;
            for frame in 0..LANES {
                let (sine, cosine) = sin_cos(TAU * turns[frame]);
                shear[0][frame] = ratios[frame] * cosine;
                shear[1][frame] = ratios[frame] * sine;
            }
        });
        Some(from_units(self, units, &shear, sensor))
    }
}

/// Contact from numbers on [0, 1]: one each for the centre's x and y, the quantities of the form, and the depth.
fn from_units<D: Dent>(
    dent: &D,
    mut units: Vec<Lanes>,
    shear: &[Lanes; 2],
    sensor: &Sensor,
) -> Contact {
    let [x_mm, y_mm, _] = sensor.size_mm;
    let own = dent.quantities().into_iter().map(|quantity| quantity.range);
    let ranges =
        [[0.0, x_mm], [0.0, y_mm]].into_iter().chain(own).chain([dent.depth_and_shear()[0]]);
    for (unit, [low, high]) in units.iter_mut().zip(ranges) {
        unit.iter_mut().for_each(|unit| *unit = low + (high - low) * *unit);
    }
    contact(dent, &units, shear, sensor)
}

/// Contact with these values: its centre's x and y, the quantities of its form, and the depth.
fn contact<D: Dent>(dent: &D, values: &[Lanes], shear: &[Lanes; 2], sensor: &Sensor) -> Contact {
    let [x_mm, y_mm, quantities @ .., depth_mm] = values else { unreachable!("a depth at least") };
    let mut form: Form = [[0.0; LANES]; 4];
    for frame in 0..LANES {
        let mut of_frame = [0.0; 4];
        of_frame.iter_mut().zip(quantities).for_each(|(number, lanes)| *number = lanes[frame]);
        let of_frame = dent.form(of_frame, [x_mm[frame], y_mm[frame]], &sensor.size_mm);
        form.iter_mut().zip(of_frame).for_each(|(lanes, number)| lanes[frame] = number);
    }
    Contact {
        centre_mm: [*x_mm, *y_mm],
        dent_depth_mm: *depth_mm,
        shear: *shear,
        form,
        profiles: vec![dent.profile()],
        profile_of: [0; LANES],
    }
}

/// Contacts that have been drawn, and the sensor that they are pressed into.
pub(super) struct Contacts<'m> {
    pub sensor: &'m Sensor,
    pub contact: Option<Contact>,
}

impl Trajectories for Contacts<'_> {
    fn deform(&mut self, row: usize, _: &mut Draws, deformation_mm: &mut [[Lanes; 3]]) {
        if let Some(contact) = &self.contact {
            contact.deform(self.sensor.row_electrodes_mm(row), deformation_mm);
        }
    }

    fn contact(&self) -> Option<&Contact> {
        self.contact.as_ref()
    }

    fn move_to(&mut self, centre_mm: [Lanes; 2], depth_mm: Lanes) {
        if let Some(contact) = &mut self.contact {
            contact.centre_mm = centre_mm;
            contact.dent_depth_mm = depth_mm;
        }
    }
}

#[cfg(test)]
mod tests;
