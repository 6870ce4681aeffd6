//! Lines of measurements with a value far from all others in its column: a broken wire, a garbled line.
//!
//! Inputs are scaled by their ranges, and weights come from least squares. One wild value makes the range so wide that
//! nothing else can be told apart, or pulls the weights. Lines with such a value are left out of training as a whole;
//! all other lines, and so all ranges, stay as they are.
//!
//! A value is an outlier if all of this holds:
//!
//! - At most three lines, or one of 200 if that is more, are as far out. A second cluster, such as 30 % of the lines, is
//!   no outlier.
//! - The gap to the next value is at least three times the range of all values below it (more for fewer than 333 lines),
//!   and wider than the outliers' own range, unless it is thirty times that range. Tails of real data are not that sparse: in five recordings of 1860 to
//!   4805 lines the widest such gap is 0.16 ranges, and in 3000 simulated frames of presses it is 0.44.
//! - The line is no rare press. A log may be at rest for 99 % of its lines, where every press stands far out. What tells
//!   a press is that readings and outputs change together: in such a line, a column of the other kind is far
//!   from its own bulk too, as it is in some other lines. A value that is far out even among presses is an outlier.
//! - The line is no rarer press that another one confirms: in two lines or more, readings and outputs are far from all
//!   others together, and about as much further in the one as in the other. One such line has nothing that confirms it.
//! - It is no rare event of an output that is else constant, such as a slip: without it there would be nothing to learn.
//!
//! If more lines than one of 200 have such a value, in different columns, they are left in and only reported: that is how a sensor with
//! separate cells looks, each of which is rarely touched.

use serde::Serialize;
use taxel_data::{Dataset, Table};

/// Least number of lines that tell what is usual.
const LEAST_LINES: usize = 20;
/// One of so many lines may have an outlier.
const ONE_IN: usize = 200;
/// Number of lines that may have an outlier however few lines there are.
const ALWAYS: usize = 3;
/// Gap to the next value, in ranges of all values below it, from which a value is an outlier.
const GAP: f64 = 3.0;
/// Gap from which values are outliers however far they are from each other, in ranges of all values below it.
const HUGE_GAP: f64 = 30.0;
/// Number of lines by which [`GAP`] grows for fewer lines: its product with the number of lines is at least so large.
const GAP_LINES: f64 = 1000.0;
/// Largest factor between the ratios of readings to outputs, by their distances, of presses that confirm one another.
const ALIKE: f64 = 3.0;
/// Distance from a column's bulk, in widths of the bulk, from which a value has left its rest.
const AWAY: f64 = 3.0;
/// One of so many values, at either end, is not of a column's bulk.
const BULK_ENDS: usize = 20;
/// Least share of lines that make a press: one of so many, and no fewer than [`ALWAYS`].
const PRESSED_ONE_IN: usize = 1000;

/// Value that is far from all others in its column.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outlier {
    /// Number of the line, as the reader of the file counts them.
    pub line: u64,
    /// Name of the column.
    pub column: String,
    /// Value, in the column's unit.
    pub value: f64,
    /// Smallest and largest of the other values, in the column's unit.
    pub usual: [f64; 2],
}

/// Outliers of a data set, and the frames without any.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Outliers {
    /// All outliers, by line and then column.
    pub found: Vec<Outlier>,
    /// Number of lines that hold them.
    pub lines: usize,
    /// Whether these lines are left out of training. They are not if they are too many to be outliers.
    pub left_out: bool,
    /// Indices of the frames to train on.
    #[serde(skip)]
    pub kept: Vec<usize>,
}

/// What is usual for a column.
struct Column {
    /// Value in the middle.
    median: f64,
    /// Range of the values that are no outliers.
    usual: [f64; 2],
    /// Range beyond which a value has left its rest; `None` if the column has no rest, or is not at rest in too few
    /// lines to tell.
    rest: Option<[f64; 2]>,
}

/// Finds the outliers of `dataset`; a missing value (NaN) is none. `line_number` gives the number of a frame's line, for messages.
pub fn find(dataset: &Dataset, line_number: impl Fn(usize) -> u64) -> Outliers {
    let frames = dataset.frames();
    let tables = [&dataset.inputs, &dataset.outputs];
    let mut columns = tables.map(|table| -> Vec<Column> {
        (0..table.names.len()).map(|c| Column::new(values(table, c))).collect()
    });
    // A rare event is all that such an output tells.
    for output in columns[1].iter_mut().filter(|it| it.usual[0].total_cmp(&it.usual[1]).is_eq()) {
        output.usual = [f64::NEG_INFINITY, f64::INFINITY];
    }
    let pressed =
        [0, 1].map(|t| Pressed::new(tables[t], &columns[t], tables[1 - t], &columns[1 - t]));
    let confirmed = confirmed(tables, &columns);
    let mut found = Vec::new();
    let (mut kept, mut lines) = (Vec::with_capacity(frames), 0);
    for (frame, is_confirmed) in confirmed.iter().enumerate() {
        let far = |t: usize| {
            let named = tables[t].names.iter().zip(tables[t].line(frame)).zip(&columns[t]);
            named.filter(|((_, value), column)| is_outside(**value, column.usual))
        };
        let is_explained = |t: usize| pressed[t].explains(frame) || *is_confirmed;
        let of_line = (0..2).filter(|t| !is_explained(*t)).flat_map(far);
        let before = found.len();
        found.extend(of_line.map(|((name, value), column)| Outlier {
            line: line_number(frame),
            column: name.clone(),
            value: *value,
            usual: column.usual,
        }));
        if found.len() == before { kept.push(frame) } else { lines += 1 }
    }
    let left_out = lines <= most(frames);
    if !left_out {
        kept = (0..frames).collect();
    }
    Outliers { found, lines, left_out: left_out && lines > 0, kept }
}

