//! Motion by contacts of several kinds: each trajectory has one of them.

use serde::Deserialize;
use taxel_data::{BadValue, LANES, Lanes, Purpose, require, widest};

use super::{Dent, Draws, Kind, Motion};
use crate::contact::Contact;
use crate::sensor::Sensor;

/// Mix of contacts: each trajectory has one of the parts, by their weights.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mix {
    pub parts: Vec<Part>,
}

/// Part of a mix.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Part {
    /// How often it is drawn: its share in the sum of all weights.
    pub weight: f64,
    /// Contact of a kind that is no mix itself.
    #[serde(flatten)]
    pub deformation: Kind,
}

/// Most parts of a mix.
const MOST_PARTS: usize = 16;

impl Mix {
    /// Number of the part that each number on [0, 1] stands for.
    fn parts_of(&self, units: &Lanes) -> Lanes<u8> {
        let whole: f64 = self.parts.iter().map(|part| part.weight).sum();
        let mut which = [0; LANES];
        let mut below = 0.0;
        for part in &self.parts[..self.parts.len() - 1] {
            below += part.weight / whole;
            which
                .iter_mut()
                .zip(units)
                .for_each(|(which, unit)| *which += u8::from(*unit >= below));
        }
        which
    }

    /// Contact of each part, as `of` gives it, in the lanes that have this part.
    fn pick(&self, which: Lanes<u8>, of: impl FnMut(&Part) -> Option<Contact>) -> Option<Contact> {
        let contacts: Option<Vec<Contact>> = self.parts.iter().map(of).collect();
        Some(Contact::pick(&contacts?, which))
    }
}

impl Motion for Mix {
    fn range_mm(&self) -> [[f64; 2]; 3] {
        let mut whole = [[0.0_f64; 2]; 3];
        for part in &self.parts {
            for (whole, [low, high]) in whole.iter_mut().zip(part.deformation.range_mm()) {
                *whole = [whole[0].min(low), whole[1].max(high)];
            }
        }
        whole
    }

    fn deepest_mm(&self) -> f64 {
        let of_parts = self.parts.iter().map(|part| part.deformation.deepest_mm());
        of_parts.fold(f64::INFINITY, f64::min)
    }

    fn check(&self) -> Result<(), BadValue> {
        let (field, count) = ("deformation.parts", self.parts.len());
        require((1..=MOST_PARTS).contains(&count), field, format!("{count} parts"), || {
            format!("give from 1 to {MOST_PARTS} parts, each with a weight and a kind")
        })?;
        for (number, part) in (1..).zip(&self.parts) {
            let field = |name: &str| format!("deformation.parts ({number}){name}");
            let (weight, is_mix) = (part.weight, matches!(part.deformation, Kind::Mix(_)));
            require(
                (1e-6..=1e6).contains(&weight),
                field(".weight"),
                format!("{weight:?}"),
                || "it must be from 1e-6 to 1e6".into(),
            )?;
            let is_contact = !is_mix && part.deformation.as_press().is_some();
            require(
                is_contact,
                field(".kind"),
                if is_mix { "mix" } else { "independent" },
                || "a mix consists of contacts; give another kind, such as press or punch".into(),
            )?;
            part.deformation.check().map_err(|bad| {
                let name = field(bad.field.trim_start_matches("deformation"));
                bad.named(name)
            })?;
        }
        Ok(())
    }

    /// Contact of the part with the largest weight.
    fn as_press(&self) -> Option<Dent> {
        let first = self.parts.iter().rev().max_by(|a, b| a.weight.total_cmp(&b.weight))?;
        first.deformation.as_press()
    }

    fn largest_contact(&self, sensor: &Sensor) -> Option<Contact> {
        let which = std::array::from_fn(|lane| (lane % self.parts.len()) as u8);
        self.pick(which, |part| part.deformation.largest_contact(sensor))
    }

    fn draw_contact(&self, sensor: &Sensor, draws: &mut Draws) -> Option<Contact> {
        let mut units = [0.0; LANES];
        widest!({
            draws.of(Purpose::Contact, 1).between([[0.0, 1.0]], std::array::from_mut(&mut units));
        });
        self.pick(self.parts_of(&units), |part| part.deformation.draw_contact(sensor, draws))
    }
}
