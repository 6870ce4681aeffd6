//! Faces: where values are drawn in maps, over the sensor or over its wires.

use std::collections::BTreeSet;

use taxel_evaluate::evaluate::distribution::{Distribution, ShownReadings};
use taxel_evaluate::run::SensorSketch;

use super::axes::Axis;
use super::data::{Data, number};
use super::ticks::{self, Ticks};
use super::voronoi::{self, Polygon};

/// Place of one value.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Middle, where its number stands.
    pub middle: [f64; 2],
    pub outline: Polygon,
}

/// Places of values in maps.
#[derive(Debug, Clone, PartialEq)]
pub struct Face {
    /// Axes x and y: all that is drawn lies within them.
    pub axes: [Axis; 2],
    /// Extent of the sensor from [0, 0], if it is drawn.
    pub outline: Option<[f64; 2]>,
    /// Number of each row-wire, and the y at which it stands beside the map.
    pub row_wires: Vec<(usize, f64)>,
    /// Height of a map over its width.
    pub height_over_width: f64,
    pub cells: Vec<Cell>,
    /// Row-wire and electrode (or column-wire) of each place, from 1.
    pub wires: Vec<[usize; 2]>,
    /// What the second of these numbers counts.
    pub along_row: &'static str,
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
        let known = sensor.filter(|sensor| {
            let has = |[row, electrode]: &[usize; 2]| {
                sensor.row_wires.get(row - 1).is_some_and(|it| *electrode <= it.electrodes_mm.len())
            };
            wires.iter().all(has)
        });
        match known {
            Some(sensor) => Some(Self::of_sensor(sensor, wires)),
            None => (!wires.is_empty()).then(|| Self::of_grid(wires, "electrode")),
        }
    }

    /// Face for readings, row-wire over column-wire. `None` if their names do not tell wires.
    pub fn of_readings(readings: &ShownReadings) -> Option<Self> {
        let [rows, columns] =
            [0, 1].map(|of| with_gaps(readings.wires.iter().map(|wire| wire[of]).collect()));
        // Cells that are not read come last: they have no value.
        let mut wires = readings.wires.clone();
        let all = rows.iter().flat_map(|row| columns.iter().map(|column| [*row, *column]));
        wires.extend(all.filter(|cell| !readings.wires.contains(cell)));
        (!wires.is_empty()).then(|| Self::of_grid(wires, "column-wire"))
    }

    /// Face without places of values, in mm, for marks that lie anywhere.
    pub fn blank(low: [f64; 2], high: [f64; 2], outline: Option<[f64; 2]>) -> Self {
        Self {
            axes: axes_mm(low, high),
            outline,
            row_wires: vec![],
            height_over_width: ((high[1] - low[1]) / (high[0] - low[0])).clamp(0.25, 2.0),
            cells: vec![],
            wires: vec![],
            along_row: "electrode",
        }
    }

    /// Face with a rectangle of `size_mm` around each of these places, which are electrodes of `row_wires`, row after row.
    pub fn of_rectangles(
        face_mm: [f64; 2],
        size_mm: [f64; 2],
        places: &[[f64; 2]],
        row_wires: &[usize],
    ) -> Self {
        let per_row = (places.len() / row_wires.len().max(1)).max(1);
        let number = |i: usize| [row_wires[i / per_row], i % per_row + 1];
        let cell =
            |middle: &[f64; 2]| Cell { middle: *middle, outline: rectangle(*middle, size_mm) };
        let cells: Vec<Cell> = places.iter().map(cell).collect();
        // Electrodes may be listed outside the face.
        let extent = |axis: usize| {
            let corners = cells.iter().flat_map(|cell| cell.outline.iter().map(|at| at[axis]));
            ticks::extent(corners.chain([0.0, face_mm[axis]])).unwrap_or((0.0, 1.0))
        };
        let ((left, right), (bottom, top)) = (extent(0), extent(1));
        let heights = row_wires.iter().zip(places.chunks(per_row));
        Self {
            row_wires: heights.map(|(row, places)| (*row, places[0][1])).collect(),
            cells,
            wires: (0..places.len()).map(number).collect(),
            ..Self::blank([left, bottom], [right, top], Some(face_mm))
        }
    }

    fn of_sensor(sensor: &SensorSketch, wires: Vec<[usize; 2]>) -> Self {
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
            Cell { middle: sites[site], outline: outlines[site].clone() }
        };
        Self {
            row_wires: row_wires(sensor),
            cells: wires.iter().map(cell).collect(),
            wires,
            ..Self::blank(low, high, Some(sensor.face_mm))
        }
    }

    fn of_grid(wires: Vec<[usize; 2]>, along_row: &'static str) -> Self {
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
            let middle = [place(&columns, wires[1]), place(&rows, wires[0])];
            Cell { middle, outline: rectangle(middle, [1.0, 1.0]) }
        };
        let axis = |label: &str, numbers: &[usize]| {
            let at = numbers.iter().map(|number| (place(numbers, *number), number.to_string()));
            let ticks = Ticks { low: 0.0, high: numbers.len() as f64, at: at.collect() };
            Axis::linear(label, ticks)
        };
        let share = rows.len() as f64 / columns.len() as f64;
        Self {
            axes: [axis(along_row, &columns), axis("row-wire", &rows)],
            outline: None,
            row_wires: vec![],
            height_over_width: share.clamp(0.25, 0.8),
            cells: wires.iter().map(cell).collect(),
            wires,
            along_row,
        }
    }

    /// Name of a place in hover texts.
    pub fn name(&self, place: usize) -> String {
        let [row, number] = self.wires[place];
        format!("row-wire {row}, {} {number}", self.along_row)
    }

    /// Table with a line for each place: its numbers, where it is if that is known, and what `values` has for it under
    /// these `heads`.
    pub fn data(&self, heads: &[&str], values: impl Fn(usize) -> Vec<String>) -> Data {
        let is_known = self.outline.is_some();
        let where_it_is: &[&str] = if is_known { &["x (mm)", "y (mm)"] } else { &[] };
        let mut data = Data::new(&[&["row-wire", self.along_row], where_it_is, heads].concat());
        for (place, (numbers, cell)) in self.wires.iter().zip(&self.cells).enumerate() {
            let numbers = numbers.iter().map(ToString::to_string);
            let middle = cell.middle.iter().filter(|_| is_known).map(|at| number(*at));
            data.lines.push(numbers.chain(middle).chain(values(place)).collect());
        }
        data
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
        let [x, y] = self.axes.each_ref().map(|axis| axis.ticks.high - axis.ticks.low);
        let area = x * y;
        (area / self.cells.len().max(1) as f64).sqrt()
    }
}

/// Rectangle of this size about its middle.
fn rectangle([x, y]: [f64; 2], [width, height]: [f64; 2]) -> Polygon {
    let corner = |dx: f64, dy: f64| [x + dx * width, y + dy * height];
    vec![corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)]
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

/// Axes of places in mm.
pub fn axes_mm(low: [f64; 2], high: [f64; 2]) -> [Axis; 2] {
    [("x (mm)", 0), ("y (mm)", 1)]
        .map(|(label, axis)| Axis::linear(label, ticks::within(low[axis], high[axis], 4)))
}

/// These wires, and those between them that are not read if they are the fewer ones: dead, and not left out by choice.
fn with_gaps(wires: BTreeSet<usize>) -> BTreeSet<usize> {
    match (wires.first(), wires.last()) {
        (Some(first), Some(last)) if 2 * wires.len() > last + 1 - first => {
            (*first..=*last).collect()
        }
        _ => wires,
    }
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