/// Whether each line is a rare press that another one confirms.
fn confirmed(tables: [&Table; 2], columns: &[Vec<Column>; 2]) -> Vec<bool> {
    // How far out the furthest value of a line is, in usual ranges of its column.
    let distance = |t: usize, frame: usize| {
        let values = tables[t].line(frame).iter().zip(&columns[t]);
        let outside = values.filter(|(value, column)| is_outside(**value, column.usual));
        let distances = outside.map(|(value, column)| {
            let range = column.usual[1] - column.usual[0];
            (value - column.median).abs() / range.max(resolution(column.median))
        });
        distances.fold(0.0, f64::max)
    };
    let ratio = |frame: usize| {
        let [inputs, outputs] = [0, 1].map(|t| distance(t, frame));
        (inputs > 0.0 && outputs > 0.0).then(|| (inputs / outputs, frame))
    };
    let mut ratios: Vec<(f64, usize)> = (0..tables[0].len()).filter_map(ratio).collect();
    ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut confirmed = vec![false; tables[0].len()];
    // Of all others, the neighbours in this order are the most alike.
    for pair in ratios.windows(2) {
        if pair[1].0 <= ALIKE * pair[0].0 {
            pair.iter().for_each(|(_, frame)| confirmed[*frame] = true);
        }
    }
    confirmed
}

/// Most lines that can hold outliers.
fn most(lines: usize) -> usize {
    (lines / ONE_IN).max(ALWAYS)
}

fn is_outside(value: f64, [low, high]: [f64; 2]) -> bool {
    value < low || value > high
}

/// Values of column number `column` in ascending order, without those that are missing.
fn values(table: &Table, column: usize) -> Vec<f64> {
    let all = table.values.iter().skip(column).step_by(table.names.len()).copied();
    let mut values: Vec<f64> = all.filter(|value| !value.is_nan()).collect();
    values.sort_by(f64::total_cmp);
    values
}

impl Column {
    /// Column of values in ascending order.
    fn new(mut values: Vec<f64>) -> Self {
        let count = values.len();
        if count < LEAST_LINES {
            let usual = [f64::NEG_INFINITY, f64::INFINITY];
            return Self { median: 0.0, usual, rest: None };
        }
        let (rest, median) = (rest(&values), values[count / 2]);
        // As many of the smallest values may be outliers themselves.
        let high = values[count - 1 - far_above(&values, values[most(count)])];
        values.reverse();
        values.iter_mut().for_each(|value| *value = -*value);
        let low = -values[count - 1 - far_above(&values, values[most(count)])];
        Self { median, usual: [low, high], rest }
    }
}

/// Lines in which another table has left its rest: presses, where values far from all others are right.
struct Pressed {
    /// For each line, how far any value is from its column's middle; 0 if the line is no press.
    distances: Vec<f64>,
    /// Distance beyond which even a press does not explain a value.
    largest: f64,
}

impl Pressed {
    /// Presses that `other` shows, and the distances of `table` in them.
    fn new(table: &Table, columns: &[Column], other: &Table, of_other: &[Column]) -> Self {
        let moved = |frame: usize| {
            let mut values = other.line(frame).iter().zip(of_other);
            values.any(|(v, column)| column.rest.is_some_and(|rest| is_outside(*v, rest)))
        };
        let distance = |frame: usize| {
            let values = table.line(frame).iter().zip(columns);
            values.map(|(value, column)| (value - column.median).abs()).fold(0.0, f64::max)
        };
        let distances: Vec<f64> = (0..table.len())
            .map(|frame| if moved(frame) { distance(frame) } else { 0.0 })
            .collect();
        let mut sorted: Vec<f64> = distances.iter().copied().filter(|d| *d > 0.0).collect();
        sorted.sort_by(f64::total_cmp);
        let largest = if sorted.len() < LEAST_LINES {
            f64::INFINITY
        } else {
            sorted[sorted.len() - 1 - far_above(&sorted, 0.0)]
        };
        Self { distances, largest }
    }

    /// Whether a press explains what stands far out in a line.
    fn explains(&self, frame: usize) -> bool {
        let distance = self.distances.get(frame).copied().unwrap_or(0.0);
        distance > 0.0 && distance <= self.largest
    }
}

/// Number of the largest values that are far above all others, of values in ascending order. The others begin at `low`.
fn far_above(values: &[f64], low: f64) -> usize {
    let (count, most) = (values.len(), most(values.len()));
    let gap_factor = GAP.max(GAP_LINES / count as f64);
    let mut far = 0;
    for m in 1..=most {
        let (next, first) = (values[count - 1 - m], values[count - m]);
        let own_range = values[count - 1 - far] - first;
        let below = (next - low).max(resolution(next));
        let gap = first - next;
        if gap > gap_factor * below && (gap > own_range || gap > HUGE_GAP * below) {
            far = m;
        }
    }
    far
}

/// Range beyond which a value has left its rest, of values in ascending order. `None` if fewer values do than make a
/// press.
fn rest(values: &[f64]) -> Option<[f64; 2]> {
    let count = values.len();
    let (low, high) = (values[count / BULK_ENDS], values[count - 1 - count / BULK_ENDS]);
    let away = AWAY * (high - low).max(resolution(low)).max(resolution(high));
    let rest = [low - away, high + away];
    let left = values.iter().filter(|value| is_outside(**value, rest)).count();
    (left >= ALWAYS.max(count / PRESSED_ONE_IN)).then_some(rest)
}

/// Difference that f32 cannot tell from none.
fn resolution(value: f64) -> f64 {
    f64::from(f32::EPSILON) * value.abs()
}
