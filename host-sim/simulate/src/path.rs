//! Paths of contacts: how a contact slides over the face while it is pressed and lifted.

#![allow(clippy::needless_range_loop, reason = "lanes of several arrays are indexed alike")]

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};
use taxel_data::{BadValue, LANES, Lanes, Purpose, require, sin_cos, widest};

use crate::motion::Draws;
use crate::sensor::Sensor;

/// Mean of a press over its period, as a share of its greatest depth, and amplitude around it. Below 0 nothing touches.
const PRESS: [f64; 2] = [0.4, 0.6];
/// Largest difference in phase between the path's two directions, in turns: half a radian.
const PHASE: f64 = 0.5 / TAU;
/// Longest time in s between two moments at which rubber with a memory is told what pushes it. From one to the next the
/// contact slides by no more than [`FINE_MM`], and no more than [`FINE_PRESS`] of a press passes.
const FINE_S: f64 = 0.001;
const FINE_MM: f64 = 0.1;
const FINE_PRESS: f64 = 0.01;
/// Number of numbers that fix a path: speed, press rate, greatest depth, centre along x and y, direction of its half lengths,
/// phase along x, how far that along y is apart, and phase of the presses.
pub const NUMBERS: usize = 9;
/// Most trajectories.
const MOST_TRAJECTORIES: usize = 10_000;

/// Path of a contact over time: it slides on an ellipse, and is pressed and lifted meanwhile.
///
/// Centre: c + a·sin(ωt + φ) along x and along y, with ω = v/√(aₓ² + a_y²), so that v is its greatest speed. Phases
/// differ by up to half a radian. Depth: d·max(0, 0.4 + 0.6·sin(2πft + φ)): it touches for 73 % of the time. At a rate
/// of 0 the depth is d. Half lengths are aₓ = l + (h − l)·|cos θ| and a_y = l + (h − l)·|sin θ| for a range [l, h] and θ
/// uniform on the circle; all other quantities are uniform on their ranges.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Path {
    /// Range of the centre's greatest speed v in mm/s.
    pub speed_mm_per_s: [f64; 2],
    /// Range of the rate f of presses in Hz.
    pub press_rate_hz: [f64; 2],
    /// Range of the greatest depth d of a trajectory's presses in mm; from three tenths of the deepest dent to all of it
    /// unless a scene says otherwise.
    pub peak_depth_mm: Option<[f64; 2]>,
    /// Range of the path's centre c along x and y in mm; the middle fifth of the face unless a scene says otherwise.
    pub centre_mm: Option<[[f64; 2]; 2]>,
    /// Range of the path's half length a along x and y in mm; from a fortieth to three eighths of the face unless a scene
    /// says otherwise.
    pub half_length_mm: Option<[[f64; 2]; 2]>,
    /// Duration of a trajectory in s.
    #[serde(default = "default_duration_s")]
    pub duration_s: f64,
    /// Number of trajectories that a decoder is judged by.
    #[serde(default = "default_trajectories")]
    pub trajectories: usize,
}

fn default_duration_s() -> f64 {
    0.6
}

fn default_trajectories() -> usize {
    64
}

impl Path {
    /// Path at this greatest speed, pressed and lifted at this rate, with everything else as usual.
    pub fn at(speed_mm_per_s: f64, press_rate_hz: f64) -> Self {
        Self {
            speed_mm_per_s: [speed_mm_per_s; 2],
            press_rate_hz: [press_rate_hz; 2],
            peak_depth_mm: None,
            centre_mm: None,
            half_length_mm: None,
            duration_s: default_duration_s(),
            trajectories: default_trajectories(),
        }
    }

    /// Contacts in words: `64 contacts that slide at 10 to 100 mm/s and press 1 to 5 times a second`.
    pub fn in_words(&self) -> String {
        let range = |[low, high]: [f64; 2]| {
            if low == high { low.to_string() } else { format!("{low} to {high}") }
        };
        format!(
            "{} contacts that slide at {} mm/s and press {} times a second",
            self.trajectories,
            range(self.speed_mm_per_s),
            range(self.press_rate_hz)
        )
    }

