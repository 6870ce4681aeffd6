//! Motions of the electrodes: one file a kind of motion, each an implementation of [`Motion`].
//!
//! A lane of the synthesis is a *trajectory*. A motion draws what it starts with; a [`Path`](crate::path::Path) then moves
//! its contact from scan to scan. Without one, a trajectory is one still frame.

use std::collections::BTreeMap;
use std::fmt::Debug;

use serde::Deserialize;
use taxel_data::random::RandomLanes;
use taxel_data::{BadValue, Lanes, Purpose, Stream};

use crate::contact::Contact;
use crate::kinds::kinds;
use crate::profile::Profile;
use crate::sensor::Sensor;

mod dent;
mod independent;
mod mix;

pub use dent::Dent;
pub use independent::Independent;
pub use mix::{Mix, Part};

/// Motion of the electrodes, drawn at random for every trajectory.
///
/// A motion by contacts says what these are; the defaults do the rest. Any other overrides [`place`](Self::place) and
/// [`start`](Self::start).
pub trait Motion: Debug + Send + Sync {
    /// Extreme deformations of any electrode along each axis, in mm: `[axis][low, high]`.
    fn range_mm(&self) -> [[f64; 2]; 3];

    /// Checks the motion's settings.
    fn check(&self) -> Result<(), BadValue>;

    /// Number of independent standard normal numbers that fix a still frame of so many `electrodes`: the *latents*
    /// of the motion. A mix has none: those of its parts differ.
    fn latents(&self, _electrodes: usize) -> usize {
        0
    }

    /// Whether rows move independently, so that [`place`](Self::place) needs only the latents of one row's
    /// electrodes.
    fn has_independent_rows(&self) -> bool {
        false
    }

    /// Writes the deformation in mm of the electrodes of row-wire `row` (from 0) that `latents` stand for, one
    /// frame a lane, by electrode and axis.
    ///
    /// Standard normal latents give the distribution that [`start`](Self::start) draws from.
    ///
    /// # Panics
    /// If there are not as many latents as [`latents`](Self::latents) says.
    fn place(
        &self,
        sensor: &Sensor,
        row: usize,
        latents: &[Lanes],
        deformation_mm: &mut [[Lanes; 3]],
    ) {
        if let Some(contact) = self.place_contact(sensor, latents) {
            contact.deform(sensor.row_electrodes_mm(row), deformation_mm);
        }
    }

    /// Depth in mm down to which a contact may be moved.
    fn deepest_mm(&self) -> f64 {
        self.range_mm()[2][1]
    }

    /// Single Gaussian contact as wide, deep and sheared as this one; `None` for a motion without a contact.
    fn as_press(&self) -> Option<Dent> {
        None
    }

    /// Contact in the middle of the face of `sensor` with the largest radius, depth and shear, in a lane of each kind;
    /// `None` for a motion without a contact.
    fn largest_contact(&self, _sensor: &Sensor) -> Option<Contact> {
        None
    }

    /// Contact that `latents` stand for, one frame a lane; `None` for a motion without a contact.
    ///
    /// # Panics
    /// If there are not as many latents as [`latents`](Self::latents) says.
    fn place_contact(&self, _sensor: &Sensor, _latents: &[Lanes]) -> Option<Contact> {
        None
    }

    /// Draws a contact a lane; `None` for a motion without a contact.
    fn draw_contact(&self, _sensor: &Sensor, _draws: &mut Draws) -> Option<Contact> {
        None
    }

    /// Draws the quantities that all rows and scans of a trajectory share, for
    /// [`LANES`](taxel_data::simd::LANES) trajectories of `sensor`.
    fn start<'m>(&'m self, sensor: &'m Sensor, draws: &mut Draws) -> Box<dyn Trajectories + 'm> {
        Box::new(Contacts { sensor, contact: self.draw_contact(sensor, draws) })
    }
}

/// Trajectories that have been drawn, one a lane.
pub trait Trajectories {
    /// Writes the deformation in mm of the electrodes of row-wire `row` (from 0), by electrode and axis.
    fn deform(&mut self, row: usize, draws: &mut Draws, deformation_mm: &mut [[Lanes; 3]]);

    /// Contact, which keeps its shape wherever it goes; `None` where nothing touches, or for a motion without a contact.
    fn contact(&self) -> Option<&Contact> {
        None
    }

    /// Moves the contact to this centre and depth. Nothing changes for a motion without a contact.
    fn move_to(&mut self, _centre_mm: [Lanes; 2], _depth_mm: Lanes) {}
}

/// Contacts that have been drawn, and the sensor that they are pressed into.
struct Contacts<'m> {
    sensor: &'m Sensor,
    contact: Option<Contact>,
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

/// Random sources of consecutive trajectories, one a lane.
#[derive(Debug, Clone)]
pub struct Draws {
    seed: u64,
    stream: Stream,
    lanes: RandomLanes,
}

impl Draws {
    /// Sources of `stream` for the trajectories from number `first` on.
    pub fn new(seed: u64, stream: Stream, first: usize) -> Self {
        Self { seed, stream, lanes: RandomLanes::new(first) }
    }

    /// Sources for `purpose` and `part` (say a row), at their beginning.
    #[inline(always)]
    pub fn of(&mut self, purpose: Purpose, part: u64) -> &mut RandomLanes {
        self.lanes.start(self.seed, self.stream, purpose, part);
        &mut self.lanes
    }
}

kinds! {
    /// Motion of a scene.
    #[serde(try_from = "Table")]
    Motion: Independent, Dent, Mix
}

/// Motion as it stands in a scene: a contact is named by its profile.
#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Table {
    Independent(Independent),
    Press(BTreeMap<String, [f64; 2]>),
    Punch(BTreeMap<String, [f64; 2]>),
    Edge(BTreeMap<String, [f64; 2]>),
    Ellipse(BTreeMap<String, [f64; 2]>),
    Tail(BTreeMap<String, [f64; 2]>),
    Pair(BTreeMap<String, [f64; 2]>),
    Mix(Mix),
}

impl TryFrom<Table> for Kind {
    type Error = String;

    fn try_from(table: Table) -> Result<Self, String> {
        let (profile, fields) = match table {
            Table::Independent(motion) => return Ok(motion.into()),
            Table::Mix(motion) => return Ok(motion.into()),
            Table::Press(fields) => (Profile::Press, fields),
            Table::Punch(fields) => (Profile::Punch, fields),
            Table::Edge(fields) => (Profile::Edge, fields),
            Table::Ellipse(fields) => (Profile::Ellipse, fields),
            Table::Tail(fields) => (Profile::Tail, fields),
            Table::Pair(fields) => (Profile::Pair, fields),
        };
        Ok(Dent::of_fields(profile, &fields)?.into())
    }
}

/// Checks a uniform distribution's range.
fn check_range(field: &str, [low, high]: [f64; 2]) -> Result<(), BadValue> {
    if low.is_finite() && high.is_finite() && low <= high {
        return Ok(());
    }
    let value = format!("[{low}, {high}]");
    Err(BadValue::new(format!("deformation.{field}"), value, "give [low, high] with low ≤ high"))
}
