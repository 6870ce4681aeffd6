//! Feeds a view without a sensor: a press that wanders over the paper's sensor, decoded with made-up errors.
//!
//!     cargo run --release -p taxel-view --example synthetic -- port=8471 token=0123456789abcdef show=simulation
//!
//! `show` is `simulation`, `device`, `recording`, `values` (outputs without electrodes), `fault` (a broken wire), `novel`,
//! `silent` (no frames) or `hostile` (names that are scripts). `rate` is the number of frames a second.

use std::f32::consts::TAU;
use std::thread;
use std::time::{Duration, Instant};

use taxel_view::message::{
    Can, Channel, Contact, Electrode, Flag, Health, Kind, Recording, State, Wire,
};
use taxel_view::{Action, Command, Frame, Layout, Status, View};

const ROWS: usize = 8;
const COLUMNS: usize = 18;
/// Electrodes of a row-wire and of a column-wire.
const ELECTRODES: [usize; 2] = [6, 3];
const SIZE_MM: [f32; 3] = [20.0, 18.0, 5.0];
const OHM_PER_MM: f32 = 100.0;
/// Stiffness of the rubber under an electrode.
const N_PER_MM: f32 = 1.2;
/// Length of the recording, and of the press's way.
const DURATION_S: f64 = 60.0;

fn main() -> std::io::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let given =
        |name: &str| arguments.iter().find_map(|pair| pair.strip_prefix(name)?.strip_prefix('='));
    let port = given("port").map_or(0, |port| port.parse().expect("port= and a number"));
    let rate: f64 = given("rate").map_or(100.0, |rate| rate.parse().expect("rate= and a number"));
    let show = given("show").unwrap_or("simulation");
    let (view, commands) = View::start(port, given("token"))?;
    println!("{}", view.address());

    view.set_layout(layout(show));
    view.set_baseline(match show {
        "values" => vec![3.0; 16],
        _ => readings(&[[0.0; 3]; ROWS * ELECTRODES[0]]),
    });
    let mut source = Source::new(show, rate);
    let start = Instant::now();
    for tick in 0u32.. {
        commands.try_iter().for_each(|command| source.obey(command));
        if show != "silent"
            && let Some(frame) = source.frame()
        {
            view.show(frame);
        }
        if tick.is_multiple_of(8) {
            view.set_status(source.status(start.elapsed()));
        }
        let due = Duration::from_secs_f64(f64::from(tick) / rate);
        thread::sleep(due.saturating_sub(start.elapsed()));
    }
    Ok(())
}

fn channel(name: String, unit: &str) -> Channel {
    Channel { name, unit: unit.into() }
}

/// Place of upper electrode `index` in mm.
fn place(index: usize) -> [f32; 3] {
    let (row, electrode) = (index / ELECTRODES[0], index % ELECTRODES[0]);
    let x = (electrode as f32 + 0.5) * SIZE_MM[0] / ELECTRODES[0] as f32;
    [x, (row as f32 + 0.5) * SIZE_MM[1] / ROWS as f32, SIZE_MM[2]]
}

fn layout(show: &str) -> Layout {
    let title = match show {
        "values" => "gripper finger",
        "hostile" => "<img src=x onerror=alert(1)><script>alert(2)</script>",
        _ => "press",
    };
    let kind = match show {
        "simulation" => Kind::Simulation,
        "recording" => Kind::Recording,
        _ => Kind::Device,
    };
    let readings = (0..ROWS * COLUMNS)
        .map(|index| channel(format!("r{}c{}", index / COLUMNS + 1, index % COLUMNS + 1), "Ω"));
    let name = |index| format!("r{}e{}", index / ELECTRODES[0] + 1, index % ELECTRODES[0] + 1);
    let electrodes = (0..ROWS * ELECTRODES[0]).map(|index| Electrode {
        name: if show == "hostile" { format!("<b onclick=alert(3)>{index}") } else { name(index) },
        place_mm: place(index),
        outputs: [0, 1, 2].map(|axis| Some(index * 3 + axis)),
    });
    let outputs = (0..ROWS * ELECTRODES[0] * 3)
        .map(|index| channel(format!("{}_d{}", name(index / 3), ["x", "y", "z"][index % 3]), "mm"));
    let values =
        [("force_x", "N"), ("force_y", "N"), ("force_z", "N"), ("slip", ""), ("temperature", "°C")];
    let is_values = show == "values";
    Layout {
        title: title.into(),
        kind,
        source: match kind {
            Kind::Device => "/dev/ttyACM0, nucleo-f446re, firmware 0.2.0",
            Kind::Simulation => "scene press, 0.5 % noise, model press.bin",
            Kind::Recording => "press-2026-11-26.mcap",
        }
        .into(),
        rows: if is_values { 0 } else { ROWS },
        columns: if is_values { 0 } else { COLUMNS },
        readings: if is_values {
            (1..=16).map(|index| channel(format!("hall_{index}"), "mT")).collect()
        } else {
            readings.collect()
        },
        outputs: if is_values {
            values.iter().map(|&(name, unit)| channel(name.into(), unit)).collect()
        } else {
            outputs.collect()
        },
        electrodes: if is_values { Vec::new() } else { electrodes.collect() },
        scale_mm: 1.0,
        can: Can {
            zero: kind == Kind::Device,
            record: kind != Kind::Recording,
            seek: kind == Kind::Recording,
        },
        duration_s: (kind == Kind::Recording).then_some(DURATION_S),
    }
}

