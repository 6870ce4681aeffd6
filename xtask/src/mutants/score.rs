//! What was found: a line for each fault, and sums by crate.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::PathBuf;

use super::list::{FOLDER, Fault};
use crate::process::{Outcome, root};

const HEADER: &str = "fault,list,crate,verdict,unit test,torture\n";

/// What was found out about a fault.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Found {
    pub is_reached: bool,
    /// Whether not all tests were run.
    pub is_open: bool,
    /// Unit tests that fail, or only the first one.
    pub unit: Vec<String>,
    /// Every line of torture that fails.
    pub torture: Vec<String>,
}

impl Found {
    /// Whether no test fails.
    pub fn is_nothing(&self) -> bool {
        self.unit.is_empty() && self.torture.is_empty()
    }

    pub fn verdict(&self, fault: &Fault) -> &'static str {
        match (self.is_nothing(), &fault.equivalent) {
            (false, None) => "found",
            (false, Some(_)) => "found though equivalent",
            (true, None) if self.is_open => "open",
            (true, Some(_)) => "equivalent",
            (true, None) if !self.is_reached => "unreached",
            (true, None) => "missed",
        }
    }
}

/// The score of faults, as a CSV file.
pub fn csv(scored: &[(&Fault, Found)]) -> String {
    let mut text = HEADER.to_owned();
    for (fault, found) in scored {
        let (verdict, unit) = (found.verdict(fault), found.unit.join("; "));
        let (list, crate_folder, torture) =
            (&fault.list, &fault.crate_folder, found.torture.join(" "));
        let _ = writeln!(text, "{},{list},{crate_folder},{verdict},{unit},{torture}", fault.name);
    }
    text
}

/// File of the accepted score of the second list, or of all others.
fn file(is_second: bool) -> PathBuf {
    root().join(FOLDER).join(if is_second { "score-second.csv" } else { "score.csv" })
}

/// The accepted score of a fault.
pub struct Accepted {
    pub verdict: String,
    /// The unit test and the lines of torture that see it.
    pub tests: Vec<String>,
}

/// Reads the accepted score of each fault.
pub fn accepted(is_second: bool) -> BTreeMap<String, Accepted> {
    let text = fs::read_to_string(file(is_second)).unwrap_or_default();
    let fields = |line: &str| {
        let [name, _, _, verdict, unit, torture] =
            line.split(',').collect::<Vec<_>>().try_into().ok()?;
        let tests = unit.split("; ").chain(torture.split(' ')).map(str::to_owned).collect();
        Some((name.to_owned(), Accepted { verdict: verdict.to_owned(), tests }))
    };
    text.lines().skip(1).filter_map(fields).collect()
}

/// Writes the score.
pub fn accept(scored: &[(&Fault, Found)], is_second: bool) -> Outcome {
    let file = file(is_second);
    fs::write(&file, csv(scored)).map_err(|cause| format!("{}: {cause}", file.display()))
}

/// Number of faults by list and crate and verdict, as a table.
pub fn by_crate<'f>(verdicts: impl Iterator<Item = (&'f Fault, &'f str)>) -> String {
    let mut counts: BTreeMap<(&str, &str), [usize; 5]> = BTreeMap::new();
    for (fault, verdict) in verdicts {
        let columns = ["found", "missed", "unreached", "open"];
        let column = columns.iter().position(|column| *column == verdict).unwrap_or(4);
        for crate_folder in [&*fault.crate_folder, "in all"] {
            let of_crate = counts.entry((&fault.list, crate_folder)).or_default();
            of_crate[column] += 1;
        }
    }
    let mut text = format!(
        "{:<34}{:>8}{:>8}{:>11}{:>6}{:>12}{:>9}\n",
        "list and crate", "found", "missed", "unreached", "open", "equivalent", "found %"
    );
    for ((list, crate_folder), [found, missed, unreached, open, equivalent]) in counts {
        let share = 100.0 * found as f64 / (found + missed + unreached + open).max(1) as f64;
        let name = format!("{list}: {crate_folder}");
        let _ = writeln!(
            text,
            "{name:<34}{found:>8}{missed:>8}{unreached:>11}{open:>6}{equivalent:>12}{share:>9.0}"
        );
    }
    text
}
