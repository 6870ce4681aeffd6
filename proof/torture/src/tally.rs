//! Counts of what happened, for a line of the table.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::effort::Effort;
use crate::found::Found;

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

/// Runs `case` for at least 4000 seeds, and tells how often it had each of these outcomes.
pub fn outcomes<const N: usize>(
    effort: &Effort,
    (title, names): (&str, [&'static str; N]),
    unit: &'static str,
    case: fn(u64) -> Result<usize, String>,
) -> Found {
    let tally = Tally::new(names);
    let mut found = effort.worst((4000, 1 << 40), (0.0, unit), |seed| {
        tally.add(case(seed)?, 1);
        Ok(0.0)
    });
    if found.note.is_empty() {
        found.note = format!("{title}{}", tally.text());
    }
    found
}
