//! Scene as it stands in its file, before defaults are filled in.

use serde::Deserialize;
use taxel_data::digest::digest;
use taxel_data::{BadValue, require};
use taxel_simulate::World;
use taxel_simulate::drift::Drift;
use taxel_simulate::motion;
use taxel_simulate::noise::Noise;
use taxel_simulate::outputs::Outputs;
use taxel_simulate::path::Path;
use taxel_simulate::rubber;
use taxel_simulate::sensor::{self, Sensor, Vector3};
use taxel_simulate::world::check_counts;

use super::others::{self, OtherContact};
use super::{Experiment, Table1};
use crate::training_options::{Training, TrainingOptions};

/// Number of frames to train on, unless a scene says otherwise.
const USUAL_FRAMES: usize = 20_000;
/// Number of frames to judge by, unless a scene says otherwise.
const USUAL_TEST_FRAMES: usize = 8000;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneFile {
    name: String,
    #[serde(default = "default_seed")]
    seed: u64,
    sensor: SensorFile,
    deformation: motion::Kind,
    motion: Option<Path>,
    #[serde(default)]
    rubber: rubber::Kind,
    noise: Noise,
    drift: Option<Drift>,
    #[serde(default)]
    readout: Readout,
    outputs: Outputs,
    #[serde(default)]
    training: TrainingOptions,
    table1: Option<Table1>,
    others: Option<Vec<OtherContact>>,
}

/// Wires that are read.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Readout {
    /// Row-wires, from 1.
    row_wires: Option<Vec<usize>>,
    /// Column-wires, from 1.
    column_wires: Option<Vec<usize>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SensorFile {
    row_wires: usize,
    electrodes_per_row_wire: usize,
    column_wires: usize,
    electrodes_per_column_wire: usize,
    size_mm: Option<Vector3>,
    /// Distance of neighbouring wires in mm, which gives the face's extent instead of `size_mm`.
    pitch_mm: Option<f64>,
    /// Distance of neighbouring column-wires, along x, instead of `pitch_mm`.
    pitch_x_mm: Option<f64>,
    /// Distance of neighbouring row-wires, along y, instead of `pitch_mm`.
    pitch_y_mm: Option<f64>,
    /// Number of places along x that the electrodes of neighbouring row-wires take in turn.
    #[serde(default = "one")]
    upper_stagger: usize,
    /// Number of places along y that the electrodes of neighbouring column-wires take in turn.
    #[serde(default = "one")]
    lower_stagger: usize,
    /// Thickness in mm, instead of that of `size_mm`.
    thickness_mm: Option<f64>,
    resistance_ohm_per_mm: f64,
    #[serde(default = "default_stiffness")]
    stiffness_n_per_mm: Vector3,
    upper_electrodes_mm: Option<Vec<Vector3>>,
    lower_electrodes_mm: Option<Vec<Vector3>>,
}

impl SensorFile {
    /// Extent in mm, from `size_mm`, the pitch of the wires and the thickness.
    fn extent_mm(&self) -> Result<Vector3, BadValue> {
        let missing = |field: &str, give: &str| {
            let rule =
                format!("it is missing; give {give}, or sensor.size_mm with all three extents");
            BadValue::new(format!("sensor.{field}"), "nothing", rule)
        };
        let given = |at: usize| self.size_mm.map(|size_mm| size_mm[at]);
        let face = |at: usize, wires: usize, own: Option<f64>, own_field: &str| {
            let field = if own.is_some() { own_field } else { "pitch_mm" };
            match own.or(self.pitch_mm) {
                Some(pitch_mm) => {
                    let allowed = pitch_mm.is_finite() && pitch_mm > 0.0;
                    let rule = || "give a positive length".into();
                    require(allowed, format!("sensor.{field}"), pitch_mm, rule)?;
                    Ok(wires as f64 * pitch_mm)
                }
                None => given(at).ok_or_else(|| missing(own_field, "it, sensor.pitch_mm")),
            }
        };
        let thickness_mm = self.thickness_mm.or_else(|| given(2));
        let thickness_mm = thickness_mm.ok_or_else(|| missing("thickness_mm", "it"))?;
        let x_mm = face(0, self.column_wires, self.pitch_x_mm, "pitch_x_mm")?;
        let y_mm = face(1, self.row_wires, self.pitch_y_mm, "pitch_y_mm")?;
        Ok([x_mm, y_mm, thickness_mm])
    }
}

fn default_seed() -> u64 {
    1
}

fn one() -> usize {
    1
}

