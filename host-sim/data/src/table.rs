//! Tables of numbers with named columns.

use std::borrow::Cow;

use crate::columns;
use crate::values::Values;

/// Table of numbers with named columns, one frame a line.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    pub names: Vec<String>,
    /// Values, `lines × columns`, line after line; NaN is missing.
    pub values: Values,
}

impl Table {
    /// Number of lines.
    pub fn len(&self) -> usize {
        if self.names.is_empty() { 0 } else { self.values.len() / self.names.len() }
    }

    /// Whether the table has no line.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Line number `line` (from 0), one value a column.
    ///
    /// # Panics
    /// If the table has columns, and no such line.
    pub fn line(&self, line: usize) -> &[f64] {
        &self.values[line * self.names.len()..(line + 1) * self.names.len()]
    }

    /// Lines of the table in turn, each a slice of one value a column.
    pub fn lines(&self) -> std::slice::ChunksExact<'_, f64> {
        self.values.chunks_exact(self.names.len().max(1))
    }

    /// Smallest and largest value of each column, `[low, high]`; NaN is skipped.
    pub fn ranges(&self) -> Vec<[f64; 2]> {
        ranges(self.lines(), self.names.len())
    }

    /// Number of values in each column that are not missing.
    pub fn counts(&self) -> Vec<usize> {
        let mut counts = vec![0; self.names.len()];
        for line in self.lines() {
            counts.iter_mut().zip(line).for_each(|(count, v)| *count += usize::from(!v.is_nan()));
        }
        counts
    }

    /// Groups of columns that are missing in the same lines, by their first column: one of all columns if nothing is
    /// missing.
    pub fn missing_together(&self) -> Vec<Vec<usize>> {
        if !self.values.iter().any(|value| value.is_nan()) {
            return vec![(0..self.names.len()).collect()];
        }
        let together =
            |a: usize, b: usize| self.lines().all(|line| line[a].is_nan() == line[b].is_nan());
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for column in 0..self.names.len() {
            match groups.iter_mut().find(|group| together(group[0], column)) {
                Some(group) => group.push(column),
                None => groups.push(vec![column]),
            }
        }
        groups
    }

    /// Indices of the lines that have all of these `columns`.
    ///
    /// # Panics
    /// If the table has fewer columns.
    pub fn lines_with(&self, columns: &[usize]) -> Vec<usize> {
        let has = |line: &[f64]| columns.iter().all(|column| !line[*column].is_nan());
        let lines = self.lines().enumerate().filter(|(_, line)| has(line));
        lines.map(|(number, _)| number).collect()
    }

    /// Table of these `lines`, in that order. All of them share the values of this one.
    ///
    /// # Panics
    /// If there is no such line.
    #[must_use]
    pub fn pick(&self, lines: &[usize]) -> Self {
        if lines.iter().copied().eq(0..self.len()) {
            return self.clone();
        }
        let mut values = Vec::with_capacity(lines.len() * self.names.len());
        lines.iter().for_each(|line| values.extend_from_slice(self.line(*line)));
        Self { names: self.names.clone(), values: values.into() }
    }

    /// Table of these `lines` and `columns`, in that order.
    ///
    /// # Panics
    /// If there is no such line or column.
    #[must_use]
    pub fn part(&self, lines: &[usize], columns: &[usize]) -> Self {
        let mut values = Vec::with_capacity(lines.len() * columns.len());
        for line in lines.iter().map(|line| self.line(*line)) {
            values.extend(columns.iter().map(|column| line[*column]));
        }
        let names = columns.iter().map(|column| self.names[*column].clone()).collect();
        Self { names, values: values.into() }
    }

    /// Mean of each column; NaN is skipped. Rounding moves it out of no column's range, so that the mean of equal values
    /// is that value.
    pub fn means(&self) -> Vec<f64> {
        means(self.lines().map(|line| line.iter().copied()), self.names.len())
    }

    /// Median of each column; NaN is skipped, and that of a column without a value.
    pub fn medians(&self) -> Vec<f64> {
        let of_column = |column: usize| {
            let values = self.lines().map(|line| line[column]).filter(|value| !value.is_nan());
            let mut values: Vec<f64> = values.collect();
            values.sort_unstable_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
        };
        (0..self.names.len()).map(of_column).collect()
    }

    /// One line with the mean of each column, which [`means`](Self::means) gives.
    #[must_use]
    pub fn mean_line(&self) -> Self {
        Self { names: self.names.clone(), values: self.means().into() }
    }

    /// Standard deviation of each column; NaN is skipped. 0 for a column that does not change as far as f32 can tell,
    /// or holds NaN alone.
    pub fn deviations(&self) -> Vec<f64> {
        let means = self.means();
        let mut sums = vec![(0.0, 0.0); means.len()];
        for line in self.lines() {
            let columns = sums.iter_mut().zip(line.iter().zip(&means));
            for ((square, count), (value, mean)) in columns.filter(|(_, (v, _))| !v.is_nan()) {
                *square += (value - mean) * (value - mean);
                *count += 1.0;
            }
        }
        let resolved = |deviation: f64, [low, high]: [f64; 2]| {
            let smallest = f64::from(f32::EPSILON) * low.abs().max(high.abs());
            if deviation > smallest { deviation } else { 0.0 }
        };
        let deviations =
            sums.into_iter().map(|(square, count): (f64, f64)| (square / count).sqrt());
        deviations.zip(self.ranges()).map(|(d, range)| resolved(d, range)).collect()
    }

    /// Sum Σ(estimate − value)² of each column, for `estimates` of the same shape, `lines × columns`. Missing values
    /// (NaN) are skipped; a missing estimate of a value is not.
    pub fn squared_errors(&self, estimates: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; self.names.len()];
        self.add_squared_errors(estimates, &mut sums);
        sums
    }

    /// Adds [squared errors](Self::squared_errors) to the `sums` of other lines, one a column.
    pub fn add_squared_errors(&self, estimates: &[f64], sums: &mut [f64]) {
        for (line, estimates) in self.lines().zip(estimates.chunks_exact(sums.len().max(1))) {
            for (sum, (value, estimate)) in sums.iter_mut().zip(line.iter().zip(estimates)) {
                if !value.is_nan() {
                    *sum += (estimate - value) * (estimate - value);
                }
            }
        }
    }

    /// `estimates` of the same shape, `lines × columns`, with the mean of the column for places that are not told, because
    /// nothing seems to touch: a decoder that always tells one says as much there. Lines that are not decoded at all stay
    /// as they are.
    pub fn with_places<'e>(&self, estimates: impl Into<Cow<'e, [f64]>>) -> Cow<'e, [f64]> {
        let places: Vec<bool> = self.names.iter().map(|name| columns::is_place(name)).collect();
        let mut estimates = estimates.into();
        if !places.contains(&true) {
            return estimates;
        }
        let (means, all_are) = (self.means(), !places.contains(&false));
        for line in estimates.to_mut().chunks_exact_mut(means.len().max(1)) {
            if all_are || line.iter().any(|value| !value.is_nan()) {
                let missing = line.iter_mut().zip(&places).zip(&means);
                let missing = missing.filter(|((value, is_place), _)| **is_place && value.is_nan());
                missing.for_each(|((value, _), mean)| *value = *mean);
            }
        }
        estimates
    }

    /// Table of so many `lines`: the lines of this one, again and again from the first.
    #[must_use]
    pub fn cycled(&self, lines: usize) -> Self {
        let count = lines * self.names.len();
        let values = self.values.iter().copied().cycle().take(count).collect();
        Self { names: self.names.clone(), values }
    }

    /// Table of the `count` columns from index `from` on. All of them share the values of this one.
    ///
    /// # Panics
    /// If the table has fewer columns.
    #[must_use]
    pub fn columns(&self, from: usize, count: usize) -> Self {
        if count == self.names.len() {
            return self.clone();
        }
        let names = self.names[from..from + count].to_vec();
        let mut values = Vec::with_capacity(self.len() * count);
        self.lines().for_each(|line| values.extend_from_slice(&line[from..from + count]));
        Self { names, values: values.into() }
    }
}

