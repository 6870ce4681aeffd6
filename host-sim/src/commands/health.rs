//! Faulty readings of data files: what is believed, what is filled, and notes on both.

use super::Common;
use crate::{Error, Result};
use clap::Args;
use serde::Serialize;
use taxel_core::health::Limits;
use taxel_core::reading_model::MOST_MISSING;
use taxel_data::{Table, columns};
use taxel_learn::PreparedModel;
use taxel_learn::faults::{FEWEST_FOR_NOISE, Found, Grid, diagnose, stand_still};
use taxel_learn::health::{ColumnHealth, judge};

/// Most columns, and most wires, that are named.
const MOST_NAMED: usize = 5;

/// Readings that are believed.
#[derive(Args)]
pub struct HealthArguments {
    #[command(flatten)]
    limits: LimitsArgument,
    /// Columns whose readings count as missing in every line.
    #[arg(long, value_name = "GLOB,…")]
    without: Option<String>,
    /// Do not fill missing readings, even if the model can (train --reading-model).
    #[arg(long)]
    no_fill: bool,
}

/// Limits of readings in Ω.
#[derive(Debug, Clone, Copy, Args)]
pub struct LimitsArgument {
    /// Readings in Ω outside these limits count as missing (shorted or open), as on a device; so do those of a baseline.
    /// `none` accepts all. Columns whose names do not end in _ohm have no limits.
    #[arg(long, value_name = "LOW,HIGH", value_parser = limits, default_value = "5,1000")]
    limits: Believed,
}

impl LimitsArgument {
    /// The limits; `None` believes all readings.
    pub fn believed(self) -> Option<Limits> {
        self.limits.0
    }
}

/// Readings that are believed: all of them, or those within limits.
#[derive(Debug, Clone, Copy)]
struct Believed(Option<Limits>);

fn limits(text: &str) -> std::result::Result<Believed, String> {
    if text.trim() == "none" {
        return Ok(Believed(None));
    }
    let numbers = text.split_once(',').and_then(|(low, high)| {
        Some([low.trim().parse::<f32>().ok()?, high.trim().parse::<f32>().ok()?])
    });
    match numbers {
        Some([shorted_below_ohm, open_above_ohm]) if shorted_below_ohm < open_above_ohm => {
            Ok(Believed(Some(Limits { shorted_below_ohm, open_above_ohm })))
        }
        _ => Err("give the lowest and the highest in Ω, such as 5,1000; or none".into()),
    }
}

/// Health of the readings in a data file.
#[derive(Debug, Serialize)]
pub struct Health {
    pub readings_missing: usize,
    pub readings_shorted: usize,
    pub readings_open: usize,
    /// Readings that the model filled from the others.
    pub readings_filled: usize,
    frames_filled: usize,
    /// Columns with a faulty reading.
    columns: Vec<ColumnHealth>,
    /// Faults of wires.
    faults: Vec<Found>,
    /// Whether each frame has a faulty reading.
    #[serde(skip)]
    pub is_faulty: Vec<bool>,
    /// Places of faulty readings among all, filled or not.
    #[serde(skip)]
    pub faulty: Vec<usize>,
}

impl HealthArguments {
    /// Limits of readings that are believed; `None` believes all.
    pub fn limits(&self) -> Option<Limits> {
        self.limits.believed()
    }

