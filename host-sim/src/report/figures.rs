//! Figures of the report, with their captions.

use super::chart::{Axis, Chart, Mark, Series};
use super::format::{percent, quantity, significant, symbol, with_unit};
use super::heat_map::{ColourScale, HeatMap};
use super::svg::Shape;
use super::tables::rmse;
use super::ticks;
use taxel_learn::decoders::{linear, mean, standard};
use taxel_limit::limit;

use crate::evaluate::table1::{Column, NETWORK, Table1};
use crate::run::{Example, ExampleOutput, RunResult};

/// Figure without its number.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Description of the figure, with units.
    pub caption: String,
    /// Drawings of the figure, as SVG.
    pub drawing: String,
}

const WIDE: [f64; 2] = [920.0, 230.0];
const WIDE_SINGLE: [f64; 2] = [920.0, 340.0];
const NARROW: [f64; 2] = [360.0, 270.0];

/// Choice of the example frame in words, for captions.
pub fn chosen(result: &RunResult) -> String {
    format!("test frame {} (from 0), the one with the largest output", result.example.frame)
}

/// Values of a row with their positions, from 1.
fn numbered(values: &[f64]) -> Vec<[f64; 2]> {
    values.iter().enumerate().map(|(i, value)| [i as f64 + 1.0, *value]).collect()
}

fn difference(of: &[f64], to: &[f64]) -> Vec<f64> {
    of.iter().zip(to).map(|(a, b)| a - b).collect()
}

/// Figure of the readings of one row-wire, ideal and noisy, and their difference.
pub fn readings(result: &RunResult) -> Figure {
    let example = &result.example;
    let row_wire = example.reading_row_wire;
    let count = example.ideal_ohm.len();
    let x = || {
        let at = (1..=count).map(|k| (k as f64, k.to_string())).collect();
        let ticks = ticks::Ticks { low: 0.5, high: count as f64 + 0.5, at };
        Axis::linear("column-wire", ticks)
    };
    let (ideal, noisy) = (numbered(&example.ideal_ohm), numbered(&example.noisy_ohm));
    let all = example.ideal_ohm.iter().chain(&example.noisy_ohm).copied();
    let readings = Chart {
        title: format!("Readings of row-wire {row_wire} against column-wire, ideal and noisy"),
        x: x(),
        y: Axis::linear("row–column resistance (Ω)", ticks::linear(all, 5)),
        series: vec![
            Series::new("ideal", "truth", Mark::Line, ideal),
            Series::new("noisy, as decoded", "c1", Mark::Points(Shape::Circle), noisy),
        ],
        bands: vec![],
        notes: vec![],
        end_labels: false,
    };
    let noise_ohm = difference(&example.noisy_ohm, &example.ideal_ohm);
    let noise = Chart {
        title: format!("Noise in the readings of row-wire {row_wire}"),
        x: x(),
        y: Axis::linear(
            "noisy − ideal (Ω)",
            ticks::linear(noise_ohm.iter().copied().chain([0.0]), 4),
        ),
        series: vec![Series::new("", "c1", Mark::Bars(0.6), numbered(&noise_ohm))],
        bands: vec![],
        notes: vec![],
        end_labels: false,
    };
    Figure {
        caption: format!(
            "Readings of row-wire {row_wire} in Ω against column-wire: without noise, and as the \
             network received them ({} noise of {}). Below, the difference of the two. The example \
             is {}; row-wire {row_wire} holds that output.",
            result.scene.noise_kind,
            percent(result.scene.noise_level),
            chosen(result)
        ),
        drawing: readings.draw_responsive(WIDE_SINGLE, NARROW)
            + &noise.draw_responsive([920.0, 190.0], [360.0, 200.0]),
    }
}

/// Axis of electrodes, row-wire after row-wire, and the bands that separate row-wires.
fn electrodes(result: &RunResult) -> (Axis, Vec<[f64; 2]>) {
    let count = result.example.electrodes_mm.len();
    let rows = result.rows.len().max(1);
    let per_row = (count / rows).max(1);
    let edge = |row: usize| (row * per_row) as f64 + 0.5;
    let (label, at) = if let [row] = &result.rows[..] {
        let at = (1..=count).map(|i| (i as f64, i.to_string())).collect();
        (format!("electrode of row-wire {}", row.row_wire), at)
    } else {
        let middle = |row: usize| f64::midpoint(edge(row), edge(row + 1));
        let numbers = result.rows.iter().enumerate();
        let at = numbers.map(|(row, errors)| (middle(row), errors.row_wire.to_string())).collect();
        (format!("row-wire ({per_row} electrodes on each)"), at)
    };
    let ticks = ticks::Ticks { low: 0.5, high: count as f64 + 0.5, at };
    let bands = (0..rows).filter(|row| row % 2 == 1).map(|row| [edge(row), edge(row + 1)]);
    (Axis::linear(label, ticks), bands.collect())
}

