//! Layouts and frames that tests record.
#![allow(dead_code)] // not every test uses all

use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use taxel_recording::{Column, Electrode, Extras, Frame, Health, Layout, Replace, Status, Writer};
use tempfile::TempDir;

/// Folder that goes with its test.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(format!("{name}.mcap"))
    }
}

fn column(name: String, unit: &str) -> Column {
    Column { name, unit: unit.into() }
}

/// Two rows of three columns, and three electrodes of which one has no y; a force and a label besides.
pub fn electrodes() -> Layout {
    let axes = [
        "e1_dx_mm", "e1_dy_mm", "e1_dz_mm", "e2_dx_mm", "e2_dz_mm", "e3_dx_mm", "e3_dy_mm",
        "e3_dz_mm",
    ];
    let mut outputs: Vec<Column> = axes.map(|name| column(name.into(), "mm")).into();
    outputs.insert(3, column("force_n".into(), "N"));
    outputs.push(column("class, as told".into(), ""));
    let electrode = |number: u8, outputs| Electrode {
        name: format!("e{number}"),
        place_mm: [f64::from(number) * 10.0 / 3.0, -0.1, 5.0],
        outputs,
    };
    Layout {
        title: "a sensor · 2 × 3".into(),
        rows: 2,
        columns: 3,
        readings: (1..=6).map(|number| column(format!("r{number}_ohm"), "Ω")).collect(),
        outputs,
        electrodes: vec![
            electrode(1, [Some(0), Some(1), Some(2)]),
            electrode(2, [Some(4), None, Some(5)]),
            electrode(3, [Some(6), Some(7), Some(8)]),
        ],
    }
}

/// Four readings of any CSV, and two forces.
pub fn forces() -> Layout {
    Layout {
        title: String::new(),
        rows: 1,
        columns: 4,
        readings: ["a", "b", "c", "d"].map(|name| column(name.into(), "V")).into(),
        outputs: ["fx", "fz"].map(|name| column(name.into(), "N")).into(),
        electrodes: vec![],
    }
}

pub fn extras() -> Extras {
    Extras {
        blob: Some((0..=255).cycle().take(3000).collect()),
        scene: Some("name = \"press\" # µ\n".into()),
        settings: [("rate_hz".into(), "100".into()), ("note".into(), "two\nlines".into())].into(),
        parent_frame: "hand".into(),
    }
}

pub fn start() -> SystemTime {
    UNIX_EPOCH + Duration::from_nanos(1_795_000_000_123_456_789)
}

/// Frames with numbers from 7 on, 10 ms apart, of any bits.
pub fn frames(layout: &Layout, count: usize) -> Vec<Frame> {
    let mut state = 1_u64;
    let mut draw = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let value = f32::from_bits((state >> 32) as u32);
        // One of all is missing.
        if value.is_nan() || state >> 60 == 0 { f32::NAN } else { value }
    };
    let mut values = |count: usize| (0..count).map(|_| draw()).collect::<Vec<f32>>();
    let mut status = Status::default();
    let frame = |number: usize| {
        let outputs = layout.outputs.len();
        if number.is_multiple_of(5) {
            status = Status {
                row_wires: vec![
                    if number.is_multiple_of(2) { Health::Sound } else { Health::Open };
                    layout.rows
                ],
                column_wires: vec![Health::Noisy; layout.columns],
                lost_frames: number as u64,
                is_novel: number % 2 == 1,
                is_clamped: number == 10,
            };
        }
        let has_outputs = number % 4 != 3;
        let place = values(2);
        // A depth comes back to the bit where it is one, and not beyond all places.
        let depth_mm = [f32::NAN, 0.3, 1e-6][number % 3];
        Frame {
            time_us: 1_234_567 + 10_000 * number as u64,
            number: 7 + number as u32,
            readings: values(layout.readings.len()),
            outputs: has_outputs.then(|| values(outputs)),
            deviations: (has_outputs && number % 3 == 1).then(|| values(outputs)),
            truth: number.is_multiple_of(2).then(|| values(outputs)),
            contact_mm: (number % 4 != 1).then(|| [place[0], place[1], depth_mm]),
            force_n: number.is_multiple_of(2).then_some([0.1, -0.0, 1e-40]),
            events: vec!["touch begins".into(); number % 3],
            status: Some(status.clone()),
        }
    };
    (0..count).map(frame).collect()
}

/// Values and bits, with every NaN for the same: what Debug prints of a float is read to its bits.
pub fn assert_same(read: &[Frame], written: &[Frame]) {
    assert_eq!(read.len(), written.len());
    for (read, written) in read.iter().zip(written) {
        assert_eq!(format!("{read:?}"), format!("{written:?}"));
    }
}

/// Writes a recording in chunks of so many frames. Returns the file's size before the first and after each.
pub fn write(path: &Path, layout: &Layout, frames: &[Frame], chunk: usize) -> Vec<usize> {
    let mut writer = Writer::create(path, layout, &extras(), start(), Replace::Recordings).unwrap();
    let mut sizes = vec![writer.bytes() as usize];
    for (number, frame) in frames.iter().enumerate() {
        writer.write(frame).unwrap();
        if number % chunk == chunk - 1 {
            writer.flush().unwrap();
            sizes.push(writer.bytes() as usize);
        }
    }
    writer.finish().unwrap();
    sizes
}

/// Bytes of a recording in chunks of four frames.
pub fn recording(layout: &Layout, frames: &[Frame]) -> Vec<u8> {
    let folder = Folder::new();
    let path = folder.path("recording");
    write(&path, layout, frames, 4);
    std::fs::read(path).unwrap()
}
