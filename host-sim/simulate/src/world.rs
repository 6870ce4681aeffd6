//! Worlds: a sensor, how it is moved, the noise on its readings, and how it is read.

use taxel_data::input::MOST_VALUES;
use taxel_data::{BadValue, require};

use crate::drift::Drift;
use crate::motion::{self, Dent, Independent};
use crate::noise::{Noise, NoiseKind};
use crate::outputs::{ContactOutput, ElectrodeOutputs, Outputs};
use crate::path::Path;
use crate::profile::Profile;
use crate::rubber;
use crate::sensor::Sensor;
use crate::timetable::MOST_SCANS;

type Check = std::result::Result<(), BadValue>;

/// Largest length in mm, stiffness in N/mm and resistance in Ω/mm of a sensor; one over it is the least.
const MOST: f64 = 1e9;

/// Least distance in mm along z that a deformation may leave between upper and lower electrodes.
const LEAST_GAP_MM: f64 = 1e-9;

/// World to be simulated, and the part of it that is wanted.
#[derive(Debug, Clone, PartialEq)]
pub struct World {
    /// Seed of every random draw.
    pub seed: u64,
    /// Geometry and material of the sensor.
    pub sensor: Sensor,
    pub motion: motion::Kind,
    /// Path of the contact, if it moves. Models are trained on still frames all the same.
    pub path: Option<Path>,
    /// Rubber, and how it follows contacts that move. Still ones have been held until nothing creeps any more.
    pub rubber: rubber::Kind,
    pub noise: Noise,
    /// Drift of the gain between sessions, if any.
    pub drift: Option<Drift>,
    /// Row-wires that are read, from 0, ascending.
    pub read_rows: Vec<usize>,
    pub outputs: Outputs,
}

impl World {
    /// World with the paper's sensor, 0.5 % relative noise, all rows read, all deformations wanted,
    /// moved by `motion`.
    pub fn of_motion(motion: impl Into<motion::Kind>) -> Self {
        let sensor = Sensor::paper();
        Self {
            seed: 1,
            motion: motion.into(),
            path: None,
            rubber: rubber::Kind::default(),
            noise: Noise::white(NoiseKind::Relative, 0.005),
            drift: None,
            read_rows: (0..sensor.row_wires).collect(),
            outputs: Outputs::all_deformations(),
            sensor,
        }
    }

    /// World of the scene `press`: one contact.
    pub fn press() -> Self {
        Self::of_motion(Dent::new(Profile::Press, &[[2.0, 5.0]], [[0.0, 1.0], [0.0, 0.5]]))
    }

    /// World of the scene `contact`: that of `press`, whose outputs are the contact's centre, depth and force.
    pub fn contact() -> Self {
        let wanted = vec![ContactOutput::Centre, ContactOutput::Depth, ContactOutput::Force];
        Self { outputs: Outputs::Contact(wanted), ..Self::press() }
    }

    /// World of the scene `paper`: every electrode moves independently.
    pub fn paper() -> Self {
        let (dx_mm, dy_mm, dz_mm) = ([-1.0, 1.0], [-1.0, 1.0], [0.0, 1.0]);
        Self::of_motion(Independent { dx_mm, dy_mm, dz_mm })
    }

    /// Names of the readings that are wanted, row after row.
    pub fn reading_names(&self) -> Vec<String> {
        self.sensor.reading_names(&self.read_rows)
    }

    /// Names of the outputs that are wanted, row after row, or of the contact.
    pub fn output_names(&self) -> Vec<String> {
        self.outputs.names(&self.sensor, &self.read_rows)
    }

    /// Full scale of every output in its unit, in the order of [`output_names`](Self::output_names).
    ///
    /// Of an electrode it is the largest deformation magnitude of any axis, as in the paper (1 mm in both
    /// reference scenes), times the stiffness for forces. Of the contact it is the extent of the face, or what the
    /// [largest contact](motion::Motion::largest_contact) has.
    pub fn full_scales(&self) -> Vec<f64> {
        match &self.outputs {
            Outputs::Electrodes(outputs) => {
                let range_mm = self.motion.range_mm();
                let largest_mm =
                    range_mm.as_flattened().iter().fold(0.0_f64, |a, b| a.max(b.abs()));
                let axes = outputs.axes.iter();
                let of_one = axes.map(|axis| largest_mm * outputs.per_mm(&self.sensor, *axis));
                let electrodes = self.read_rows.len() * self.sensor.electrodes_per_row_wire;
                of_one.collect::<Vec<_>>().repeat(electrodes)
            }
            Outputs::Contact(wanted) => {
                let Some(largest) = self.motion.largest_contact(&self.sensor) else {
                    return vec![f64::NAN; self.outputs.count(&self.sensor, 0)];
                };
                wanted.iter().flat_map(|it| it.full_scales(&largest, &self.sensor)).collect()
            }
        }
    }