/// Figure of truth and estimate by electrode: one chart an axis.
pub fn by_electrode(result: &RunResult) -> Figure {
    let chart = |output: &ExampleOutput| {
        let (x, bands) = electrodes(result);
        let (truth, estimate) = (numbered(&output.truth), numbered(&output.estimate));
        let all = output.truth.iter().chain(&output.estimate).copied().chain([0.0]);
        let name = symbol(&output.group);
        Chart {
            title: format!("{name} by electrode, true and decoded"),
            x,
            y: Axis::linear(with_unit(&name, &output.unit), ticks::linear(all, 4)),
            series: vec![
                Series::new("", "c1", Mark::From(output.truth.clone()), estimate.clone()),
                Series::new("true", "truth", Mark::Points(Shape::Dash), truth),
                Series::new("decoded", "c1", Mark::Points(Shape::Circle), estimate),
            ],
            bands,
            notes: vec![],
            end_labels: false,
        }
    };
    Figure {
        caption: format!(
            "{} of every electrode, true and decoded, in {}. A thin line joins the two. \
             {}",
            what_is_decoded(result),
            chosen(result),
            if result.example.outputs.len() > 1 { "Each axis has its own scale." } else { "" }
        ),
        drawing: result
            .example
            .outputs
            .iter()
            .map(|output| chart(output).draw_responsive(WIDE, NARROW))
            .collect(),
    }
}

fn what_is_decoded(result: &RunResult) -> &'static str {
    match result.example.outputs.first().map(|output| quantity(&output.group)) {
        Some("deformation") => "Deformation",
        Some("force") => "Force",
        _ => "Output",
    }
}

/// Figure of errors by electrode: one chart an axis.
pub fn error_by_electrode(result: &RunResult) -> Figure {
    let outputs = &result.example.outputs;
    let error = |output: &ExampleOutput| difference(&output.estimate, &output.truth);
    let chart = |output: &ExampleOutput| {
        let (x, bands) = electrodes(result);
        let name = symbol(&output.group);
        let same_unit = outputs.iter().filter(|other| other.unit == output.unit);
        let all = same_unit.flat_map(error).chain([0.0]);
        Chart {
            title: format!("Error of {name} by electrode"),
            x,
            y: Axis::linear(
                with_unit(&format!("error of {name}"), &output.unit),
                ticks::linear(all, 4),
            ),
            series: vec![Series::new("", "c2", Mark::Bars(0.7), numbered(&error(output)))],
            bands,
            notes: vec![],
            end_labels: false,
        }
    };
    Figure {
        caption: format!(
            "Error (decoded − true) of every electrode in {}.{}",
            chosen(result),
            if outputs.len() > 1 { " All axes share one scale." } else { "" }
        ),
        drawing: outputs
            .iter()
            .map(|output| chart(output).draw_responsive([920.0, 200.0], [360.0, 220.0]))
            .collect(),
    }
}

/// Output that maps and sweeps show: z if there is one.
pub fn shown(example: &Example) -> Option<&ExampleOutput> {
    let z = |output: &&ExampleOutput| super::format::axis(&output.group) == Some('z');
    example.outputs.iter().find(z).or(example.outputs.last())
}

/// Figure of maps over the face: true, decoded, difference.
pub fn maps(result: &RunResult, output: &ExampleOutput) -> Figure {
    let [x_mm, y_mm, _] = result.scene.size_mm;
    let example = &result.example;
    let per_row = example.electrodes_mm.len() / result.rows.len().max(1);
    let row_wires = result.rows.iter().zip(example.electrodes_mm.chunks(per_row.max(1)));
    let (name, unit) = (symbol(&output.group), output.unit.as_str());
    let error = difference(&output.estimate, &output.truth);
    let panels =
        [("true", &output.truth), ("decoded", &output.estimate), ("decoded − true", &error)];
    let scale = ColourScale::new(panels.iter().flat_map(|(_, values)| values.iter().copied()));
    let mut drawing = String::from("<div class=\"panels\">\n");
    for (what, values) in panels {
        let map = HeatMap {
            title: format!("Map of {name} over the face, {what}"),
            heading: format!("{name}, {what}"),
            face_mm: [x_mm, y_mm],
            cell_mm: [x_mm / per_row.max(1) as f64, y_mm / result.scene.row_wires.max(1) as f64],
            cells: example.electrodes_mm.iter().copied().zip(values.iter().copied()).collect(),
            row_wires: row_wires
                .clone()
                .map(|(row, electrodes)| (row.row_wire, electrodes.first().map_or(0.0, |e| e[1])))
                .collect(),
        };
        drawing += &map.draw(&scale);
    }
    drawing += "</div>\n<div class=\"scale\">\n";
    drawing += &scale.draw_bar(
        &format!("Colour scale of {name}"),
        &with_unit(&format!("{name} and its error"), unit),
    );
    drawing += "</div>\n";
    let unread =
        if result.rows.len() < result.scene.row_wires { " Blank rows are not read." } else { "" };
    Figure {
        caption: format!(
            "Map of {name} over the face in {}: true, decoded, and their difference, in {unit}, \
             seen from above. Each cell stands around its electrode at rest; all maps share one \
             colour scale.{unread}",
            chosen(result)
        ),
        drawing,
    }
}