/// Readings in Ω of the sensor whose upper electrodes moved by `deformations`, by the parallel of all nodes of two wires.
fn readings(deformations: &[[f32; 3]]) -> Vec<f32> {
    let mut readings = Vec::with_capacity(ROWS * COLUMNS);
    for row in 0..ROWS {
        for column in 0..COLUMNS {
            let mut siemens = 0.0;
            for electrode in 0..ELECTRODES[0] {
                let upper = row * ELECTRODES[0] + electrode;
                for lower in 0..ELECTRODES[1] {
                    let (at, moved) = (place(upper), deformations[upper]);
                    let x = (column as f32 + 0.5) * SIZE_MM[0] / COLUMNS as f32;
                    let y = (lower as f32 + 0.5) * SIZE_MM[1] / ELECTRODES[1] as f32;
                    let [dx, dy, dz] =
                        [at[0] - moved[0] - x, at[1] - moved[1] - y, at[2] - moved[2]];
                    siemens += 1.0 / (OHM_PER_MM * (dx * dx + dy * dy + dz * dz).sqrt());
                }
            }
            readings.push(1.0 / siemens);
        }
    }
    readings
}

/// Centre of the press in mm and its depth in mm at `time_s`.
fn press(time_s: f32) -> [f32; 3] {
    let depth =
        (TAU * time_s / 4.0).sin().max(0.0).sqrt() * (0.75 + 0.25 * (TAU * time_s / 11.0).sin());
    let x = SIZE_MM[0] * (0.5 + 0.3 * (TAU * time_s / 9.0).cos());
    [x, SIZE_MM[1] * (0.5 + 0.3 * (TAU * time_s / 7.0).sin()), depth]
}

struct Source {
    show: String,
    rate: f64,
    number: u64,
    time_s: f64,
    speed: f64,
    state: State,
    /// Whether a frame is due although the source waits.
    is_due: bool,
    recorded: Option<u64>,
    random: u32,
    square_error: f32,
}

impl Source {
    fn new(show: &str, rate: f64) -> Self {
        let state = if show == "silent" { State::NoData } else { State::Live };
        Self {
            show: show.into(),
            rate,
            number: 0,
            time_s: 0.0,
            speed: 1.0,
            state,
            is_due: false,
            recorded: None,
            random: 1,
            square_error: 0.0,
        }
    }

