//! The scene as it stands in the file, before defaults are filled in.

use serde::Deserialize;

use super::{
    Deformation, Noise, Outputs, Precision, Readout, Scene, Sensor, Table1, Training, Vector3,
    sensor,
};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneFile {
    name: String,
    #[serde(default = "default_seed")]
    seed: u64,
    #[serde(default)]
    precision: Precision,
    sensor: SensorFile,
    deformation: Deformation,
    noise: Noise,
    #[serde(default)]
    readout: Readout,
    outputs: Outputs,
    training: Training,
    table1: Option<Table1>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SensorFile {
    row_wires: usize,
    electrodes_per_row_wire: usize,
    column_wires: usize,
    electrodes_per_column_wire: usize,
    size_mm: Vector3,
    resistance_ohm_per_mm: f64,
    #[serde(default = "default_stiffness")]
    stiffness_n_per_mm: Vector3,
    upper_electrodes_mm: Option<Vec<Vector3>>,
    lower_electrodes_mm: Option<Vec<Vector3>>,
}

fn default_seed() -> u64 {
    1
}

/// Typical of a soft silicone; only forces depend on it.
fn default_stiffness() -> Vector3 {
    [1.0, 1.0, 2.0]
}

impl SceneFile {
    pub(super) fn into_scene(self, digest: u64) -> Scene {
        let s = self.sensor;
        let sensor = Sensor {
            upper_electrodes_mm: s.upper_electrodes_mm.unwrap_or_else(|| {
                sensor::default_upper_electrodes_mm(
                    s.row_wires,
                    s.electrodes_per_row_wire,
                    s.size_mm,
                )
            }),
            lower_electrodes_mm: s.lower_electrodes_mm.unwrap_or_else(|| {
                sensor::default_lower_electrodes_mm(
                    s.column_wires,
                    s.electrodes_per_column_wire,
                    s.size_mm,
                )
            }),
            row_wires: s.row_wires,
            electrodes_per_row_wire: s.electrodes_per_row_wire,
            column_wires: s.column_wires,
            electrodes_per_column_wire: s.electrodes_per_column_wire,
            size_mm: s.size_mm,
            resistance_ohm_per_mm: s.resistance_ohm_per_mm,
            stiffness_n_per_mm: s.stiffness_n_per_mm,
        };
        let mut readout = self.readout;
        let read_rows = match readout.row_wires.take() {
            // Row 0 does not exist in a file; it becomes one that validation refuses.
            Some(rows) => rows.into_iter().map(|row| row.wrapping_sub(1)).collect(),
            None => (0..sensor.row_wires).collect(),
        };
        Scene {
            name: self.name,
            digest,
            seed: self.seed,
            precision: self.precision,
            sensor,
            deformation: self.deformation,
            noise: self.noise,
            read_rows,
            readout,
            outputs: self.outputs,
            training: self.training,
            table1: self.table1,
        }
    }
}