/// Least RMSE of a decoder over its spreads, or its only one; NaN without a finite one.
fn best(column: &Column, decoder: &str, group: &str) -> f64 {
    let entries = column.decoders.iter().filter(|entry| entry.decoder == decoder);
    let finite = entries.map(|entry| rmse(&entry.errors, group)).filter(|rmse| rmse.is_finite());
    finite.min_by(f64::total_cmp).unwrap_or(f64::NAN)
}

/// Names of the table's decoders, in the order in which their lines are drawn.
fn decoder_names(table: &Table1) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for entry in table.columns.iter().flat_map(|column| &column.decoders) {
        if !names.contains(&entry.decoder.as_str()) {
            names.push(&entry.decoder);
        }
    }
    names.sort_by_key(|name| match *name {
        mean::NAME => 0,
        standard::NAME => 1,
        NETWORK => 2,
        _ => 3,
    });
    names
}

/// CSS class and mark of a decoder's line.
fn line_style(decoder: &str) -> (&'static str, Mark) {
    match decoder {
        mean::NAME => ("muted", Mark::Dashed),
        standard::NAME => ("c2", Mark::LineAnd(Shape::Square)),
        NETWORK => ("c1", Mark::LineAnd(Shape::Circle)),
        // A broken line, so that it can be seen together with a network that is no better.
        linear::NAME => ("c3 broken", Mark::LineAnd(Shape::Triangle)),
        limit::NAME => ("truth", Mark::Dotted),
        _ => ("c4", Mark::LineAnd(Shape::Diamond)),
    }
}

/// Figure of error against noise, by decoder.
pub fn error_by_noise(table: &Table1, group: &str, unit: &str) -> Figure {
    let positive = || table.columns.iter().filter(|column| column.noise_level > 0.0);
    let points = |decoder: &str| -> Vec<[f64; 2]> {
        positive().map(|column| [column.noise_level, best(column, decoder, group)]).collect()
    };
    let mut lines: Vec<(&str, Vec<[f64; 2]>)> =
        decoder_names(table).into_iter().map(|name| (name, points(name))).collect();
    let least = positive().filter_map(|column| {
        let limit = column.limit.groups.iter().find(|limit| limit.group == group)?;
        Some([column.noise_level, limit.limit])
    });
    let least: Vec<[f64; 2]> = least.collect();
    let known = if least.is_empty() {
        ""
    } else {
        lines.push((limit::NAME, least));
        " Limit: the least possible RMSE of any decoder of the whole frame."
    };
    let heights = |of_standard: bool| {
        let lines = lines.iter().filter(move |(name, _)| (*name == standard::NAME) == of_standard);
        lines.flat_map(|(_, points)| points.iter().map(|[_, y]| *y))
    };
    // The standard network's error may be larger by orders of magnitude; the others must stay apart.
    let most = 2.0 * ticks::extent(heights(false)).map_or(f64::INFINITY, |(_, high)| high);
    let near = heights(true).filter(|y| *y <= most);
    let y = ticks::linear(heights(false).chain(near).chain([0.0]), 5);
    let clipped = heights(true).any(|y| y > most);

    let name = symbol(group);
    let noise = ticks::logarithmic_percent(positive().map(|column| column.noise_level));
    let series = lines.into_iter().map(|(name, mut points)| {
        // A reference line runs from edge to edge.
        if name == mean::NAME
            && let [[_, first], .., [_, last]] | [[_, first @ last]] = points[..]
        {
            points.insert(0, [noise.low, first]);
            points.push([noise.high, last]);
        }
        let (class, mark) = line_style(name);
        Series::new(name, class, mark, points)
    });
    let series = series.collect();
    let chart = Chart {
        title: format!("RMSE of {name} against noise level, by decoder"),
        x: Axis { label: "noise level p".into(), ticks: noise, logarithmic: true },
        y: Axis::linear(with_unit(&format!("RMSE of {name}"), unit), y),
        series,
        bands: vec![],
        notes: vec![],
        end_labels: true,
    };
    let tail = if table.affine_tail { " and an affine tail" } else { "" };
    let clipped = if clipped {
        " Arrows at the upper edge mark values off the scale, with their numbers."
    } else {
        ""
    };
    let silent = if positive().count() < table.columns.len() {
        " The level without noise has no place on a logarithmic axis and is in the table only."
    } else {
        ""
    };
    Figure {
        caption: format!(
            "RMSE of {name} in {unit} against noise level (logarithmic). Network: K = {} \
             centres{tail}, {} training frames. Standard: the standard RBF network, one centre for \
             each of its {} training frames. Both are shown at their best spread of the table, \
             chosen on the test frames. Linear: the best linear decoder. Mean: always the training \
             mean.{known}{clipped}{silent}",
            table.centres,
            super::format::grouped(table.training_frames),
            table.standard_frames
        ),
        drawing: chart.draw_responsive(WIDE_SINGLE, NARROW),
    }
}