    /// Worlds of each kind of contact of a mix alone, with its share in the frames; this one alone without a mix.
    pub fn kinds(&self) -> Vec<(f64, World)> {
        let motion::Kind::Mix(mix) = &self.motion else { return vec![(1.0, self.clone())] };
        let whole: f64 = mix.parts.iter().map(|part| part.weight).sum();
        let of_part = |part: &motion::Part| {
            (part.weight / whole, World { motion: part.deformation.clone(), ..self.clone() })
        };
        mix.parts.iter().map(of_part).collect()
    }

    /// Changes the level of the white noise: a fraction (0.005 is 0.5 %), or in Ω for absolute noise.
    pub fn set_noise_level(&mut self, level: f64) -> Check {
        check_noise_level("noise level", self.noise.kind, level)?;
        self.noise.level = level;
        Ok(())
    }

    /// Checks every setting; a world that passes can be used without further checks.
    pub fn check(&self) -> Check {
        sensor(&self.sensor)?;
        motion(self)?;
        self.path.as_ref().map_or(Ok(()), |path| self.check_path(path))?;
        noise(&self.noise)?;
        self.drift.map_or(Ok(()), |drift| check_gain("drift.gain", drift.gain))?;
        rows(self)?;
        self.rubber.check()?;
        require(!self.remembers() || self.path.is_some(), "rubber", "[rubber]", || {
            "still contacts have been held until the rubber has stopped creeping, so it would change nothing; add [motion], or leave it out".into()
        })?;
        match &self.outputs {
            Outputs::Electrodes(wanted) => outputs_of_electrodes(wanted),
            Outputs::Contact(wanted) => outputs_of_contact(wanted, self),
        }
    }

    /// Checks that a contact of this world can move along `path`.
    pub fn check_path(&self, path: &Path) -> Check {
        require(self.motion.largest_contact(&self.sensor).is_some(), "motion", "[motion]", || {
            "electrodes that move independently have no contact that could slide; set deformation.kind = \"press\"".into()
        })?;
        path.check(&self.sensor, self.motion.deepest_mm())?;
        let (steps, seconds) = (path.duration_s / path.fine_step_s(), path.duration_s);
        let few = !self.remembers() || steps <= MOST_SCANS as f64;
        require(few, "motion.duration_s", format!("{seconds} s"), || {
            format!(
                "rubber with a memory follows such contacts in {steps:.0} steps, more than {MOST_SCANS}; shorten it"
            )
        })
    }

    /// Whether the rubber follows contacts that move with a memory.
    fn remembers(&self) -> bool {
        self.rubber.at_rest(0).is_some()
    }

    /// Checks that so many `frames` fit in memory; `field` names them in the message.
    pub fn check_frames(&self, field: &str, frames: usize) -> Check {
        let rows = self.read_rows.len();
        let of_a_frame = rows * self.sensor.column_wires + self.outputs.count(&self.sensor, rows);
        let most = MOST_VALUES / of_a_frame;
        require((1..=most).contains(&frames), field, frames, || {
            format!(
                "give from 1 to {most} frames; a frame has {of_a_frame} numbers, and a data set of more \
                 than {MOST_VALUES} does not fit in memory"
            )
        })?;
        let nodes =
            rows * self.sensor.electrodes_per_row_wire * self.sensor.lower_electrodes_mm.len();
        let most = MOST_NODES_OF_FRAMES / nodes;
        require(frames <= most, field, frames, || {
            format!(
                "give at most {most} frames; a frame has {nodes} pairs of an upper and a lower electrode, and more \
                 than {MOST_NODES_OF_FRAMES} take hours"
            )
        })
    }
}

/// Checks a level of noise of this `kind`; `field` names it in the message.
pub fn check_noise_level(field: &str, kind: NoiseKind, level: f64) -> Check {
    let most = if kind == NoiseKind::Absolute { MOST } else { 1.0 };
    require((0.0..=most).contains(&level), field, level, || match kind {
        NoiseKind::Absolute => format!("it is in ohm, from 0 to {MOST:e}"),
        _ => "it is a fraction from 0 to 1 (0.005 is 0.5 %)".into(),
    })
}