/// Smallest and largest value of each of so many columns of `lines`, as [`Table::ranges`] has it.
pub fn ranges<'l>(lines: impl Iterator<Item = &'l [f64]>, columns: usize) -> Vec<[f64; 2]> {
    let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; columns];
    for line in lines {
        for ([low, high], value) in ranges.iter_mut().zip(line) {
            (*low, *high) = (low.min(*value), high.max(*value));
        }
    }
    ranges
}

/// Mean of each of so many columns of `lines`, as [`Table::means`] has it.
pub fn means<L>(lines: impl Iterator<Item = L>, columns: usize) -> Vec<f64>
where
    L: IntoIterator<Item = f64>,
{
    let mut sums = vec![(0.0, 0.0, [f64::INFINITY, f64::NEG_INFINITY]); columns];
    for line in lines {
        for ((sum, count, [low, high]), value) in sums.iter_mut().zip(line) {
            if !value.is_nan() {
                (*sum, *count) = (*sum + value, *count + 1.0);
                (*low, *high) = (low.min(value), high.max(value));
            }
        }
    }
    let mean = |(sum, count, [low, high]): (f64, f64, [f64; 2])| {
        if low <= high { (sum / count).clamp(low, high) } else { f64::NAN }
    };
    sums.into_iter().map(mean).collect()
}