const SHAPES: [Shape; 4] = [Shape::Circle, Shape::Square, Shape::Triangle, Shape::Diamond];

/// Figure of error against spread, one line a noise level.
pub fn error_by_spread(table: &Table1, group: &str, unit: &str) -> Figure {
    let name = symbol(group);
    let x = ticks::linear(table.columns.iter().flat_map(Column::spreads), 6);
    let mean = table.columns.first().map_or(f64::NAN, |column| best(column, mean::NAME, group));
    let mut series =
        vec![Series::new("mean", "muted", Mark::Dashed, vec![[x.low, mean], [x.high, mean]])];
    let last = table.columns.len().saturating_sub(1).max(1) as f64;
    for (i, column) in table.columns.iter().enumerate() {
        let at = |spread| [spread, rmse(column.errors(NETWORK, Some(spread)), group)];
        let points = column.spreads().map(at).collect();
        let mark = Mark::LineAnd(SHAPES[i % SHAPES.len()]);
        let line = Series::new(&percent(column.noise_level), "c1", mark, points);
        series.push(Series { opacity: 0.6 + 0.4 * i as f64 / last, ..line });
    }
    let heights = series.iter().flat_map(|s| s.points.iter().map(|[_, y]| *y));
    let chart = Chart {
        title: format!("RMSE of {name} against spread, by noise level"),
        y: Axis::linear(with_unit(&format!("RMSE of {name}"), unit), ticks::linear(heights, 5)),
        x: Axis::linear("spread σ on scaled inputs", x),
        series,
        bands: vec![],
        notes: vec![],
        end_labels: true,
    };
    Figure {
        caption: format!(
            "RMSE of {name} in {unit} of the network (K = {}) against its spread, one line for \
             each noise level. Dashed: always the training mean, which noise does not change. \
             The scale need not start at zero.",
            table.centres
        ),
        drawing: chart.draw_responsive(WIDE_SINGLE, NARROW),
    }
}

/// Figure of the network's RMSE by row-wire, one chart a group.
pub fn by_row_wire(result: &RunResult) -> Figure {
    let groups = result.rows.first().map_or(&[][..], |row| &row.errors);
    let mut drawing = String::from("<div class=\"panels\">\n");
    for group in groups {
        let alike = groups.iter().filter(|other| other.unit == group.unit);
        let all =
            alike.flat_map(|other| result.rows.iter().map(|row| rmse(&row.errors, &other.group)));
        let name = symbol(&group.group);
        let at = result.rows.iter().enumerate();
        let at: Vec<_> = at.map(|(i, row)| (i as f64 + 1.0, row.row_wire.to_string())).collect();
        let values: Vec<f64> =
            result.rows.iter().map(|row| rmse(&row.errors, &group.group)).collect();
        let highest = ticks::extent(values.iter().copied()).map_or(f64::NAN, |(_, high)| high);
        let chart = Chart {
            title: format!(
                "RMSE of {name} by row-wire, at most {} {}",
                significant(highest, 3),
                group.unit
            ),
            x: Axis::linear("row-wire", ticks::Ticks { low: 0.5, high: at.len() as f64 + 0.5, at }),
            y: Axis::linear(
                with_unit(&format!("RMSE of {name}"), &group.unit),
                ticks::linear(all.chain([0.0]), 4),
            ),
            series: vec![Series::new("", "c1", Mark::Bars(0.64), numbered(&values))],
            bands: vec![],
            notes: vec![],
            end_labels: false,
        };
        drawing += &chart.draw([300.0, 230.0]);
    }
    drawing += "</div>\n";
    Figure {
        caption: format!(
            "RMSE of the network by row-wire, over all test frames.{}",
            if groups.len() > 1 { " All axes share one scale." } else { "" }
        ),
        drawing,
    }
}
