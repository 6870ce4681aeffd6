//! The table of all promises.

use std::fmt::Write;

use serde_json::{Value, json};

use crate::found::Found;
use crate::promise::Tested;

/// The head of the table, and whether a column is aligned to the left.
const HEAD: [(&str, bool); 8] = [
    ("promise", true),
    ("cases", false),
    ("refused", false),
    ("worst", false),
    ("bound", false),
    ("verdict", true),
    ("seed", false),
    ("name", true),
];

/// The table, notes, a line that sums it up, and for each promise that is not kept the command
/// that repeats its worst case. `options` are those of this run that decide what a case does.
pub fn text(entries: &[Tested], options: &str) -> String {
    let mut rows = vec![HEAD.map(|(name, _)| name.to_owned())];
    rows.extend(entries.iter().map(cells));
    let mut table = String::new();
    for row in &rows {
        let cells = row.iter().zip(HEAD).enumerate().map(|(column, (cell, (_, is_left)))| {
            let widths = rows.iter().map(|row| row[column].chars().count());
            let width = widths.max().unwrap_or_default();
            if is_left { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
        });
        table += cells.collect::<Vec<_>>().join("  ").trim_end();
        table.push('\n');
    }
    for entry in entries {
        let note = match &entry.outcome {
            Ok(found) => &found.note,
            Err(cause) => cause,
        };
        if !note.is_empty() {
            // Writing to a String cannot fail.
            let _ = writeln!(table, "{}: {note}", entry.promise.name);
        }
    }
    let bad = || entries.iter().filter(|entry| !entry.is_kept());
    let _ = write!(table, "\n{} of {} promises kept", entries.len() - bad().count(), entries.len());
    for (entry, found) in bad().filter_map(|entry| Some((entry, entry.outcome.as_ref().ok()?))) {
        let (name, seed) = (entry.promise.name, found.seed);
        let _ = write!(table, "\nagain: cargo xtask torture {options} --seed {seed} {name}");
    }
    table.push('\n');
    table
}

fn cells(entry: &Tested) -> [String; 8] {
    let (name, text) = (entry.promise.name.to_owned(), entry.promise.text.to_owned());
    let verdict = verdict(entry).to_owned();
    let Ok(found) = &entry.outcome else {
        let none = String::new;
        return [text, none(), none(), none(), none(), verdict, none(), name];
    };
    let Found { cases, refused, worst, bound, unit, seed, .. } = found;
    let worst =
        if worst.is_finite() { format!("{} {unit}", short(*worst)) } else { "failed".into() };
    let refused = match refused {
        0 => String::new(),
        some => format!("{:.1} %", 100.0 * *some as f64 / *cases as f64),
    };
    [text, short(*cases as f64), refused, worst, short(*bound), verdict, seed.to_string(), name]
}

/// A number in at most nine characters, with three digits.
fn short(number: f64) -> String {
    match number.abs() {
        0.0 => "0".to_owned(),
        size if size < 100_000.0 && number.fract() == 0.0 => format!("{number}"),
        size if (0.01..1000.0).contains(&size) => format!("{number:.3}"),
        _ => format!("{number:.2e}"),
    }
}

/// The table as JSON.
pub fn json(entries: &[Tested]) -> serde_json::Result<String> {
    let lines: Vec<Value> = entries.iter().map(line).collect();
    serde_json::to_string_pretty(&lines)
}

fn line(entry: &Tested) -> Value {
    let mut line = json!({
        "name": entry.promise.name,
        "promise": entry.promise.text,
        "verdict": verdict(entry),
        "seconds": entry.time.as_secs_f64(),
    });
    match &entry.outcome {
        Ok(found) => {
            line["cases"] = found.cases.into();
            line["refused"] = found.refused.into();
            line["worst"] = found.worst.into();
            line["bound"] = found.bound.into();
            line["unit"] = found.unit.into();
            line["seed"] = found.seed.into();
            line["note"] = found.note.as_str().into();
        }
        Err(cause) => line["note"] = cause.as_str().into(),
    }
    line
}

fn verdict(entry: &Tested) -> &'static str {
    match entry.outcome.as_ref().map(Found::keeps) {
        Err(_) => "untested",
        Ok(true) => "pass",
        Ok(false) => "FAIL",
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::promise::Promise;
    use crate::promises::PROMISES;

    fn entry(promise: &'static Promise, worst: f64) -> Tested {
        let found = Found {
            cases: 123_456_789,
            refused: 23_456_789,
            worst,
            bound: 1.25e-12,
            unit: "noise",
            seed: 123_456,
            note: String::new(),
        };
        Tested { promise, outcome: Ok(found), time: Duration::ZERO }
    }

    #[test]
    fn every_promise_has_a_text_and_a_name_of_its_own_in_line() {
        for (number, promise) in PROMISES.iter().enumerate() {
            let same = |it: &&Promise| it.text == promise.text || it.name == promise.name;
            assert!(PROMISES[..number].iter().find(same).is_none(), "{promise:?}");
        }
        let entries: Vec<Tested> = PROMISES.iter().map(|it| entry(it, 1.234e-4)).collect();
        let table = text(&entries, "--short");
        let places = table.lines().skip(1).zip(PROMISES).map(|(row, promise)| {
            let before = row.strip_suffix(promise.name).expect("the name is last");
            before.chars().count()
        });
        let places: Vec<usize> = places.collect();
        assert_eq!(places, vec![places[0]; PROMISES.len()]);
    }

    #[test]
    fn a_broken_promise_is_repeated_by_the_options_of_its_run() {
        for options in ["--short", "--minutes 20"] {
            let table = text(&[entry(&PROMISES[0], 1.0)], options);
            let name = PROMISES[0].name;
            let again = format!("\nagain: cargo xtask torture {options} --seed 123456 {name}\n");
            assert!(table.ends_with(&again), "{table}");
        }
    }
}
