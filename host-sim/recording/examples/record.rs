//! Records frames of a sensor of 8 × 18 wires with 48 electrodes, all made up, and writes the same beside it as CSV.
//!
//! `record FILE [seconds] [--paced]`: 100 frames a second, each at its time if they are paced. A line of the CSV is a frame: time
//! (µs), number, readings, outputs (mm), deviations (mm), true outputs (mm), forces (N) and their truth, contact (mm, N),
//! lost frames. It is written when the frame is.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime};

use taxel_recording::{
    Column, Contact, Electrode, Extras, Frame, Health, Layout, Replace, Status, Writer,
};

const ROWS: usize = 8;
const COLUMNS: usize = 18;
const ELECTRODES: usize = 48;
/// Outputs that belong to no electrode.
const FORCES: usize = 3;
const OUTPUTS: usize = 3 * ELECTRODES + FORCES;
const PERIOD: Duration = Duration::from_millis(10);

fn layout() -> Layout {
    let column = |name: String, unit: &str| Column { name, unit: unit.into() };
    let wires = (1..=ROWS).flat_map(|row| (1..=COLUMNS).map(move |wire| (row, wire)));
    let places = (0..ELECTRODES).map(|it| (it / 6, it % 6));
    let name = |(row, electrode): (usize, usize)| format!("r{}e{}", row + 1, electrode + 1);
    let axes = places
        .clone()
        .flat_map(|at| ["x", "y", "z"].map(|axis| format!("{}_d{axis}_mm", name(at))));
    let forces = ["x", "y", "z"].map(|axis| format!("force_{axis}_n"));
    let electrode = |(at, first): ((usize, usize), usize)| Electrode {
        name: name(at),
        place_mm: [(at.1 as f64 + 0.5) * 20.0 / 6.0, (at.0 as f64 + 0.5) * 18.0 / 8.0, 5.0],
        outputs: [Some(first), Some(first + 1), Some(first + 2)],
    };
    Layout {
        title: "example".into(),
        rows: ROWS,
        columns: COLUMNS,
        readings: wires.map(|(row, wire)| column(format!("r{row}c{wire}_ohm"), "Ω")).collect(),
        outputs: axes
            .map(|name| column(name, "mm"))
            .chain(forces.map(|name| column(name, "N")))
            .collect(),
        electrodes: places.zip((0..).step_by(3)).map(electrode).collect(),
    }
}

/// Numbers between −1 and 1, the same in every run.
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f32 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 23) as f32 - 1.0
    }

    fn many(&mut self, count: usize, scale: f32) -> Vec<f32> {
        (0..count).map(|_| self.next() * scale).collect()
    }
}

fn frame(number: u32, draws: &mut Draws) -> Frame {
    let is_open = number / 150 % 2 == 1;
    let mut readings: Vec<f32> =
        draws.many(ROWS * COLUMNS, 20.0).iter().map(|it| 60.0 + it).collect();
    if is_open {
        readings[number as usize % (ROWS * COLUMNS)] = f32::NAN;
    }
    let mut outputs = draws.many(OUTPUTS, 1.0);
    if number % 7 == 3 {
        outputs[..18].fill(f32::NAN);
    }
    let [x, y, z] = [draws.next(), draws.next(), draws.next()];
    let mut row_wires = vec![Health::Sound; ROWS];
    row_wires[2] = if is_open { Health::Open } else { Health::Sound };
    Frame {
        time_us: 5_000_000 + u64::from(number) * PERIOD.as_micros() as u64,
        number,
        readings,
        outputs: Some(outputs),
        deviations: number.is_multiple_of(2).then(|| draws.many(OUTPUTS, 0.1)),
        truth: Some(draws.many(OUTPUTS, 1.0)),
        contact: (!number.is_multiple_of(3)).then(|| Contact {
            place_mm: [10.0 + x, 9.0 + y, 5.0],
            force_n: number.is_multiple_of(2).then_some([x, y, z]),
        }),
        status: Some(Status {
            row_wires,
            column_wires: vec![Health::Sound; COLUMNS],
            lost_frames: u64::from(number / 400),
            is_novel: is_open,
            is_clamped: false,
        }),
    }
}

/// Line of the CSV; what a frame lacks is empty.
fn line(frame: &Frame) -> String {
    let or_empty = |values: Option<&[f32]>, count: usize| match values {
        Some(values) => values.iter().map(f32::to_string).collect(),
        None => vec![String::new(); count],
    };
    let mut fields = vec![frame.time_us.to_string(), frame.number.to_string()];
    fields.extend(or_empty(Some(&frame.readings), 0));
    for values in [&frame.outputs, &frame.deviations, &frame.truth] {
        fields.extend(or_empty(values.as_deref(), OUTPUTS));
    }
    let contact = frame.contact.as_ref();
    fields.extend(or_empty(contact.map(|it| &it.place_mm[..]), 3));
    fields.extend(or_empty(contact.and_then(|it| it.force_n.as_ref()).map(|it| &it[..]), 3));
    fields.push(frame.status.as_ref().map_or(0, |status| status.lost_frames).to_string());
    fields.join(",") + "\n"
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (options, arguments): (Vec<String>, Vec<String>) =
        std::env::args().skip(1).partition(|it| it.starts_with("--"));
    let path = PathBuf::from(arguments.first().ok_or("usage: record FILE [seconds] [--paced]")?);
    let seconds: u32 = arguments.get(1).map_or(Ok(10), |text| text.parse())?;
    let is_paced = options.iter().any(|option| option == "--paced");
    let mut csv = BufWriter::new(File::create(path.with_extension("csv"))?);
    let extras = Extras {
        blob: Some(vec![1, 2, 3, 4]),
        scene: Some("name = \"example\"\n".into()),
        settings: [("rate_hz".into(), "100".into())].into(),
        ..Extras::default()
    };
    let mut writer =
        Writer::create(&path, &layout(), &extras, SystemTime::now(), Replace::Recordings)?;
    let mut draws = Draws(1);
    let start = Instant::now();
    for number in 0..seconds * 100 {
        let frame = frame(number, &mut draws);
        if is_paced {
            std::thread::sleep((PERIOD * number).saturating_sub(start.elapsed()));
        }
        writer.write(&frame)?;
        csv.write_all(line(&frame).as_bytes())?;
        if is_paced {
            csv.flush()?;
        }
    }
    csv.flush()?;
    Ok(writer.finish()?)
}
