//! Notes on what measured data hold, on stderr.

use std::path::Path;

use taxel_data::dataset::{LeftOut, UnusedInputs};
use taxel_data::error::{cut, number};
use taxel_data::rest::is_zero_at_rest;
use taxel_data::{Table, columns};
use taxel_learn::outliers::{Outlier, Outliers};

use super::Common;

/// Most lines with outliers that are named.
const MOST_NAMED: usize = 5;

/// Names the `outliers` of the file at `path`, which has so many usable `lines`, and says what they are `left_out` of.
pub fn print_outliers(
    outliers: &Outliers,
    path: &Path,
    lines: usize,
    left_out: &str,
    common: &Common,
) {
    notes_on_outliers(outliers, &path.display().to_string(), lines, left_out)
        .iter()
        .for_each(|it| common.remark(it));
}

/// Names the columns of the file at `path` that never change.
pub fn print_constant(columns: &[String], path: &Path, common: &Common) {
    if let Some(note) = note_on_constant(columns, &path.display().to_string()) {
        common.remark(note);
    }
}

/// Counts the lines of the file at `path`, which has `of` lines, that lack a value.
pub fn print_left_out(left_out: &LeftOut, path: &Path, of: usize, common: &Common) {
    if let Some(note) = note_on_left_out(left_out, &path.display().to_string(), of) {
        common.remark(note);
    }
}

/// Names the inputs of the file at `path` that can tell nothing.
pub fn print_unused(unused: &UnusedInputs, path: &Path, common: &Common) {
    notes_on_unused(unused, &path.display().to_string()).iter().for_each(|it| common.remark(it));
}

/// Says that no line of the log at `path`, which has these `outputs`, is known to be at rest.
pub fn print_no_rest(outputs: &Table, path: &Path, common: &Common) {
    let told = outputs.names.iter().filter(|name| is_zero_at_rest(name)).cloned();
    let told: Vec<String> = told.collect();
    let why = match told.as_slice() {
        [] => "no output is a force, weight or pressure;".to_owned(),
        names => format!(
            "in fewer than ten lines {} within 1 % of zero; does it have an offset?",
            match names {
                [name] => format!("{name} is"),
                names => format!("all of {} are", columns::some_names(names)),
            }
        ),
    };
    common.remark(format_args!(
        "note: no line of {} is known to be at rest, so drift is not checked: {why} --rest NAME names a column that is 0 \
         while nothing touches the sensor",
        path.display()
    ));
}

fn note_on_left_out(left_out: &LeftOut, name: &str, of: usize) -> Option<String> {
    if left_out.lines() == 0 {
        return None;
    }
    let reasons = [(left_out.without_reading, "a reading"), (left_out.without_output, "an output")];
    let reasons = reasons.iter().filter(|(lines, _)| *lines > 0);
    let reasons: Vec<String> =
        reasons.map(|(lines, what)| format!("{lines} lack {what}")).collect();
    let columns = left_out.missing_most.iter();
    let columns: Vec<String> =
        columns.map(|(column, count)| format!("{} {count}", cut(column))).collect();
    Some(format!(
        "note: {} of {of} lines of {name} have a missing value and are skipped: {} (most often missing: {})",
        left_out.lines(),
        reasons.join(", "),
        columns.join(", ")
    ))
}

fn notes_on_unused(unused: &UnusedInputs, name: &str) -> Vec<String> {
    let note = |names: &[String], one: &str, more: &str| {
        let which = match names {
            [] => return None,
            [only] => format!("{} {one}", cut(only)),
            names => format!("{} inputs {more}: {}", names.len(), columns::some_names(names)),
        };
        Some(format!("note: {which} in {name}; left out of the model"))
    };
    let pairs = unused.duplicated.iter();
    let pairs: Vec<String> = pairs.map(|(name, of)| format!("{name} = {of}")).collect();
    let notes = [
        note(
            &unused.dead,
            "has no value in more than half of the lines",
            "have no value in more than half of the lines",
        ),
        note(&unused.constant, "never changes", "never change"),
        note(
            &unused.flickering,
            "flickers between two values, whatever the outputs are,",
            "flicker between two values, whatever the outputs are",
        ),
        note(&pairs, "in every line", "are the same as another in every line"),
    ];
    notes.into_iter().flatten().collect()
}

fn notes_on_outliers(outliers: &Outliers, name: &str, lines: usize, left_out: &str) -> Vec<String> {
    if outliers.found.is_empty() {
        return vec![];
    }
    let count = match outliers.lines {
        1 => format!("1 of {lines} lines of {name} holds"),
        count => format!("{count} of {lines} lines of {name} hold"),
    };
    let done = if outliers.left_out {
        format!("left out of {left_out}")
    } else {
        "used all the same: check them, and correct or remove the lines".into()
    };
    let mut notes =
        vec![format!("note: {count} a value far from all others of its column; {done}:")];
    let of_lines = outliers.found.chunk_by(|a, b| a.line == b.line);
    notes.extend(of_lines.take(MOST_NAMED).map(name_line));
    if outliers.lines > MOST_NAMED {
        notes.push(format!("  and {} more lines", outliers.lines - MOST_NAMED));
    }
    notes
}

/// Names the first outlier of a line, and counts the others.
fn name_line(outliers: &[Outlier]) -> String {
    let Outlier { line, column, value, usual } = &outliers[0];
    let [low, high] = usual.map(|value| value as f32); // no more digits than tell something
    let more = match outliers.len() {
        1 => String::new(),
        2 => ", and 1 more column".into(),
        count => format!(", and {} more columns", count - 1),
    };
    let (column, value) = (cut(column), number(*value));
    format!("  line {line}: {column} = {value}, where others are {low} to {high}{more}")
}

fn note_on_constant(constant: &[String], name: &str) -> Option<String> {
    let which = match constant.len() {
        0 => return None,
        1 => format!("{} never changes", cut(&constant[0])),
        count => format!("{count} inputs never change: {}", columns::some_names(constant)),
    };
    Some(format!(
        "note: {which} in {name}; the model ignores inputs that never changed in training"
    ))
}
