//! Other contacts than those of a scene, which its model was not trained on.

use serde::Deserialize;
use taxel_data::{BadValue, require};
use taxel_simulate::motion::{Dent, Kind};
use taxel_simulate::profile::Profile;
use taxel_simulate::{World, rubber};

/// Contact that a model was not trained on.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct OtherContact {
    pub name: String,
    #[serde(flatten)]
    pub deformation: Kind,
}

/// Factors on the least radius for smaller contacts, and on the largest for larger ones. The latter stretch the shear too.
const SMALLER: [f64; 2] = [0.5, 0.8];
const LARGER: [f64; 2] = [1.2, 1.8];
/// Radius of a Gaussian dent over the thickness of the cover whose dent is as wide.
const OF_COVER: f64 = 0.48;
/// Most other contacts of a scene, and the longest name of one.
const MOST: usize = 16;
const LONGEST_NAME: usize = 24;

/// Contacts that a robot may meet besides those of `world`, from the ranges of its own; none for a world without a contact.
/// What the sensor model does not hold for, or lacks a wanted output, is left out.
pub(super) fn derived(world: &World) -> Vec<OtherContact> {
    let Some(own) = world.motion.as_press() else { return vec![] };
    let Dent { quantities: [radius_mm, ..], dent_depth_mm, shear_ratio, .. } = own;
    let [least_mm, most_mm] = radius_mm;
    let [x_mm, y_mm, _] = world.sensor.size_mm;
    let apart_mm = [0.4, 0.5].map(|share| share * x_mm.min(y_mm));
    // Two dents together are no deeper than one of the scene.
    let overlap = (-(apart_mm[0] / most_mm).powi(2) / 8.0).exp();
    let pair_depth_mm = dent_depth_mm.map(|mm| mm / (1.0 + overlap));
    let of =
        |profile, ranges: &[[f64; 2]]| Dent::new(profile, ranges, [dent_depth_mm, shear_ratio]);
    let (half_turn, turn) = ([0.0, 180.0], [0.0, 360.0]);
    let contacts: [(&str, Dent); 8] = [
        ("smaller radii", of(Profile::Press, &[SMALLER.map(|by| by * least_mm)])),
        ("larger radii", of(Profile::Press, &[LARGER.map(|by| by * most_mm)])),
        ("more shear", Dent { shear_ratio: LARGER.map(|by| by * shear_ratio[1]), ..own }),
        ("flat punch", of(Profile::Punch, &[radius_mm, [0.2 * least_mm, 0.5 * least_mm]])),
        (
            "edge",
            of(
                Profile::Edge,
                &[[1.5 * most_mm, 3.0 * most_mm], [0.5 * least_mm, least_mm], half_turn],
            ),
        ),
        ("ellipse", of(Profile::Ellipse, &[radius_mm, [1.5, 3.0], half_turn])),
        ("long tail", of(Profile::Tail, &[radius_mm.map(|mm| mm / OF_COVER)])),
        (
            "two contacts",
            Dent {
                dent_depth_mm: pair_depth_mm,
                ..of(Profile::Pair, &[radius_mm, apart_mm, turn, [0.5, 1.0]])
            },
        ),
    ];
    let contacts =
        contacts.into_iter().filter(|(name, _)| *name != "more shear" || shear_ratio[1] > 0.0);
    let contacts =
        contacts.map(|(name, dent)| OtherContact { name: name.into(), deformation: dent.into() });
    contacts.filter(|other| other.world(world).check().is_ok()).collect()
}

impl OtherContact {
    /// World of these contacts, still ones under elastic rubber, instead of those of `world`.
    fn world(&self, world: &World) -> World {
        let (motion, rubber) = (self.deformation.clone(), rubber::Kind::default());
        World { motion, rubber, path: None, ..world.clone() }
    }
}

/// Checks the other contacts that a scene of this `world` gives.
pub(super) fn check(others: &[OtherContact], world: &World) -> Result<(), BadValue> {
    let count = others.len();
    require(count <= MOST, "others", format!("{count} contacts"), || {
        format!("give at most {MOST}")
    })?;
    let has_contact = others.is_empty() || world.motion.as_press().is_some();
    require(has_contact, "others", "[[others]]", || {
        "electrodes that move independently have no contact to compare others with; leave it out"
            .into()
    })?;
    for (number, other) in (1..).zip(others) {
        let field = |name: &str| format!("others ({number}).{name}");
        let is_new = others[..number - 1].iter().all(|before| before.name != other.name);
        let holds = is_new && (1..=LONGEST_NAME).contains(&other.name.chars().count());
        require(holds, field("name"), format!("{:?}", other.name), || {
            format!("give each a name of its own, of at most {LONGEST_NAME} characters")
        })?;
        require(other.deformation.as_press().is_some(), field("kind"), "independent", || {
            "give a kind of contact, such as press or punch".into()
        })?;
        other.world(world).check().map_err(|bad| {
            let name = field(bad.field.trim_start_matches("deformation").trim_start_matches('.'));
            bad.named(name)
        })?;
    }
    Ok(())
}
