//! Counts of what happened, for a line of the table.

use std::sync::atomic::{AtomicU64, Ordering};

/// Counts under names.
pub struct Tally<const N: usize> {
    names: [&'static str; N],
    counts: [AtomicU64; N],
}

impl<const N: usize> Tally<N> {
    /// Counts of nothing yet.
    pub fn new(names: [&'static str; N]) -> Self {
        Self { names, counts: [const { AtomicU64::new(0) }; N] }
    }

    /// Adds `more` to the count number `index`.
    pub fn add(&self, index: usize, more: u64) {
        self.counts[index].fetch_add(more, Ordering::Relaxed);
    }

    /// The count number `index`.
    pub fn count(&self, index: usize) -> u64 {
        self.counts[index].load(Ordering::Relaxed)
    }

    /// The sum of all counts.
    pub fn sum(&self) -> u64 {
        self.counts.iter().map(|count| count.load(Ordering::Relaxed)).sum()
    }

    /// All counts with their names.
    pub fn text(&self) -> String {
        let counts = self.counts.iter().map(|count| count.load(Ordering::Relaxed));
        let parts = self.names.iter().zip(counts).map(|(name, count)| format!("{name} {count}"));
        parts.collect::<Vec<_>>().join(", ")
    }
}