fn noise(noise: &Noise) -> Check {
    let unit = noise.kind.unit_of_fields();
    for (field, level) in [("level", noise.level), ("correlated_level", noise.correlated_level)] {
        check_noise_level(&format!("noise.{field}{unit}"), noise.kind, level)?;
    }
    let (field, time_constant_ms) = ("noise.time_constant_ms", noise.time_constant_ms);
    if noise.correlated_level == 0.0 {
        return require(time_constant_ms == 0.0, field, time_constant_ms, || {
            "white noise has none: give noise.correlated_level too, or leave it out".into()
        });
    }
    require((1e-6..=MOST).contains(&time_constant_ms), field, time_constant_ms, || {
        format!("noise with a correlated_level has one, from 1e-6 to {MOST:e} ms")
    })
}

/// Checks the largest relative change of a drifting gain; `field` names it in the message.
fn check_gain(field: &str, gain: f64) -> Check {
    require((0.0..1.0).contains(&gain), field, gain, || {
        "it is a fraction from 0 to below 1 (0.02 is ±2 %)".into()
    })
}

fn positive(field: &str, value: f64) -> Check {
    require(value.is_finite() && value > 0.0, field, format!("{value:?}"), || {
        "it must be a positive number".into()
    })
}

/// Checks a length, stiffness or resistance: anything that a sensor could have, so that readings fit f32.
fn of_a_sensor(field: &str, value: f64) -> Check {
    positive(field, value)?;
    require((1.0 / MOST..=MOST).contains(&value), field, format!("{value:?}"), || {
        format!("it must be from {:e} to {MOST:e}", 1.0 / MOST)
    })
}

fn count(field: &str, value: usize, most: usize) -> Check {
    require((1..=most).contains(&value), field, value, || format!("it must be from 1 to {most}"))
}

/// Most nodes of a sensor: pairs of an upper and a lower electrode. A frame of so many takes some 0.1 s of a core.
const MOST_NODES: usize = 100_000_000;
/// Most nodes in all frames of a data set: some 20 minutes of a core.
const MOST_NODES_OF_FRAMES: usize = 1_000_000_000_000;

/// Checks the numbers of a sensor's wires and of the electrodes on each, before anything is laid out.
///
/// # Errors
/// [`BadValue`] for the first number that is not held, and for more than 100 million nodes: pairs of an upper and a
/// lower electrode.
pub fn check_counts(
    (row_wires, electrodes_per_row_wire): (usize, usize),
    (column_wires, electrodes_per_column_wire): (usize, usize),
) -> Check {
    count("sensor.row_wires", row_wires, 255)?;
    count("sensor.electrodes_per_row_wire", electrodes_per_row_wire, 1000)?;
    count("sensor.column_wires", column_wires, 10_000)?;
    count("sensor.electrodes_per_column_wire", electrodes_per_column_wire, 1000)?;
    let (upper, lower) =
        (row_wires * electrodes_per_row_wire, column_wires * electrodes_per_column_wire);
    require(upper * lower <= MOST_NODES, "sensor", format!("{upper} × {lower} electrodes"), || {
        format!(
            "a frame may have at most {MOST_NODES} pairs of an upper and a lower electrode; give fewer electrodes"
        )
    })
}

fn sensor(sensor: &Sensor) -> Check {
    let of_rows = (sensor.row_wires, sensor.electrodes_per_row_wire);
    check_counts(of_rows, (sensor.column_wires, sensor.electrodes_per_column_wire))?;
    for (axis, value) in ["x", "y", "z"].iter().zip(sensor.size_mm) {
        of_a_sensor(&format!("sensor.size_mm ({axis})"), value)?;
    }
    for (axis, value) in ["x", "y", "z"].iter().zip(sensor.stiffness_n_per_mm) {
        of_a_sensor(&format!("sensor.stiffness_n_per_mm ({axis})"), value)?;
    }
    of_a_sensor("sensor.resistance_ohm_per_mm", sensor.resistance_ohm_per_mm)?;
    for (field, list, expected, of) in [
        (
            "sensor.upper_electrodes_mm",
            &sensor.upper_electrodes_mm,
            sensor.row_wires * sensor.electrodes_per_row_wire,
            "row_wires × electrodes_per_row_wire",
        ),
        (
            "sensor.lower_electrodes_mm",
            &sensor.lower_electrodes_mm,
            sensor.column_wires * sensor.electrodes_per_column_wire,
            "column_wires × electrodes_per_column_wire",
        ),
    ] {
        let listed = format!("a list of {} positions", list.len());
        require(list.len() == expected, field, listed, || format!("{of} asks for {expected}"))?;
        let stray = list.as_flattened().iter().find(|value| !(-MOST..=MOST).contains(*value));
        require(stray.is_none(), field, stray.unwrap_or(&0.0), || {
            format!("give every position in mm as a finite number of at most {MOST:e}")
        })?;
    }
    Ok(())
}

