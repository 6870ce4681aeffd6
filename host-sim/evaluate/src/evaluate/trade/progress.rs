//! Progress of a part of the work, as steps of the whole.

use std::sync::atomic::{AtomicUsize, Ordering};

use taxel_data::progress::Progress;

/// Part of a stage. Stages inside it show nothing by themselves: their steps are steps of the stage around it.
pub(super) struct Part<'p> {
    whole: &'p dyn Progress,
    /// Number of steps that this part has, and of those that are done.
    steps: usize,
    done: AtomicUsize,
    /// Steps of the whole that a step of this part is worth.
    weight: usize,
}

impl<'p> Part<'p> {
    /// Part of so many `steps`, each of them worth `weight` steps of the `whole`.
    pub fn new(whole: &'p dyn Progress, steps: usize, weight: usize) -> Self {
        Self { whole, steps, done: AtomicUsize::new(0), weight }
    }

    /// Counts all steps as done: some work ends sooner than was planned.
    pub fn finish(&self) {
        while self.done.load(Ordering::Relaxed) < self.steps {
            self.step();
        }
    }
}

impl Progress for Part<'_> {
    fn stage(&self, _: &str, _: usize) {}

    fn step(&self) {
        // Never more than were announced.
        if self.done.fetch_add(1, Ordering::Relaxed) < self.steps {
            (0..self.weight).for_each(|_| self.whole.step());
        }
    }
}
