//! The table of all promises.

use std::fmt::Write;

use serde_json::{Value, json};

use crate::found::Found;
use crate::promise::Tested;

/// The table in at most 120 columns, and a line that sums it up.
#[must_use]
pub fn text(entries: &[Tested], self_test: bool) -> String {
    let mut table = format!(
        "{:<22}{:>14} {:>12} {:>10} {:<8} {:<8}{:>12}{:>8}  promise\n",
        "", "cases", "worst", "bound", "unit", "verdict", "seed", "s"
    );
    for entry in entries {
        let (name, text) = (entry.promise.name, entry.promise.text);
        let seconds = entry.time.as_secs_f64();
        // Writing to a String cannot fail.
        let _ = match &entry.outcome {
            Ok(found) => writeln!(
                table,
                "{name:<22}{:>14} {:>12.4e} {:>10.3e} {:<8} {:<8}{:>12}{seconds:>8.1}  {text}",
                found.cases,
                found.worst,
                found.bound,
                found.unit,
                verdict(entry, self_test),
                found.seed,
            ),
            Err(cause) => writeln!(table, "{name:<22} not tested: {cause}"),
        };
        if let Ok(found) = &entry.outcome
            && !found.note.is_empty()
        {
            let _ = writeln!(table, "{:<24}{}", "", found.note);
        }
    }
    let good = entries.iter().filter(|entry| entry.is_as_it_should_be(self_test)).count();
    let what = if self_test { "planted faults found" } else { "promises kept" };
    let _ = writeln!(table, "\n{good} of {} {what}", entries.len());
    table
}

/// The table as JSON.
///
/// # Errors
/// None that can be met: numbers and texts can be written.
pub fn json(entries: &[Tested], self_test: bool) -> serde_json::Result<String> {
    let lines: Vec<Value> = entries.iter().map(|entry| line(entry, self_test)).collect();
    serde_json::to_string_pretty(&lines)
}

fn line(entry: &Tested, self_test: bool) -> Value {
    let mut line = json!({
        "name": entry.promise.name,
        "promise": entry.promise.text,
        "verdict": verdict(entry, self_test),
        "seconds": entry.time.as_secs_f64(),
    });
    match &entry.outcome {
        Ok(found) => {
            line["cases"] = found.cases.into();
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

fn verdict(entry: &Tested, self_test: bool) -> &'static str {
    match (entry.outcome.as_ref().map(Found::keeps), self_test) {
        (Err(_), _) => "untested",
        (Ok(true), false) => "pass",
        (Ok(false), false) => "FAIL",
        (Ok(false), true) => "found",
        (Ok(true), true) => "MISSED",
    }
}
