//! Tables of numbers with named columns.

/// Named columns of numbers, one line a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Column names.
    pub names: Vec<String>,
    /// Values, line after line; NaN is missing.
    pub values: Vec<f64>,
}

impl Table {
    /// Lines in the table.
    #[must_use]
    pub fn len(&self) -> usize {
        if self.names.is_empty() { 0 } else { self.values.len() / self.names.len() }
    }

    /// Whether there is no line.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The lines.
    pub fn lines(&self) -> std::slice::ChunksExact<'_, f64> {
        self.values.chunks_exact(self.names.len().max(1))
    }

    /// Smallest and largest value of every column.
    #[must_use]
    pub fn ranges(&self) -> Vec<[f64; 2]> {
        let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; self.names.len()];
        for line in self.lines() {
            for ([low, high], value) in ranges.iter_mut().zip(line) {
                (*low, *high) = (low.min(*value), high.max(*value));
            }
        }
        ranges
    }

    /// Mean of every column, NaN left out.
    #[must_use]
    pub fn means(&self) -> Vec<f64> {
        let mut sums = vec![(0.0, 0.0); self.names.len()];
        for line in self.lines() {
            for ((sum, count), value) in sums.iter_mut().zip(line).filter(|(_, v)| !v.is_nan()) {
                (*sum, *count) = (*sum + value, *count + 1.0);
            }
        }
        sums.iter().map(|(sum, count)| sum / count).collect()
    }

    /// Σ(estimate − value)² of every column, for `estimates` laid out as the values are.
    #[must_use]
    pub fn squared_errors(&self, estimates: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; self.names.len()];
        for (line, estimates) in self.lines().zip(estimates.chunks_exact(sums.len().max(1))) {
            for (sum, (value, estimate)) in sums.iter_mut().zip(line.iter().zip(estimates)) {
                *sum += (estimate - value) * (estimate - value);
            }
        }
        sums
    }

    /// The `count` columns from the one at `from` on.
    ///
    /// # Panics
    /// If there are not so many.
    #[must_use]
    pub fn columns(&self, from: usize, count: usize) -> Self {
        let names = self.names[from..from + count].to_vec();
        let values = self.lines().flat_map(|line| line[from..from + count].to_vec()).collect();
        Self { names, values }
    }
}