    /// Time in s between two moments at which rubber with a memory is told what pushes it.
    pub(crate) fn fine_step_s(&self) -> f64 {
        let [speed, rate] = [self.speed_mm_per_s, self.press_rate_hz].map(|[_, most]| most);
        FINE_S.min(FINE_MM / speed).min(FINE_PRESS / rate)
    }

    /// Checks all settings, for contacts up to `deepest_mm` on `sensor`.
    ///
    /// # Errors
    /// [`BadValue`] for the first that cannot be used.
    pub fn check(&self, sensor: &Sensor, deepest_mm: f64) -> Result<(), BadValue> {
        let within = |field: &str, range: [f64; 2], [least, most]: [f64; 2], unit: &str| {
            let [low, high] = range;
            let holds = low <= high && low >= least && high <= most;
            require(holds, format!("motion.{field}"), format!("{range:?}"), || {
                format!("give [low, high] from {least} to {most} {unit}")
            })
        };
        within("speed_mm_per_s", self.speed_mm_per_s, [0.0, 10_000.0], "mm/s")?;
        within("press_rate_hz", self.press_rate_hz, [0.0, 1000.0], "Hz")?;
        let depth = self.peak_depth_mm(deepest_mm);
        within("peak_depth_mm", depth, [0.0, deepest_mm], "mm, the deepest dent")?;
        let (centre, half) = (self.centre_mm(sensor), self.half_length_mm(sensor));
        for axis in 0..2 {
            let name = ["x", "y"][axis];
            let face = [0.0, sensor.size_mm[axis]];
            within(&format!("centre_mm ({name})"), centre[axis], face, "mm, the face")?;
            let room = centre[axis][0].min(face[1] - centre[axis][1]);
            let field = format!("half_length_mm ({name})");
            within(&field, half[axis], [0.0, room], "mm, so that the centre stays on the face")?;
        }
        let (still, speed) = (half.map(|range| range[0]), self.speed_mm_per_s[1]);
        require(still != [0.0; 2] || speed == 0.0, "motion.half_length_mm", "[0.0, …]", || {
            "a path without a length has no speed; give at least one direction a lower bound above 0".into()
        })?;
        let seconds = self.duration_s;
        require((0.01..=3600.0).contains(&seconds), "motion.duration_s", seconds, || {
            "it must be from 0.01 to 3600".into()
        })?;
        let (field, most) = ("motion.trajectories", MOST_TRAJECTORIES);
        require((1..=most).contains(&self.trajectories), field, self.trajectories, || {
            format!("it must be from 1 to {most}")
        })
    }

    /// Range of the greatest depth of a trajectory's presses in mm, for contacts up to `deepest_mm`.
    fn peak_depth_mm(&self, deepest_mm: f64) -> [f64; 2] {
        self.peak_depth_mm.unwrap_or([0.3 * deepest_mm, deepest_mm])
    }

    fn centre_mm(&self, sensor: &Sensor) -> [[f64; 2]; 2] {
        let middle = |axis: usize| [0.4 * sensor.size_mm[axis], 0.6 * sensor.size_mm[axis]];
        self.centre_mm.unwrap_or([middle(0), middle(1)])
    }

    fn half_length_mm(&self, sensor: &Sensor) -> [[f64; 2]; 2] {
        let lengths = |axis: usize| [0.025 * sensor.size_mm[axis], 0.375 * sensor.size_mm[axis]];
        self.half_length_mm.unwrap_or([lengths(0), lengths(1)])
    }