    /// Makes faulty ones of the `readings` in the data file missing, notes them on stderr, and lets the `model` fill them,
    /// with the `baselines` of its frames if its inputs are relative.
    pub fn apply(
        &self,
        model: &PreparedModel<'_>,
        readings: &mut Table,
        baselines: Option<&Table>,
        common: &Common,
    ) -> Result<Health> {
        let lines = readings.len();
        let faults = match self.limits() {
            Some(limits) => diagnose(
                readings,
                limits,
                model.model().reading_model().filter(|_| baselines.is_none()),
            ),
            None => vec![],
        };
        if lines >= FEWEST_FOR_NOISE && stand_still(&readings.values, readings.names.len()) {
            common.remark(format_args!(
                "note: all {lines} lines are the same: check that the sensor sends new readings"
            ));
        }
        let left_out = self.leave_out(readings)?;
        let columns = judge(readings, self.limits());
        let told = told(&columns, &faults, &readings.names, &left_out);
        notes(&told.0, &told.1, lines).iter().for_each(|it| common.remark(it));
        if let Some(limits) = self.limits()
            && columns.len() == readings.names.len()
            && columns.iter().all(|column| column.shorted + column.open == lines)
        {
            let Limits { shorted_below_ohm, open_above_ohm } = limits;
            common.remark(format_args!(
                "note: no reading lies within {shorted_below_ohm} to {open_above_ohm} Ω; are they in Ω? --limits sets \
                 other limits"
            ));
        }
        let is_faulty =
            readings.lines().map(|line| line.iter().any(|reading| reading.is_nan())).collect();
        let places = readings.values.iter().enumerate();
        let faulty = places.filter(|(_, reading)| reading.is_nan()).map(|(at, _)| at).collect();
        let filled = if self.no_fill { None } else { model.filled(&readings.values, baselines) };
        let counts = filled.map_or(vec![], |(values, counts)| {
            readings.values = values.into();
            counts
        });
        let sum = |of: fn(&ColumnHealth) -> usize| columns.iter().map(of).sum();
        let health = Health {
            readings_missing: sum(|column| column.missing),
            readings_shorted: sum(|column| column.shorted),
            readings_open: sum(|column| column.open),
            readings_filled: counts.iter().sum(),
            frames_filled: counts.iter().filter(|count| **count > 0).count(),
            columns,
            faults,
            is_faulty,
            faulty,
        };
        if health.frames_filled > 0 {
            common.remark(format_args!(
                "note: missing readings of {} were filled from the others (docs/reliability.md shows what that costs)",
                of_lines(health.frames_filled, lines)
            ));
        }
        let faulty = health.is_faulty.iter().filter(|is_faulty| **is_faulty).count();
        if faulty > health.frames_filled && model.model().reading_model().is_some() {
            let why = if self.no_fill {
                "by --no-fill".to_owned()
            } else {
                format!("more than 1 in {MOST_MISSING} of a frame")
            };
            let count = of_lines(faulty - health.frames_filled, lines);
            common.remark(format_args!("note: missing readings of {count} were not filled: {why}"));
        }
        Ok(health)
    }

    /// Makes the readings of the columns that are left out missing. Returns the columns' indices.
    fn leave_out(&self, readings: &mut Table) -> Result<Vec<usize>> {
        let Some(pattern) = &self.without else { return Ok(vec![]) };
        // Notes on faults call a reading r4c5.
        let bare = |name: &String| name.strip_suffix("_ohm").unwrap_or(name).to_owned();
        let bare: Vec<String> = readings.names.iter().map(bare).collect();
        let matching = |pattern: &str| {
            [&readings.names, &bare].map(|names| columns::select(names, pattern)).concat()
        };
        if let Some(part) = pattern.split(',').map(str::trim).find(|part| matching(part).is_empty())
        {
            return Err(Error::Usage(format!(
                "--without {part}: the model has no such reading; it has {}",
                columns::some_names(&readings.names)
            )));
        }
        let mut chosen = matching(pattern);
        chosen.sort_unstable();
        chosen.dedup();
        let width = readings.names.len();
        for line in readings.values.chunks_exact_mut(width) {
            chosen.iter().for_each(|column| line[*column] = f64::NAN);
        }
        Ok(chosen)
    }
}

/// Notes on stderr which wires of a device are open or shorted, by the `readings` that it scanned and its `limits`.
pub fn note_faults(readings: &Table, limits: Limits, common: &Common) {
    let faults = diagnose(readings, limits, None);
    notes(&[], &faults, readings.len()).iter().for_each(|it| common.remark(it));
}

