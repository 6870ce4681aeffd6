//! Geometry of a sensor, for drawings of it.

use taxel_simulate::World;

/// Electrodes that a drawing may have at most; with more, nothing could be told apart.
const MOST_ELECTRODES: usize = 4000;

/// Wires and electrodes of a sensor at rest, in plan view.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorSketch {
    /// Extent of the sensor in x and y, in mm.
    pub face_mm: [f64; 2],
    /// Row-wires, in the upper layer.
    pub row_wires: Vec<RowWire>,
    /// Numbers of the column-wires that are read, from 1.
    pub column_numbers: Vec<usize>,
    /// Electrodes of each of them, in the lower layer: x and y in mm.
    pub column_wires_mm: Vec<Vec<[f64; 2]>>,
}

/// Row-wire of a sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct RowWire {
    pub read: bool,
    /// Electrodes on it: x and y in mm.
    pub electrodes_mm: Vec<[f64; 2]>,
}

impl SensorSketch {
    /// Sketch of the sensor of `world`; `None` for one with too many electrodes to draw.
    pub fn new(world: &World) -> Option<Self> {
        let sensor = &world.sensor;
        let count = sensor.upper_electrodes_mm.len() + sensor.lower_electrodes_mm.len();
        let plan = |electrodes: &[[f64; 3]]| electrodes.iter().map(|[x, y, _]| [*x, *y]).collect();
        let row_wire = |row: usize| RowWire {
            read: world.read_rows.contains(&row),
            electrodes_mm: plan(sensor.row_electrodes_mm(row)),
        };
        let columns = sensor.lower_electrodes_mm.chunks(sensor.electrodes_per_column_wire.max(1));
        (count <= MOST_ELECTRODES).then(|| Self {
            face_mm: [sensor.size_mm[0], sensor.size_mm[1]],
            row_wires: (0..sensor.row_wires).map(row_wire).collect(),
            column_numbers: sensor.column_numbers().map(|number| number + 1).collect(),
            column_wires_mm: columns.map(plan).collect(),
        })
    }
}
