//! What the test of a promise found.

/// What a test found.
#[derive(Debug, Clone)]
pub struct Found {
    pub cases: u64,
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
    /// Whether the promise was kept. NaN keeps none.
    pub fn keeps(&self) -> bool {
        self.cases > 0 && self.worst <= self.bound
    }
}