    /// Draws the numbers on [0, 1) that fix the paths of [`LANES`] trajectories.
    pub fn draw(draws: &mut Draws) -> [Lanes; NUMBERS] {
        let mut drawn = [[0.0; LANES]; NUMBERS];
        widest!(draws.of(Purpose::Path, 0).between([[0.0, 1.0]; NUMBERS], &mut drawn));
        drawn
    }

    /// Paths that these numbers on [0, 1) fix, over `sensor`, for contacts up to `deepest_mm`.
    pub fn place(&self, sensor: &Sensor, deepest_mm: f64, units: &[Lanes; NUMBERS]) -> Paths {
        let [centre_x, centre_y] = self.centre_mm(sensor);
        let [half_x, half_y] = self.half_length_mm(sensor);
        let (turn, phase) = ([0.0, 1.0], [-PHASE, PHASE]);
        let ranges = [
            self.speed_mm_per_s,
            self.press_rate_hz,
            self.peak_depth_mm(deepest_mm),
            centre_x,
            centre_y,
            turn,
            turn,
            phase,
            turn,
        ];
        let mut numbers = *units;
        for (lanes, [low, high]) in numbers.iter_mut().zip(ranges) {
            lanes.iter_mut().for_each(|number| *number = low + (high - low) * *number);
        }
        let [speed, rate, depth_mm, x_mm, y_mm, direction, phase_x, phase_apart, phase_press] =
            numbers;
        let mut paths = Paths {
            centre_mm: [x_mm, y_mm],
            half_length_mm: [[0.0; LANES]; 2],
            turns_per_s: [0.0; LANES],
            phase: [phase_x, phase_apart],
            depth_mm,
            presses_per_s: rate,
            phase_press,
        };
        for lane in 0..LANES {
            let (sine, cosine) = sin_cos(TAU * direction[lane]);
            let half = |[low, high]: [f64; 2], share: f64| low + (high - low) * share.abs();
            let [along_x, along_y] = [half(half_x, cosine), half(half_y, sine)];
            let length = (along_x * along_x + along_y * along_y).sqrt();
            paths.half_length_mm[0][lane] = along_x;
            paths.half_length_mm[1][lane] = along_y;
            let moves = speed[lane] > 0.0;
            paths.turns_per_s[lane] = if moves { speed[lane] / (TAU * length) } else { 0.0 };
            paths.phase[1][lane] += phase_x[lane];
        }
        paths
    }
}

/// Paths, one a lane.
#[derive(Debug)]
pub struct Paths {
    centre_mm: [Lanes; 2],
    half_length_mm: [Lanes; 2],
    turns_per_s: Lanes,
    /// Phase along x and along y, in turns.
    phase: [Lanes; 2],
    depth_mm: Lanes,
    presses_per_s: Lanes,
    /// Phase of the presses, in turns.
    phase_press: Lanes,
}

/// Sine of so many turns.
#[inline(always)]
fn sine_of_turns(turns: f64) -> f64 {
    sin_cos(TAU * (turns - turns.floor())).0
}

impl Paths {
    /// Centre and depth of the contact in mm at this time.
    pub fn at(&self, time_s: f64) -> ([Lanes; 2], Lanes) {
        let (mut centre_mm, mut depth_mm) = (self.centre_mm, self.depth_mm);
        widest!({
            for (axis, centre_mm) in centre_mm.iter_mut().enumerate() {
                for lane in 0..LANES {
                    let turns = self.turns_per_s[lane] * time_s + self.phase[axis][lane];
                    centre_mm[lane] += self.half_length_mm[axis][lane] * sine_of_turns(turns);
                }
            }
            for lane in 0..LANES {
                let turns = self.presses_per_s[lane] * time_s + self.phase_press[lane];
                let pressed = (PRESS[0] + PRESS[1] * sine_of_turns(turns)).max(0.0);
                depth_mm[lane] *= if self.presses_per_s[lane] > 0.0 { pressed } else { 1.0 };
            }
        });
        (centre_mm, depth_mm)
    }
}
