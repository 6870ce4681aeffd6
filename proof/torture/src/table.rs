//! The table of all promises.

use std::fmt::Write;

use serde_json::{Value, json};

use crate::found::Found;
use crate::promise::Tested;

/// The head of the table, in the columns of [`row`].
const HEAD: [&str; 8] =
    ["promise", "cases", "refused", "worst", "bound", "verdict", "seed", "name"];

/// Width of a promise's text, and the longest name: a row has at most 120 columns.
#[cfg(test)]
pub const WIDTHS: [usize; 2] = [47, 18];

/// The table in at most 120 columns, notes, a line that sums it up, and for each promise that is not kept the command
/// that repeats its worst case. `options` are those of this run that decide what a case does.
pub fn text(entries: &[Tested], options: &str) -> String {
    let mut table = row(&HEAD.map(str::to_owned));
    for entry in entries {
        table.push_str(&row(&cells(entry)));
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

fn row([promise, cases, refused, worst, bound, verdict, seed, name]: &[String; 8]) -> String {
    format!(
        "{promise:<47}{cases:>8}{refused:>8} {worst:>13} {bound:>8} {verdict:<8}{seed:>6} {name}\n"
    )
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
    fn rows_of_all_promises_are_at_most_120_columns_wide_and_their_columns_in_line() {
        let entries: Vec<Tested> = PROMISES.iter().map(|it| entry(it, 1.234e-4)).collect();
        let table = text(&entries, "--short");
        let rows = || table.lines().take(1 + PROMISES.len());
        let at = |row: &str| row.chars().skip(WIDTHS[0] + 48).collect::<String>();
        for (row, promise) in rows().skip(1).zip(PROMISES) {
            assert!(row.chars().count() <= 120, "{row}");
            assert_eq!(at(row), format!("123456 {}", promise.name), "{row}");
        }
    }

    #[test]
    fn every_promise_has_a_text_and_a_name_of_its_own_that_fit() {
        for (number, promise) in PROMISES.iter().enumerate() {
            let lengths = [promise.text, promise.name].map(|it| it.chars().count());
            assert!(lengths[0] <= WIDTHS[0] && lengths[1] <= WIDTHS[1], "{promise:?}: {lengths:?}");
            assert!(!promise.text.starts_with(char::is_uppercase), "{promise:?}");
            let before = &PROMISES[..number];
            let same = |it: &&Promise| it.text == promise.text || it.name == promise.name;
            assert!(before.iter().find(same).is_none(), "{promise:?}");
        }
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
