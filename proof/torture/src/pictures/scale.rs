//! Error of a model against the scale and the offset of a column, through the program.

use super::chart::{Chart, Line, Points};
use crate::promises::scale::{Change, FORMATS, Outcome, folder, path_of, run};
use crate::tools::Tools;

/// Picture of the error against the factor on a column.
pub fn by_factor(tools: &Tools) -> Result<String, String> {
    let factors: Vec<f64> = (-40..=40).map(|power| 10_f64.powi(power)).collect();
    let chart = Chart {
        title: "What a model leaves unexplained against the scale of a column",
        x_label: "factor on the column; beyond the crosses it is refused by its name",
        y_label: "1 − R² on the training lines",
        x: [1e-40, 1e40],
        y: [1e-4, 1.0],
        steps: [10, 1],
        lines: lines(tools, &factors, Change::times)?,
    };
    Ok(chart.draw())
}

/// Picture of the error against the offset of a column.
pub fn by_offset(tools: &Tools) -> Result<String, String> {
    let offsets: Vec<f64> = (0..=48).map(|step| 10_f64.powf(f64::from(step) / 6.0)).collect();
    let chart = Chart {
        title: "What a model leaves unexplained against the offset of a column",
        x_label: "offset of the column, in ranges of it; beyond the crosses it is refused by its name",
        y_label: "1 − R² on the training lines",
        x: [1.0, 1e8],
        y: [1e-4, 1.0],
        steps: [1, 1],
        lines: lines(tools, &offsets, Change::plus)?,
    };
    Ok(chart.draw())
}

/// Formats of the pictures: name of an input's line, an output's, and of both where they are alike.
const PLOTTED: [(&str, [&str; 3], bool); 2] = [
    (FORMATS[0], ["f32, an input", "f32, an output", "f32, input or output"], false),
    (FORMATS[2], ["fixed16, an input", "fixed16, an output", "fixed16, input or output"], true),
];

/// Lines of f32 and fixed16, for changes of an input and of the output; one where these are alike.
fn lines(tools: &Tools, values: &[f64], change: fn(f64) -> Change) -> Result<Vec<Line>, String> {
    let program = &path_of(tools)?;
    let folder = folder(0)?;
    let mut lines = Vec::new();
    for (index, (format, [input_name, output_name, both], dashed)) in
        PLOTTED.into_iter().enumerate()
    {
        let line = |name, colour: u8, is_output| -> Result<Line, String> {
            let unexplained = |value| {
                let changed = change(value);
                let changes =
                    if is_output { [Change::NONE, changed] } else { [changed, Change::NONE] };
                Ok(match run(program, &folder, format, changes, false)? {
                    Outcome::Accepted(r_squared) => Some(1.0 - r_squared),
                    Outcome::Refused | Outcome::Noted => None,
                })
            };
            let (points, crosses) = accepted(values, unexplained)?;
            Ok(Line { name, colour, dashed, points, crosses })
        };
        let colour = index as u8 + 1;
        let [input, output] =
            [line(input_name, colour, false)?, line(output_name, colour + 2, true)?];
        if are_alike(&input, &output) {
            lines.push(Line { name: both, ..input });
        } else {
            lines.extend([input, output]);
        }
    }
    let _ = std::fs::remove_dir_all(&folder);
    Ok(lines)
}

/// Points of the values that have an `error`, and those of them beside values that have none.
fn accepted(
    values: &[f64],
    mut error: impl FnMut(f64) -> Result<Option<f64>, String>,
) -> Result<(Points, Points), String> {
    let (mut points, mut crosses) = (Vec::new(), Vec::new());
    let mut was_refused = false;
    for value in values {
        let here = error(*value)?.map(|error| [*value, error]);
        match here {
            Some(point) => {
                if was_refused && points.is_empty() {
                    crosses.push(point);
                }
                points.push(point);
            }
            None if !was_refused => crosses.extend(points.last().copied()),
            None => {}
        }
        was_refused = here.is_none();
    }
    Ok((points, crosses))
}

/// Whether two lines cannot be told apart in a picture.
fn are_alike(a: &Line, b: &Line) -> bool {
    let is_near = |(a, b): (&[f64; 2], &[f64; 2])| a[0] == b[0] && (a[1] / b[1]).ln().abs() < 0.1;
    a.points.len() == b.points.len() && a.points.iter().zip(&b.points).all(is_near)
}
