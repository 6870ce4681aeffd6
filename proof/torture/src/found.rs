//! What the test of a promise found.

/// What a test found.
#[derive(Debug, Clone)]
pub struct Found {
    pub cases: u64,
    /// Number of cases among them that the product refused, by name: nothing was judged there.
    pub refused: u64,
    /// The worst of them, in `unit`. Infinite for a case that failed outright.
    pub worst: f64,
    /// The largest value that keeps the promise.
    pub bound: f64,
    /// Unit of `worst` and `bound`.
    pub unit: &'static str,
    /// Seed that repeats the worst case first.
    pub seed: u64,
    /// What failed in the worst case, or what else is worth telling.
    pub note: String,
}

impl Found {
    /// Whether the promise was kept. NaN keeps none, and neither does a test whose cases were all refused.
    pub fn keeps(&self) -> bool {
        self.cases > self.refused && self.worst <= self.bound
    }

    /// Adds a note, unless there is one: of the case that failed.
    pub fn noted(mut self, note: impl FnOnce() -> String) -> Self {
        if self.note.is_empty() {
            self.note = note();
        }
        self
    }
}