fn default_stiffness() -> Vector3 {
    sensor::TYPICAL_STIFFNESS_N_PER_MM
}

/// Column-wires of a list that counts from 1, of a sensor that has so many.
fn columns_from_0(columns: &[usize], most: usize) -> Result<Vec<usize>, BadValue> {
    let ascending = columns.windows(2).all(|pair| pair[0] < pair[1]);
    let there = columns.iter().all(|column| (1..=most).contains(column));
    require(
        !columns.is_empty() && ascending && there,
        "readout.column_wires",
        format!("{columns:?}"),
        || format!("list columns from 1 to {most}, ascending"),
    )?;
    Ok(columns.iter().map(|column| column - 1).collect())
}

/// Checks the number of places that a `layer` of so many wires is staggered to, beside a list of its electrodes.
fn check_stagger(
    layer: &str,
    stagger: usize,
    wires: usize,
    listed: Option<&Vec<Vector3>>,
) -> Result<(), BadValue> {
    let field = format!("sensor.{layer}_stagger");
    require((1..=wires).contains(&stagger), &field, stagger, || {
        format!("give 1 for electrodes in line, or up to the number of the layer's wires, {wires}")
    })?;
    require(stagger == 1 || listed.is_none(), &field, stagger, || {
        format!(
            "sensor.{layer}_electrodes_mm lists the position of each electrode; give one of the two"
        )
    })
}

impl SceneFile {
    /// The experiment, with all defaults.
    ///
    /// # Errors
    /// [`BadValue`] for counts of wires and electrodes that are not held: memory is taken for as many.
    pub(super) fn into_experiment(self, text: &str) -> Result<Experiment, BadValue> {
        let s = self.sensor;
        let of_columns = (s.column_wires, s.electrodes_per_column_wire);
        check_counts((s.row_wires, s.electrodes_per_row_wire), of_columns)?;
        let size_mm = s.extent_mm()?;
        let (upper, lower) = (s.upper_electrodes_mm, s.lower_electrodes_mm);
        check_stagger("upper", s.upper_stagger, s.row_wires, upper.as_ref())?;
        check_stagger("lower", s.lower_stagger, s.column_wires, lower.as_ref())?;
        let sensor = Sensor {
            upper_electrodes_mm: upper.unwrap_or_else(|| {
                let (rows, per_row) = (s.row_wires, s.electrodes_per_row_wire);
                sensor::default_upper_electrodes_mm(rows, per_row, s.upper_stagger, size_mm)
            }),
            lower_electrodes_mm: lower.unwrap_or_else(|| {
                let (columns, per_column) = (s.column_wires, s.electrodes_per_column_wire);
                sensor::default_lower_electrodes_mm(columns, per_column, s.lower_stagger, size_mm)
            }),
            row_wires: s.row_wires,
            electrodes_per_row_wire: s.electrodes_per_row_wire,
            column_wires: s.column_wires,
            read_columns: None,
            electrodes_per_column_wire: s.electrodes_per_column_wire,
            size_mm,
            resistance_ohm_per_mm: s.resistance_ohm_per_mm,
            stiffness_n_per_mm: s.stiffness_n_per_mm,
        };
        let Readout { row_wires, column_wires } = self.readout;
        let sensor = match column_wires {
            Some(columns) => sensor.with_columns(&columns_from_0(&columns, sensor.column_wires)?),
            None => sensor,
        };
        let read_rows = match row_wires {
            // Row 0 does not exist in a file; it becomes one that the check refuses.
            Some(rows) => rows.into_iter().map(|row| row.wrapping_sub(1)).collect(),
            None => (0..sensor.row_wires).collect(),
        };
        let world = World {
            seed: self.seed,
            sensor,
            motion: self.deformation,
            path: self.motion,
            rubber: self.rubber,
            noise: self.noise,
            drift: self.drift,
            read_rows,
            outputs: self.outputs,
        };
        // Settings that hold are needed to derive others; a scene is checked first.
        world.check()?;
        let others = match self.others {
            Some(given) => others::check(&given, &world).map(|()| given)?,
            None => others::derived(&world),
        };
        let (name, table1, training) = (self.name, self.table1, Training::default());
        let (frames, test_frames) = (USUAL_FRAMES, USUAL_TEST_FRAMES);
        let (text, digest) = (text.to_owned(), digest(text.as_bytes()));
        let usual =
            Experiment { name, text, digest, world, frames, test_frames, training, table1, others };
        usual.trained_with(&self.training)
    }
}
