//! Faces: where values are drawn in maps, over the sensor or over its wires.

use taxel_evaluate::evaluate::distribution::{Distribution, ShownReadings};
use taxel_evaluate::run::SensorSketch;

use super::ticks;
use super::voronoi::{self, Polygon};

/// Place of one value.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Name in the hover text.
    pub name: String,
    /// Middle, where its number stands.
    pub middle: [f64; 2],
    pub outline: Polygon,
}

/// Places of values in maps.
#[derive(Debug, Clone, PartialEq)]
pub struct Face {
    /// Least x and y that are drawn.
    pub low: [f64; 2],
    /// Greatest x and y that are drawn.
    pub high: [f64; 2],
    /// Extent of the sensor from [0, 0], if it is drawn.
    pub outline: Option<[f64; 2]>,
    /// Quantities along x and y, with units.
    pub labels: [&'static str; 2],
    /// Ticks along x and y.
    pub ticks: [Vec<(f64, String)>; 2],
    /// Number of each row-wire, and the y at which it stands beside the map.
    pub row_wires: Vec<(usize, f64)>,
    /// Height of a map over its width.
    pub height_over_width: f64,
    pub cells: Vec<Cell>,
    /// Row-wire and electrode (or column-wire) of each place, from 1.
    pub wires: Vec<[usize; 2]>,
}

impl Face {
    /// Face for the electrodes of `shown`: the sensor's where its sketch is known, else a grid of row-wires and
    /// electrodes. `None` if an output belongs to no electrode.
    pub fn of_electrodes(shown: &Distribution, sensor: Option<&SensorSketch>) -> Option<Self> {
        let mut wires: Vec<[usize; 2]> = Vec::new();
        for output in &shown.outputs {
            let electrode = output.electrode?;
            if !wires.contains(&electrode) {
                wires.push(electrode);
            }
        }
        let name = |[row, electrode]: [usize; 2]| format!("row-wire {row}, electrode {electrode}");
        let known = sensor.filter(|sensor| {
            let has = |[row, electrode]: &[usize; 2]| {
                sensor.row_wires.get(row - 1).is_some_and(|it| *electrode <= it.electrodes_mm.len())
            };
            wires.iter().all(has)
        });
        match known {
            Some(sensor) => Some(Self::of_sensor(sensor, wires, name)),
            None => (!wires.is_empty()).then(|| Self::of_grid(wires, "electrode", name)),
        }
    }

    /// Face for readings, row-wire over column-wire. `None` if their names do not tell wires.
    pub fn of_readings(readings: &ShownReadings) -> Option<Self> {
        let name = |[row, column]: [usize; 2]| format!("row-wire {row}, column-wire {column}");
        (!readings.wires.is_empty())
            .then(|| Self::of_grid(readings.wires.clone(), "column-wire", name))
    }

    /// Face without places of values, in mm, for marks that lie anywhere.
    pub fn blank(low: [f64; 2], high: [f64; 2], outline: Option<[f64; 2]>) -> Self {
        Self {
            low,
            high,
            outline,
            labels: ["x (mm)", "y (mm)"],
            ticks: [0, 1].map(|axis| inside(low[axis], high[axis])),
            row_wires: vec![],
            height_over_width: ((high[1] - low[1]) / (high[0] - low[0])).clamp(0.25, 2.0),
            cells: vec![],
            wires: vec![],
        }
    }

    fn of_sensor(
        sensor: &SensorSketch,
        wires: Vec<[usize; 2]>,
        name: impl Fn([usize; 2]) -> String,
    ) -> Self {
        let (low, high) = extent(sensor);
        let sites: Vec<[f64; 2]> =
            sensor.row_wires.iter().flat_map(|row| row.electrodes_mm.iter().copied()).collect();
        let first: Vec<usize> = sensor
            .row_wires
            .iter()
            .scan(0, |next, row| {
                *next += row.electrodes_mm.len();
                Some(*next - row.electrodes_mm.len())
            })
            .collect();
        let outlines = voronoi::cells(&sites, low, high);
        let cell = |wires: &[usize; 2]| {
            let site = first[wires[0] - 1] + wires[1] - 1;
            Cell { name: name(*wires), middle: sites[site], outline: outlines[site].clone() }
        };
        Self {
            low,
            high,
            outline: Some(sensor.face_mm),
            labels: ["x (mm)", "y (mm)"],
            ticks: [0, 1].map(|axis| inside(low[axis], high[axis])),
            row_wires: row_wires(sensor),
            height_over_width: (high[1] - low[1]) / (high[0] - low[0]),
            cells: wires.iter().map(cell).collect(),
            wires,
        }
    }

