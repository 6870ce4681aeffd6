//! Readings of the untouched sensor over time, and which of them drift.

use std::ops::Range;

use serde::Serialize;
use taxel_data::{Clock, Rest, Table};

use super::{MOST_STRETCHES, cut, is_log};
use crate::measurements::{Measurements, Spread, far_from_zero};

/// Most lines of a pause that are taken together.
const LINES_AT_ONCE: usize = 10;
/// Fewest of these in a stretch at rest.
const FEWEST_A_STRETCH: usize = 3;
/// Standard errors by which a reading's means at rest must differ to have drifted.
const CERTAIN: f64 = 6.0;
/// One of so many readings must drift for any to: what a press leaves, few have.
const DRIFTING_ONE_IN: usize = 3;
/// Share of a reading's standard deviation over the log that a drift must exceed to be told.
const NOTICEABLE: f64 = 0.1;

/// What changes of readings at rest are told in per cent of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PercentOf {
    /// Value of the reading at rest.
    Rest,
    /// Range of the reading in the log, where readings are near zero at rest.
    Range,
}

/// Readings of the untouched sensor, by time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RestOverTime {
    /// Number of lines at rest, of which the second half of each pause counts: at first, a press leaves something.
    pub lines: usize,
    pub percent_of: PercentOf,
    /// Mean change since the first stretch, in the order of time.
    pub stretches: Vec<RestStretch>,
    /// Reading that changes most.
    pub most: String,
    /// Readings that drift noticeably, the largest drift first; none if fewer than a third do.
    pub drifts: Vec<ColumnDrift>,
    /// Number of all readings.
    pub readings: usize,
    /// Time between the first stretch and the last, in words: `in 9.6 minutes`.
    pub span: String,
}

/// Changes of readings at rest in a stretch of time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RestStretch {
    /// Time of its first and of its last line.
    pub from: f64,
    pub to: f64,
    /// Percentiles 10, 50 and 90 of all readings' changes.
    pub percentiles_percent: [f64; 3],
    /// Change of the reading that changes most.
    pub most_percent: f64,
}

/// Drift of a reading at rest: the largest difference between means of two stretches.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ColumnDrift {
    pub column: String,
    pub percent: f64,
    /// Times of these stretches, the earlier one first.
    pub from: f64,
    pub to: f64,
}

impl RestOverTime {
    /// Readings at rest of the log in `data`, by time. `None` if lines are in no order of time, or none is at rest.
    pub fn of_data(data: &Measurements) -> Option<Self> {
        let rest = data.rest.as_ref().filter(|_| is_log(&data.log, &data.training.outputs))?;
        Self::new(rest, &data.log.clock, &data.spread)
    }