    /// About normal noise of deviation 1.
    fn noise(&mut self) -> f32 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            sum += (self.random >> 8) as f32 / (1 << 24) as f32;
        }
        sum
    }

    fn go_to(&mut self, time_s: f64) {
        self.time_s = time_s.clamp(0.0, DURATION_S);
        self.is_due = true;
    }

    fn obey(&mut self, command: Command) {
        let depth_mm = press(self.time_s as f32)[2];
        let result = match command.action {
            Action::Zero if self.show != "device" => {
                Err("only a device has a baseline to take".into())
            }
            Action::Zero if depth_mm > 0.05 => Err(format!(
                "not zeroed: something presses {depth_mm:.2} mm deep. Lift it, then press b again"
            )),
            Action::Zero => Ok("zeroed on 30 frames".into()),
            Action::Pause => {
                self.state = State::Paused;
                Ok("paused".into())
            }
            Action::Resume => {
                self.state = State::Live;
                Ok("goes on".into())
            }
            Action::Record => {
                self.recorded = Some(0);
                Ok("would record; this example writes no file".into())
            }
            Action::StopRecording => {
                self.recorded = None;
                Ok("synthetic.mcap is complete".into())
            }
            Action::Seek { to_s } => {
                self.go_to(to_s);
                Ok(format!("at {to_s:.2} s"))
            }
            Action::Speed { factor } => {
                self.speed = factor;
                Ok(format!("speed {factor:.1}"))
            }
            Action::Step { frames } => {
                self.state = State::Paused;
                self.go_to(self.time_s + f64::from(frames) / self.rate);
                Ok("stepped".into())
            }
        };
        command.answer(result);
    }

    fn frame(&mut self) -> Option<Frame> {
        if self.state == State::Live {
            self.time_s += self.speed / self.rate;
            if self.show == "recording" && self.time_s > DURATION_S {
                (self.state, self.time_s) = (State::Ended, DURATION_S);
            }
        } else if !self.is_due {
            return None;
        }
        self.is_due = false;
        self.number += 1;
        if let Some(frames) = &mut self.recorded {
            *frames += 1;
        }
        let time_s = self.time_s as f32;
        let [x_mm, y_mm, depth_mm] = press(time_s);
        let deformations: Vec<[f32; 3]> = (0..ROWS * ELECTRODES[0])
            .map(|index| {
                let at = place(index);
                let square = (at[0] - x_mm).powi(2) + (at[1] - y_mm).powi(2);
                let dz = depth_mm * (-square / (2.0 * 3.5 * 3.5)).exp();
                let (sin, cos) = (TAU * time_s / 5.0).sin_cos();
                [0.4 * dz * cos, 0.4 * dz * sin, dz]
            })
            .collect();
        let mut readings = readings(&deformations);
        for reading in &mut readings {
            *reading *= 1.0 + 0.005 * self.noise();
        }
        let mut frame = Frame {
            number: self.number,
            time_us: (self.time_s * 1e6) as u64,
            age_ms: 1.0,
            readings,
            novelty: Some(depth_mm - 5.0),
            ..Frame::default()
        };
        let force_n = deformations.iter().map(|moved| moved[2] * N_PER_MM).sum();
        frame.force_n = Some(force_n);
        frame.contact = (depth_mm > 0.02).then_some(Contact { x_mm, y_mm, depth_mm });
        if self.show == "values" {
            frame.readings = (0..16)
                .map(|index| 3.0 + (time_s + index as f32).sin() + 0.02 * self.noise())
                .collect();
            let shear = 0.3 * force_n;
            let slip = f32::from(depth_mm > 0.9);
            frame.outputs = vec![
                shear * time_s.cos(),
                shear * time_s.sin(),
                force_n,
                slip,
                24.0 + 0.01 * self.noise(),
            ];
            frame.contact = None;
            return Some(frame);
        }
        let truth: Vec<f32> = deformations.into_iter().flatten().collect();
        // Rows that a broken wire leaves uncertain.
        let is_uncertain = |index: usize| self.show == "fault" && index / 3 / ELECTRODES[0] == 2;
        let deviations: Vec<f32> = (0..truth.len())
            .map(|index| if is_uncertain(index) { 0.4 } else { [0.03, 0.06, 0.03][index % 3] })
            .collect();
        frame.outputs = truth
            .iter()
            .zip(&deviations)
            .map(|(truth, deviation)| truth + deviation * self.noise())
            .collect();
        let squares = frame
            .outputs
            .iter()
            .zip(&truth)
            .skip(2)
            .step_by(3)
            .map(|(decoded, truth)| (decoded - truth).powi(2));
        self.square_error +=
            0.02 * (squares.sum::<f32>() / (truth.len() / 3) as f32 - self.square_error);
        frame.deviations = Some(deviations);
        match self.show.as_str() {
            "simulation" => frame.truth = Some(truth),
            "fault" => {
                frame.readings[2 * COLUMNS..3 * COLUMNS].fill(f32::NAN);
                frame.flags.push(Flag::Missing);
            }
            "novel" => {
                frame.novelty = Some(3.1);
                frame.flags.extend([Flag::Novel, Flag::Clamped]);
            }
            _ => {}
        }
        Some(frame)
    }

    fn status(&self, since_start: Duration) -> Status {
        let is_simulated = self.show == "simulation";
        let rmse_mm = is_simulated.then(|| self.square_error.sqrt());
        let is_live = self.state == State::Live;
        Status {
            state: self.state,
            message: match (self.state, self.show.as_str()) {
                (State::NoData, _) => {
                    "no data for 2 s: is the cable in? May this user open /dev/ttyACM0 (group dialout, then log in again)?"
                }
                (State::Paused, _) => "paused: press space to go on",
                (State::Ended, _) => "the recording has ended: move the slider, or press space",
                (State::Live, "fault") => "row 3 is open: its electrodes are filled in from their neighbours",
                (State::Live, "hostile") => "<script>alert(4)</script>",
                (State::Live, _) => "all wires good",
            }
            .into(),
            scan_rate: is_live.then_some(self.rate as f32),
            decode_rate: is_live.then_some(self.rate as f32),
            rest: String::new(),
            lost: u64::from(self.show == "fault") * since_start.as_secs(),
            wires: if self.show == "fault" {
                vec![Wire {
                    wire: "row 3".into(),
                    health: Health::Open,
                    words: "interrupted: check the plug, then the wire between plug and sheet".into(),
                }, Wire {
                    wire: "column 11".into(),
                    health: Health::Noisy,
                    words: "scatters 6 times as much as its neighbours: check its shield".into(),
                }]
            } else {
                Vec::new()
            },
            recording: self.recorded.map(|frames| Recording {
                file: "synthetic.mcap".into(),
                bytes: frames * 2250,
                seconds: frames as f64 / self.rate,
            }),
            rmse_mm,
            times_limit: rmse_mm.map(|rmse_mm| rmse_mm / 0.0314),
            position_s: (self.show == "recording").then_some(self.time_s),
            speed: (self.show == "recording").then_some(self.speed),
            event: None,
        }
    }
}
