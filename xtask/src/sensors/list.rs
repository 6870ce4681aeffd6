//! The sensors: the scene `press` with changes, and measurements of a glove's kind.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use taxel_data::random::{Purpose, Random, Stream};

use crate::process::Outcome;

/// The scene that others are made from.
const PRESS: &str = include_str!("../../../scenes/press.toml");

/// A sensor, and the options that its models are trained with.
pub struct Sensor {
    /// Name of files.
    pub name: &'static str,
    /// Name for people.
    pub title: &'static str,
    /// Texts of the scene, and what replaces them; none for the CSV file.
    changes: &'static [(&'static str, &'static str)],
    pub training: &'static [&'static str],
    /// Whether it needs the image for wide sensors.
    pub wide: bool,
}

const AXES: &str = "axes = [\"x\", \"y\", \"z\"]";

const SCENE: Sensor = Sensor {
    name: "paper",
    title: "paper",
    changes: &[],
    training: &["-n4000", "--centres=64"],
    wide: false,
};

/// Name of the sensor whose data is a CSV file.
const CSV: &str = "csv-12-to-5";

pub const SENSORS: &[Sensor] = &[
    SCENE,
    Sensor { name: "z-only", title: "z only", changes: &[(AXES, "axes = [\"z\"]")], ..SCENE },
    Sensor {
        name: "three-rows",
        title: "three rows",
        changes: &[("[noise]", "[readout]\nrow_wires = [3, 4, 5]\n\n[noise]")],
        ..SCENE
    },
    Sensor {
        name: "one-row",
        title: "one row",
        changes: &[("[noise]", "[readout]\nrow_wires = [4]\n\n[noise]")],
        ..SCENE
    },
    Sensor {
        name: "pad-4x4",
        title: "4 × 4 pad",
        changes: &[("row_wires = 8", "row_wires = 4"), ("column_wires = 18", "column_wires = 4")],
        ..SCENE
    },
    Sensor {
        name: CSV,
        title: "own CSV file",
        training: &["--inputs=r*", "--outputs=*_n", "--centres=64", "--spread=0.5"],
        ..SCENE
    },
    Sensor {
        name: "wide-16x32",
        title: "16 × 32",
        changes: &[("row_wires = 8", "row_wires = 16"), ("column_wires = 18", "column_wires = 32")],
        training: &["-n4000", "--centres=16"],
        wide: true,
    },
];

impl Sensor {
    /// Writes the sensor's scene or CSV file into `directory`, and returns its path.
    pub fn write(&self, directory: &Path) -> Outcome<PathBuf> {
        let (file, text) = if self.name == CSV {
            (format!("{}.csv", self.name), csv())
        } else {
            (format!("{}.toml", self.name), self.scene()?)
        };
        let path = directory.join(file);
        fs::write(&path, text).map_err(|cause| format!("{}: {cause}", path.display()))?;
        Ok(path)
    }

    fn scene(&self) -> Outcome<String> {
        let name = format!("name = \"{}\"", self.name);
        let named = [("name = \"press\"", name.as_str())];
        let changes = named.iter().chain(self.changes);
        changes.into_iter().try_fold(PRESS.to_owned(), |text, (from, to)| {
            if text.contains(from) {
                Ok(text.replace(from, to))
            } else {
                Err(format!("scenes/press.toml lacks {from:?}"))
            }
        })
    }
}

/// Twelve channels of a pad under five forces.
fn csv() -> String {
    let mut random = Random::new(5, Stream::Training, Purpose::Deformation, 0, 0);
    let gains: Vec<[f64; 5]> =
        (0..12).map(|_| std::array::from_fn(|_| random.between([-0.2, 0.6]))).collect();
    let names = |prefix: &str, count: usize, suffix: &str| {
        (1..=count).map(|i| format!("{prefix}{i}{suffix}")).collect::<Vec<_>>()
    };
    let mut csv = [names("r", 12, "_ohm"), names("f", 5, "_n")].concat().join(",") + "\n";
    for _ in 0..3000 {
        let forces: [f64; 5] = std::array::from_fn(|_| random.unit());
        let reading = |gains: &[f64; 5]| {
            let load: f64 = gains.iter().zip(forces).map(|(gain, force)| gain * force).sum();
            80.0 / (1.0 + load * load + 0.5 * load) + 0.1 * random.normal()
        };
        let readings: Vec<f64> = gains.iter().map(reading).collect();
        let cells: Vec<String> = readings.iter().chain(&forces).map(f64::to_string).collect();
        let _ = writeln!(csv, "{}", cells.join(","));
    }
    csv
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_is_made_from_press() {
        for sensor in SENSORS.iter().filter(|sensor| sensor.name != CSV) {
            let scene = sensor.scene().unwrap();
            assert!(scene.contains(&format!("name = \"{}\"", sensor.name)));
            assert!(sensor.changes.iter().all(|(_, to)| scene.contains(to)));
        }
    }

    #[test]
    fn the_csv_file_has_twelve_channels_and_five_forces() {
        let csv = csv();
        let widths: Vec<usize> = csv.lines().map(|line| line.split(',').count()).collect();
        assert!(widths.len() == 3001 && widths.iter().all(|width| *width == 17));
        assert!(csv.starts_with("r1_ohm,r2_ohm,") && !csv.contains("NaN"));
    }
}