    /// Readings at `rest` by time; `None` if they are of another file, or too few. `spread` is that of the log's
    /// readings, at rest or not.
    pub fn new(rest: &Rest, clock: &Clock, spread: &Spread) -> Option<Self> {
        let lines = rest.lines.as_ref()?;
        let all: Vec<usize> = (0..rest.readings.names.len()).collect();
        let settled = settled(lines);
        let ranges: Vec<_> = cut(settled.len(), FEWEST_A_STRETCH, MOST_STRETCHES).collect();
        if ranges.len() < 2 {
            return None;
        }
        let means_of = |parts: &[Range<usize>]| {
            let lines: Vec<usize> = parts.iter().cloned().flatten().collect();
            rest.readings.pick(&lines).means()
        };
        let means: Vec<Vec<f64>> =
            ranges.iter().map(|range| means_of(&settled[range.clone()])).collect();
        let (at_rest, deviations) = (rest.readings.means(), &spread.deviations);
        let percent_of =
            if far_from_zero(&at_rest, deviations) { PercentOf::Rest } else { PercentOf::Range };
        let whole: Vec<f64> = match percent_of {
            PercentOf::Rest => at_rest.iter().map(|mean| mean.abs()).collect(),
            PercentOf::Range => spread.ranges.iter().map(|[low, high]| high - low).collect(),
        };
        let time = |at: usize| {
            let range = &ranges[at];
            [settled[range.start].start, settled[range.end - 1].end - 1]
                .map(|it| clock.at[lines[it]])
        };
        let drift = |column: usize| {
            let of_column = |(at, means): (usize, &Vec<f64>)| (means[column], at);
            let by_mean = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0);
            let stretches = || means.iter().enumerate().map(of_column);
            let (low, high) = (stretches().min_by(by_mean)?, stretches().max_by(by_mean)?);
            let [first, last] = [low.1.min(high.1), low.1.max(high.1)];
            let percent = 100.0 * (high.0 - low.0) / whole[column];
            let name = rest.readings.names[column].clone();
            let (from, to) = (time(first)[0], time(last)[1]);
            Some((high.0 - low.0, ColumnDrift { column: name, percent, from, to }))
        };
        let drifts: Vec<(f64, ColumnDrift)> = all.iter().filter_map(|it| drift(*it)).collect();
        let most = drifts.iter().enumerate().filter(|(_, (_, it))| it.percent.is_finite());
        let (most, _) = most.max_by(|(_, a), (_, b)| a.1.percent.total_cmp(&b.1.percent))?;
        let fewest = ranges.iter().map(ExactSizeIterator::len).min()? as f64;
        // What presses leave in a pause is noise too: it differs from pause to pause, and a drift hardly does.
        let of_parts = settled.iter().flat_map(|part| means_of(std::slice::from_ref(part)));
        let names = rest.readings.names.clone();
        let of_parts = Table { names, values: of_parts.collect() };
        let noise = Rest { readings: of_parts, lines: Some((0..settled.len()).collect()) }.noise();
        let mut noticeable: Vec<ColumnDrift> = Vec::new();
        for (column, (by, drift)) in drifts.into_iter().enumerate() {
            let certain = CERTAIN * noise[column] / fewest.sqrt();
            if by > certain && by > NOTICEABLE * deviations[column] && drift.percent.is_finite() {
                noticeable.push(drift);
            }
        }
        if DRIFTING_ONE_IN * noticeable.len() < all.len() {
            noticeable.clear();
        }
        noticeable.sort_by(|a, b| b.percent.total_cmp(&a.percent));
        let stretch = |(at, now): (usize, &Vec<f64>)| {
            let change = |column: usize| 100.0 * (now[column] - means[0][column]) / whole[column];
            let mut changes: Vec<f64> = all.iter().map(|column| change(*column)).collect();
            changes.retain(|change| change.is_finite());
            changes.sort_unstable_by(f64::total_cmp);
            let percentile =
                |share: usize| changes.get(share * changes.len().saturating_sub(1) / 100).copied();
            let [from, to] = time(at);
            RestStretch {
                from,
                to,
                percentiles_percent: [10, 50, 90].map(|it| percentile(it).unwrap_or(f64::NAN)),
                most_percent: change(most),
            }
        };
        Some(Self {
            lines: lines.len(),
            percent_of,
            stretches: means.iter().enumerate().map(stretch).collect(),
            most: rest.readings.names[most].clone(),
            drifts: noticeable,
            readings: all.len(),
            span: clock.span(time(0)[0], time(ranges.len() - 1)[1]),
        })
    }
}

