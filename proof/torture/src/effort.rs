//! How much a test does: from which seed on, and for how long.

use std::any::Any;
use std::cell::RefCell;
use std::panic::{self, AssertUnwindSafe, PanicHookInfo};
use std::time::{Duration, Instant};

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::found::Found;

/// How much a test does.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    seed: u64,
    end: Instant,
}

/// The worst case so far.
#[derive(Debug, Clone)]
struct Worst {
    value: f64,
    seed: u64,
    note: String,
    refused: u64,
}

impl Effort {
    /// Effort from `seed` on, for `time` from now.
    pub fn new(seed: u64, time: Duration) -> Self {
        Self { seed, end: Instant::now() + time }
    }

    /// Seed of the first case.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Whether the time for further cases is over.
    pub fn is_over(&self) -> bool {
        Instant::now() >= self.end
    }

    /// Runs `case` for one seed after another, on all cores: for the first `least`, and for more up to `most` while
    /// there is time. A case gives its value, the larger the worse, or says what failed. A panic is a failure, and told
    /// by the note alone.
    ///
    /// The caller compares the worst value with `bound`, both in `unit`.
    pub fn worst(
        &self,
        cases: (u64, u64),
        bound: (f64, &'static str),
        case: impl Fn(u64) -> Result<f64, String> + Sync,
    ) -> Found {
        self.worst_of_accepted(cases, bound, |seed| case(seed).map(Some))
    }

    /// As [`Self::worst`], for cases that the product may refuse, which have no value.
    pub fn worst_of_accepted(
        &self,
        (least, most): (u64, u64),
        (bound, unit): (f64, &'static str),
        case: impl Fn(u64) -> Result<Option<f64>, String> + Sync,
    ) -> Found {
        let _quiet = Quiet::begin();
        let mut worst = Worst { seed: self.seed, ..Worst::none() };
        let mut cases = 0;
        while cases < least || (cases < most && !self.is_over()) {
            let several =
                if cases < least { least - cases } else { least.max(16).min(most - cases) };
            let first = self.seed.wrapping_add(cases);
            let seeds = (0..several).into_par_iter().map(|offset| first.wrapping_add(offset));
            let tested = seeds.map(|seed| tested(seed, &case));
            worst = worse(worst, tested.reduce(Worst::none, worse));
            cases += several;
        }
        let Worst { value, seed, note, refused } = worst;
        Found { cases, refused, worst: value, bound, unit, seed, note }
    }
}

impl Worst {
    /// The worst of no case.
    fn none() -> Self {
        Self::new(f64::NEG_INFINITY, u64::MAX, String::new())
    }

    fn new(value: f64, seed: u64, note: String) -> Self {
        Self { value, seed, note, refused: 0 }
    }
}

fn tested(seed: u64, case: impl Fn(u64) -> Result<Option<f64>, String>) -> Worst {
    let outcome = panic::catch_unwind(AssertUnwindSafe(|| case(seed)));
    let told = |cause: Box<dyn Any + Send>| {
        let place = PLACE.take();
        let place = if place.is_empty() { place } else { format!(" at {place}") };
        Err(format!("panic{place}: {}", said(&*cause)))
    };
    match outcome.unwrap_or_else(told) {
        // NaN is worse than any number.
        Ok(Some(value)) if value.is_nan() => Worst::new(f64::INFINITY, seed, "NaN".to_owned()),
        Ok(Some(value)) => Worst::new(value, seed, String::new()),
        Ok(None) => Worst { refused: 1, ..Worst::none() },
        Err(note) => Worst::new(f64::INFINITY, seed, note),
    }
}

/// The worse of two cases; of equals that of the lower seed, so that the number of cores does not matter.
fn worse(one: Worst, other: Worst) -> Worst {
    let is_other = other.value > one.value || (other.value == one.value && other.seed < one.seed);
    let refused = one.refused + other.refused;
    Worst { refused, ..if is_other { other } else { one } }
}

fn said(cause: &(dyn Any + Send)) -> &str {
    let text = cause.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| cause.downcast_ref::<&str>().copied()).unwrap_or("without a message")
}

thread_local! {
    /// Where this thread panicked last.
    static PLACE: RefCell<String> = const { RefCell::new(String::new()) };
}

type Hook = Box<dyn Fn(&PanicHookInfo<'_>) + Send + Sync>;

/// A time in which panics are not printed: thousands of them, each with a backtrace, would bury the table.
struct Quiet(Option<Hook>);

impl Quiet {
    fn begin() -> Self {
        let before = panic::take_hook();
        panic::set_hook(Box::new(|info| {
            PLACE.set(info.location().map(ToString::to_string).unwrap_or_default());
        }));
        Self(Some(before))
    }
}

impl Drop for Quiet {
    fn drop(&mut self) {
        if let Some(before) = self.0.take() {
            panic::set_hook(before);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;

    /// Number of panics that were printed.
    static PRINTED: AtomicU64 = AtomicU64::new(0);

    #[test]
    fn a_panic_is_told_by_the_note_alone() {
        let before = panic::take_hook();
        panic::set_hook(Box::new(|_| {
            PRINTED.fetch_add(1, Ordering::Relaxed);
        }));
        let effort = Effort::new(1, Duration::ZERO);
        let found = effort.worst((3, 3), (0.0, "broken"), |seed| {
            assert_ne!(seed, 2, "the second case breaks");
            Ok(0.0)
        });
        let meanwhile = PRINTED.load(Ordering::Relaxed);
        let _ = panic::catch_unwind(|| panic!("afterwards"));
        let afterwards = PRINTED.load(Ordering::Relaxed);
        panic::set_hook(before);
        assert_eq!((found.seed, found.keeps()), (2, false));
        let note = &found.note;
        assert!(note.contains("effort.rs") && note.contains("the second case breaks"), "{note}");
        assert_eq!((meanwhile, afterwards), (0, 1));
    }
}