    fn of_grid(
        wires: Vec<[usize; 2]>,
        along_x: &'static str,
        name: impl Fn([usize; 2]) -> String,
    ) -> Self {
        // Wires that are not read have no place.
        let numbers = |axis: usize| {
            let mut numbers: Vec<usize> = wires.iter().map(|wires| wires[axis]).collect();
            numbers.sort_unstable();
            numbers.dedup();
            numbers
        };
        let (rows, columns) = (numbers(0), numbers(1));
        let place = |numbers: &[usize], number: usize| {
            numbers.iter().position(|known| *known == number).unwrap_or(0) as f64 + 0.5
        };
        let cell = |wires: &[usize; 2]| {
            let middle @ [x, y] = [place(&columns, wires[1]), place(&rows, wires[0])];
            let corner = |dx: f64, dy: f64| [x + dx, y + dy];
            let outline =
                vec![corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)];
            Cell { name: name(*wires), middle, outline }
        };
        let labelled = |numbers: &[usize]| {
            numbers.iter().map(|number| (place(numbers, *number), number.to_string())).collect()
        };
        let high = [columns.len() as f64, rows.len() as f64];
        Self {
            low: [0.0, 0.0],
            high,
            outline: None,
            labels: [along_x, "row-wire"],
            ticks: [labelled(&columns), labelled(&rows)],
            row_wires: vec![],
            height_over_width: (high[1] / high[0]).clamp(0.25, 0.8),
            cells: wires.iter().map(cell).collect(),
            wires,
        }
    }

    /// Values of one `group`, by place, from a `line` of outputs; NaN where the group has none.
    pub fn values(&self, shown: &Distribution, group: &str, line: &[f64]) -> Vec<f64> {
        let value = |wires: &[usize; 2]| {
            let mut outputs = shown.outputs.iter().zip(line);
            let of = outputs.find(|(o, _)| o.group == group && o.electrode == Some(*wires));
            of.map_or(f64::NAN, |(_, value)| *value)
        };
        self.wires.iter().map(value).collect()
    }

    /// Distance between neighbours that is typical: the root of a cell's share of the face.
    pub fn spacing(&self) -> f64 {
        let area = (self.high[0] - self.low[0]) * (self.high[1] - self.low[1]);
        (area / self.cells.len().max(1) as f64).sqrt()
    }
}

/// Least and greatest x and y of a sensor: its face, and electrodes that lie beside it, with some room around them.
pub fn extent(sensor: &SensorSketch) -> ([f64; 2], [f64; 2]) {
    let (mut low, mut high): ([f64; 2], [f64; 2]) = ([0.0, 0.0], sensor.face_mm);
    let upper = sensor.row_wires.iter().map(|row| &row.electrodes_mm);
    for point in upper.chain(&sensor.column_wires_mm).flatten() {
        for axis in 0..2 {
            let room = 0.03 * sensor.face_mm[axis];
            if point[axis] < 0.0 {
                low[axis] = low[axis].min(point[axis] - room);
            }
            if point[axis] > sensor.face_mm[axis] {
                high[axis] = high[axis].max(point[axis] + room);
            }
        }
    }
    (low, high)
}

/// Round ticks from `low` to `high`.
pub fn inside(low: f64, high: f64) -> Vec<(f64, String)> {
    let mut ticks = ticks::linear([low, high], 4).at;
    let slack = 1e-9 * (high - low);
    ticks.retain(|(value, _)| (low - slack..=high + slack).contains(value));
    ticks
}

/// Row-wires that are read, each at the y of its electrode farthest to the right. None if they do not lie one above
/// the other there.
fn row_wires(sensor: &SensorSketch) -> Vec<(usize, f64)> {
    let rows = sensor.row_wires.iter().enumerate().filter(|(_, row)| row.read);
    let at = rows.filter_map(|(row, wire)| {
        let last = wire.electrodes_mm.iter().max_by(|a, b| a[0].total_cmp(&b[0]))?;
        Some((row + 1, last[1]))
    });
    let mut at: Vec<(usize, f64)> = at.collect();
    at.sort_by(|a, b| a.1.total_cmp(&b.1));
    let least = 0.5 * sensor.face_mm[1] / sensor.row_wires.len().max(1) as f64;
    let apart = at.windows(2).all(|pair| pair[1].1 - pair[0].1 > 0.3 * least);
    if apart { at } else { vec![] }
}