/// Faulty `columns` and `faults` that are worth a note: all but those of columns `left_out` of the ones called `names`.
fn told(
    columns: &[ColumnHealth],
    faults: &[Found],
    names: &[String],
    left_out: &[usize],
) -> (Vec<ColumnHealth>, Vec<Found>) {
    let is_left_out = |name: &String| left_out.iter().any(|at| names[*at] == *name);
    let holds = |fault: &Found, name: &String| {
        Grid::wires_of_name(name).is_some_and(|(m, k)| fault.fault.place.holds(m, k))
    };
    let remains =
        |fault: &&Found| names.iter().any(|name| holds(fault, name) && !is_left_out(name));
    let of_columns = columns.iter().filter(|column| !is_left_out(&column.column)).cloned();
    (of_columns.collect(), faults.iter().filter(remains).copied().collect())
}

/// Notes on wires with a fault, and on the worst of the other faulty `columns`, in so many `lines`.
pub fn notes(columns: &[ColumnHealth], faults: &[Found], lines: usize) -> Vec<String> {
    let mut worst: Vec<&Found> = faults.iter().collect();
    worst.sort_by_key(|found| std::cmp::Reverse(found.frames)); // stable
    let note =
        |found: &&Found| format!("note: {} in {}", found.fault, of_lines(found.frames, lines));
    let mut notes: Vec<String> = worst.iter().take(MOST_NAMED).map(note).collect();
    if let Some(more @ 1..) = worst.len().checked_sub(MOST_NAMED) {
        notes.push(format!("note: and {more} more faults of wires"));
    }
    let named = |column: &&ColumnHealth| {
        let wires = Grid::wires_of_name(&column.column);
        // Noise does not tell how often a reading is missing.
        let mut faults = faults.iter().filter(|found| found.fault.kind.of_readings().is_some());
        wires.is_some_and(|(m, k)| faults.any(|found| found.fault.place.holds(m, k)))
    };
    let mut worst: Vec<&ColumnHealth> = columns.iter().filter(|column| !named(column)).collect();
    worst.sort_by_key(|column| std::cmp::Reverse(column.faulty()));
    notes.extend(worst.iter().take(MOST_NAMED).map(|column| of_column(column, lines)));
    if let Some(more @ 1..) = worst.len().checked_sub(MOST_NAMED) {
        notes.push(format!("note: and {more} more columns with faulty readings"));
    }
    notes
}

/// What is wrong with a column: `r4c5_ohm: shorted in 100 % of lines`.
fn of_column(column: &ColumnHealth, lines: usize) -> String {
    let kinds = [(column.missing, "missing"), (column.shorted, "shorted"), (column.open, "open")];
    let parts = kinds.into_iter().filter(|(count, _)| *count > 0);
    let parts = parts.map(|(count, kind)| format!("{kind} in {}", of_lines(count, lines)));
    format!("note: {}: {}", column.column, parts.collect::<Vec<_>>().join(", "))
}

/// So many of all `lines`; never 0 % of some, or 100 % of fewer than all.
fn of_lines(count: usize, lines: usize) -> String {
    let percent = 100.0 * count as f64 / lines as f64;
    match (percent, count) {
        (..0.1, 1) => "1 line".into(),
        (..0.1, _) => format!("{count} lines"),
        (99.9..100.0, _) => format!("{percent:.2} % of lines"),
        _ => format!("{} % of lines", (percent * 10.0).round() / 10.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_two_numbers_or_none() {
        let both = limits(" 5, 1e3").unwrap().0.unwrap();
        assert_eq!((both.shorted_below_ohm, both.open_above_ohm), (5.0, 1000.0));
        assert!(limits("none").unwrap().0.is_none());
        for bad in ["5", "5,", "1000,5", "nan,5", "a,b", "5,5", ""] {
            assert!(limits(bad).is_err(), "{bad}");
        }
    }
}