fn motion(world: &World) -> Check {
    let (motion, sensor) = (&world.motion, &world.sensor);
    motion.check()?;
    let range_mm = motion.range_mm();
    let moves = range_mm.as_flattened().iter().any(|v| *v != 0.0);
    require(moves, "deformation", format!("{range_mm:?} mm"), || {
        "nothing can move; widen a range".into()
    })?;
    let most = sensor.largest_deformation_mm();
    for (axis, range) in ["x", "y", "z"].iter().zip(range_mm) {
        let largest = range[0].abs().max(range[1].abs());
        let value = format!("up to {largest} mm along {axis}");
        require(sensor.holds_for(largest), "deformation", value, || {
            format!(
                "the sensor model is valid up to 20 % of the thickness, {most} mm; narrow the range"
            )
        })?;
    }
    let lowest_upper = lowest(sensor.upper_electrodes_mm.iter().map(|p| p[2])) - range_mm[2][1];
    let highest_lower = -lowest(sensor.lower_electrodes_mm.iter().map(|p| -p[2]));
    let value = format!("down to z = {lowest_upper} mm");
    require(lowest_upper - highest_lower >= LEAST_GAP_MM, "deformation", value, || {
        format!(
            "lower electrodes reach {highest_lower} mm: they would touch; raise sensor.upper_electrodes_mm"
        )
    })
}

fn lowest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::INFINITY, f64::min)
}

fn rows(world: &World) -> Check {
    let (rows, most) = (&world.read_rows, world.sensor.row_wires);
    let ascending = rows.windows(2).all(|pair| pair[0] < pair[1]);
    let holds = !rows.is_empty() && ascending && rows.iter().all(|row| *row < most);
    let listed: Vec<_> = rows.iter().map(|row| row.wrapping_add(1)).collect();
    require(holds, "readout.row_wires", format!("{listed:?}"), || {
        format!("list rows from 1 to {most}, ascending")
    })
}

fn outputs_of_electrodes(outputs: &ElectrodeOutputs) -> Check {
    let axes = &outputs.axes;
    let ascending = axes.windows(2).all(|pair| pair[0].index() < pair[1].index());
    let letters: Vec<char> = axes.iter().map(|axis| axis.letter()).collect();
    require(!axes.is_empty() && ascending, "outputs.axes", format!("{letters:?}"), || {
        "list at least one of \"x\", \"y\", \"z\", each once, always in the order x, y, z".into()
    })
}

fn outputs_of_contact(wanted: &[ContactOutput], world: &World) -> Check {
    let names: Vec<String> = wanted.iter().map(|it| format!("{it:?}").to_lowercase()).collect();
    let ascending = wanted.windows(2).all(|pair| pair[0] < pair[1]);
    require(!wanted.is_empty() && ascending, "outputs.contact", format!("{names:?}"), || {
        "list at least one of \"centre\", \"depth\", \"shear\", \"force\", each once, always in this \
         order"
            .into()
    })?;
    let largest = world.motion.largest_contact(&world.sensor);
    require(largest.is_some(), "outputs.contact", format!("{names:?}"), || {
        "electrodes that move independently have no contact; set deformation.kind = \"press\", or ask for \
         outputs.quantity and outputs.axes"
            .into()
    })?;
    let of_load = |it: &ContactOutput| matches!(it, ContactOutput::Centre | ContactOutput::Force);
    let known = !world.remembers() || wanted.iter().all(of_load);
    require(known, "outputs.contact", format!("{names:?}"), || {
        "the depth of the rubber depends on where the contact was before; ask only for \"centre\" and \
         \"force\", or leave [rubber] out"
            .into()
    })?;
    let is_single = largest.is_some_and(|contact| contact.is_single());
    let holds = is_single || *wanted == [ContactOutput::Force];
    require(holds, "outputs.contact", format!("{names:?}"), || {
        "two contacts (deformation.kind = \"pair\") have no single centre, depth and shear; ask only for \"force\", or for \
         outputs.quantity and outputs.axes"
            .into()
    })
}