/// Second half of each pause among these `lines` at rest, in parts of few lines.
fn settled(lines: &[usize]) -> Vec<Range<usize>> {
    let (mut parts, mut start) = (Vec::new(), 0);
    for pause in lines.chunk_by(|a, b| a + 1 == *b) {
        let end = start + pause.len();
        let from = start + pause.len() / 2;
        let of_pause = (from..end).step_by(LINES_AT_ONCE);
        parts.extend(of_pause.map(|from| from..end.min(from + LINES_AT_ONCE)));
        start = end;
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use taxel_data::table::Table;

    #[test]
    fn drift_at_rest_is_distinguished_from_noise_and_from_creep() {
        let clock = Clock {
            column: Some("time_s".into()),
            unit: "s",
            at: (0..800).map(|line| 2.0 * f64::from(line)).collect(),
        };
        // Pauses of 20 lines, with presses of 20 lines between them.
        let lines = || Some((0..400).map(|line| line + 20 * (line / 20)).collect());
        let noise = |line: usize| (line * 37 % 101) as f64 / 101.0;
        let names = ["still", "drifts", "creeps"].map(String::from).to_vec();
        let line = |line: usize| {
            let [still, drift] = [500.0 + noise(line), line as f64 / 10.0];
            let left = 40.0 * noise(line / 20) * (-((line % 20) as f64) / 10.0).exp();
            [still, still + drift, still + left]
        };
        let readings = Table { names, values: (0..400).flat_map(line).collect() };
        let all: Vec<usize> = (0..400).collect();
        let rest = Rest { readings: readings.clone(), lines: lines() };
        let found = RestOverTime::new(&rest, &clock, &Spread::of(&readings)).unwrap();
        assert_eq!((found.percent_of, found.most.as_str()), (PercentOf::Rest, "drifts"));
        let [drift] = found.drifts.as_slice() else { panic!("{:?}", found.drifts) };
        // Between means of second halves of three pauses and of four: 33 of 520.
        assert!((6.3..6.4).contains(&drift.percent), "{}", drift.percent);
        assert_eq!((drift.from, drift.to), (20.0, 1558.0));
        assert_eq!(found.stretches[0].most_percent, 0.0);
        // One that falls is told in the order of time too.
        let values = readings.values.iter().map(|value| 1100.0 - value).collect();
        let falling = Table { values, ..readings.clone() };
        let of_falling = Rest { readings: falling.clone(), lines: lines() };
        let found = RestOverTime::new(&of_falling, &clock, &Spread::of(&falling)).unwrap();
        assert_eq!((found.drifts[0].from, found.drifts[0].to), (20.0, 1558.0));
        // It is none where presses move the readings far more, or where few readings drift.
        let spread = Spread { deviations: vec![400.0; 3], ..Spread::of(&readings) };
        assert_eq!(RestOverTime::new(&rest, &clock, &spread).unwrap().drifts, []);
        let of_four = Rest { readings: readings.part(&all, &[0, 1, 2, 0]), lines: lines() };
        let spread = Spread::of(&of_four.readings);
        assert_eq!(RestOverTime::new(&of_four, &clock, &spread).unwrap().drifts, []);
        // Where a baseline was subtracted, changes are told in per cent of the range.
        let means = readings.means().into_iter().cycle();
        let values = readings.values.iter().zip(means).map(|(value, mean)| value - mean).collect();
        let about_zero = Table { values, ..readings };
        let rest = Rest { readings: about_zero.clone(), lines: lines() };
        let found = RestOverTime::new(&rest, &clock, &Spread::of(&about_zero)).unwrap();
        assert_eq!(found.percent_of, PercentOf::Range);
        assert!((75.0..85.0).contains(&found.drifts[0].percent));
    }

    #[test]
    fn percentiles_of_the_change_at_rest_are_those_of_all_readings() {
        let at = (0..800).map(f64::from).collect();
        let clock = Clock { column: Some("time_s".into()), unit: "s", at };
        let lines = (0..400).map(|line| line + 20 * (line / 20)).collect();
        let names = (0..12).map(|k| format!("ch{k}")).collect();
        let change = |line: usize, k: usize| (k * line) as f64 / 400.0;
        let values = (0..400).flat_map(|line| (0..12).map(move |k| 1000.0 + change(line, k)));
        let readings = Table { names, values: values.collect() };
        let rest = Rest { readings: readings.clone(), lines: Some(lines) };
        let found = RestOverTime::new(&rest, &clock, &Spread::of(&readings)).unwrap();
        let [low, middle, high] = found.stretches.last().unwrap().percentiles_percent;
        assert!((low / middle - 0.2).abs() < 0.01 && (high / middle - 1.8).abs() < 0.01);
        // The means of second halves of pauses are 330 lines apart.
        assert!((middle - 412.5 / (1000.0 + 5.0 * 199.5 / 400.0)).abs() < 1e-9, "{middle}");
    }
}
