//! Other geometries of a sensor: what each would show.

use serde::Serialize;
use taxel_simulate::World;
use taxel_simulate::sensor::{self, Sensor};

use crate::identify::{Observability, Prior, observability};

/// Variant of a world's sensor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Variant {
    /// What is changed, such as `height × 1.5`.
    pub change: String,
    /// Number of readings.
    pub readings: usize,
    /// Number of unknowns: three an electrode.
    pub unknowns: usize,
    /// What all readings show; `None` if the scene cannot be played on this sensor.
    pub observability: Option<Observability>,
    /// Reason why the scene cannot be played on it.
    pub refused: Option<String>,
}

/// Factors on the distance between electrodes along the face.
const PITCHES: [f64; 4] = [0.5, 0.75, 1.5, 2.0];
/// Factors on the thickness.
const HEIGHTS: [f64; 5] = [0.75, 1.25, 1.5, 2.0, 3.0];
/// Factors on numbers of wires and electrodes.
const COUNTS: [f64; 2] = [0.5, 2.0];

/// The sensor of `world` as it is, and with another pitch, height, or number of wires.
///
/// Numbers of wires and electrodes are varied only if electrodes lie at the centres of equal cells.
pub fn sweep(world: &World) -> Vec<Variant> {
    let own = &world.sensor;
    let mut sensors = vec![("as it is".to_owned(), own.clone())];
    for factor in PITCHES {
        sensors.push((format!("pitch × {factor}"), scaled(own, [factor, factor, 1.0])));
    }
    for factor in HEIGHTS {
        sensors.push((format!("height × {factor}"), scaled(own, [1.0, 1.0, factor])));
    }
    if *own == regular(own) {
        for factor in COUNTS {
            let times = |count: usize| ((count as f64 * factor).round() as usize).max(1);
            let columns = Sensor { column_wires: times(own.column_wires), ..own.clone() };
            let on_column = Sensor {
                electrodes_per_column_wire: times(own.electrodes_per_column_wire),
                ..own.clone()
            };
            let rows = Sensor { row_wires: times(own.row_wires), ..own.clone() };
            let on_row = Sensor {
                electrodes_per_row_wire: times(own.electrodes_per_row_wire),
                ..own.clone()
            };
            sensors.push((format!("{} column-wires", columns.column_wires), regular(&columns)));
            let count = on_column.electrodes_per_column_wire;
            sensors.push((format!("{count} electrodes a column-wire"), regular(&on_column)));
            sensors.push((format!("{} row-wires", rows.row_wires), regular(&rows)));
            let count = on_row.electrodes_per_row_wire;
            sensors.push((format!("{count} electrodes a row-wire"), regular(&on_row)));
        }
    }
    sensors.into_iter().map(|(change, sensor)| variant(world, change, sensor)).collect()
}

fn variant(world: &World, change: String, sensor: Sensor) -> Variant {
    let read_rows: Vec<usize> = (0..sensor.row_wires).collect();
    let (readings, unknowns) = (
        sensor.row_wires * sensor.column_wires,
        3 * sensor.row_wires * sensor.electrodes_per_row_wire,
    );
    let world = World { sensor, read_rows, ..world.clone() };
    let found = match world.check() {
        Err(bad) => Err(format!("{}: {}", bad.value, bad.rule)),
        Ok(()) => observability(&world, &Prior::new(&world), &world.read_rows)
            .map_err(|refusal| refusal.to_string()),
    };
    let refused = found.as_ref().err().cloned();
    Variant { change, readings, unknowns, observability: found.ok(), refused }
}

/// The sensor stretched by these factors along x, y and z.
fn scaled(sensor: &Sensor, factors: [f64; 3]) -> Sensor {
    let stretch = |at: &[f64; 3]| [0, 1, 2].map(|axis| factors[axis] * at[axis]);
    Sensor {
        upper_electrodes_mm: sensor.upper_electrodes_mm.iter().map(stretch).collect(),
        lower_electrodes_mm: sensor.lower_electrodes_mm.iter().map(stretch).collect(),
        size_mm: stretch(&sensor.size_mm),
        ..sensor.clone()
    }
}

/// The sensor with its electrodes at the centres of equal cells.
fn regular(sensor: &Sensor) -> Sensor {
    let (upper, lower) = (
        sensor::default_upper_electrodes_mm(
            sensor.row_wires,
            sensor.electrodes_per_row_wire,
            sensor.size_mm,
        ),
        sensor::default_lower_electrodes_mm(
            sensor.column_wires,
            sensor.electrodes_per_column_wire,
            sensor.size_mm,
        ),
    );
    Sensor { upper_electrodes_mm: upper, lower_electrodes_mm: lower, ..sensor.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_columns_tell_more_and_a_thin_sensor_is_refused() {
        let variants = sweep(&World::paper());
        let of = |change: &str| variants.iter().find(|v| v.change == change).unwrap();
        let observable = |change| of(change).observability.as_ref().unwrap().observable;
        let z = |change| of(change).observability.as_ref().unwrap().axes[2].rmse_mm;
        assert!(z("36 column-wires") < z("as it is") && z("as it is") < z("9 column-wires"));
        assert!(observable("36 column-wires") >= observable("as it is"));
        let thin = of("height × 0.75");
        assert!(thin.observability.is_none() && thin.refused.as_ref().unwrap().contains("20 %"));
    }
}
