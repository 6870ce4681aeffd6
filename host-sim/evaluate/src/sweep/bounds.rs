//! Bounds on results: what is within them, and what comes nearest.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::axis::rounded;

/// Bounds on results, by their names.
pub type Bounds = BTreeMap<String, Bound>;
/// Results by their names.
pub type Values = BTreeMap<String, f64>;

/// Bound on a result: the most, or the least.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "BoundFile")]
#[serde(untagged)]
pub enum Bound {
    Most(f64),
    Least { least: f64 },
}

/// Bound as it stands in a plan: a number is the most.
#[derive(Deserialize)]
#[serde(untagged, expecting = "give a maximum, such as 10, or { least = 10 }")]
enum BoundFile {
    Number(f64),
    Named(NamedBound),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct NamedBound {
    most: Option<f64>,
    least: Option<f64>,
}

impl TryFrom<BoundFile> for Bound {
    type Error = &'static str;

    fn try_from(file: BoundFile) -> std::result::Result<Self, Self::Error> {
        match file {
            BoundFile::Number(most)
            | BoundFile::Named(NamedBound { most: Some(most), least: None })
                if !most.is_nan() =>
            {
                Ok(Self::Most(most))
            }
            BoundFile::Named(NamedBound { most: None, least: Some(least) }) if !least.is_nan() => {
                Ok(Self::Least { least })
            }
            _ => Err("a bound is a maximum or a minimum; give one of them, as a number"),
        }
    }
}

impl Bound {
    /// Whether a result is within the bound.
    pub fn allows(self, value: f64) -> bool {
        match self {
            Self::Most(most) => value <= most,
            Self::Least { least } => value >= least,
        }
    }

    /// Logarithm of the factor by which a value misses the bound, or the difference where there is no factor.
    pub fn missed_by(self, value: f64) -> f64 {
        if self.allows(value) {
            return 0.0;
        }
        let (Self::Most(bound) | Self::Least { least: bound }) = self;
        if bound > 0.0 && value > 0.0 { (value / bound).ln().abs() } else { (value - bound).abs() }
    }
}

impl std::fmt::Display for Bound {
    /// Bound in words, such as `at most 10`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Most(most) => write!(f, "at most {most}"),
            Self::Least { least } => write!(f, "at least {least}"),
        }
    }
}

/// Whether `results` are within all `bounds`; a result that is not known is within none.
pub fn are_within(bounds: &Bounds, results: &Values) -> bool {
    let allows = |(name, bound): (&String, &Bound)| {
        results.get(name).is_some_and(|value| bound.allows(*value))
    };
    bounds.iter().all(allows)
}

/// Index of the results that miss the worst of the `bounds` least, and in words what they have where they are bounded. `None`
/// if some are within all bounds, or there are none.
pub fn nearest<'r>(
    bounds: &Bounds,
    results: impl Iterator<Item = &'r Values> + Clone,
) -> Option<(usize, String)> {
    if results.clone().any(|results| are_within(bounds, results)) {
        return None;
    }
    let misses = |results: &Values| {
        let of = |(name, bound): (&String, &Bound)| {
            results.get(name).map_or(f64::INFINITY, |value| bound.missed_by(*value))
        };
        bounds.iter().map(of).fold(0.0, f64::max)
    };
    let (place, nearest) =
        results.enumerate().min_by(|(_, a), (_, b)| misses(a).total_cmp(&misses(b)))?;
    let results = bounds.keys().map(|name| match nearest.get(name) {
        // Five digits, or all of a count.
        Some(value) if value.abs() < 1000.0 => format!("{name} = {}", rounded(*value)),
        Some(value) => format!("{name} = {value:.0}"),
        None => format!("no {name}"),
    });
    Some((place, results.collect::<Vec<_>>().join(", ")))
}

/// What refuses all `results`, which have these names, and the nearest of them, in words; `None` if some are within the
/// bounds. It names the bounds that refuse each of them, or, if there are none, all.
pub fn none_within<'r>(
    bounds: &Bounds,
    results: &(impl Iterator<Item = &'r Values> + Clone),
    name: impl Fn(usize) -> String,
) -> Option<String> {
    let (place, of_nearest) = nearest(bounds, results.clone())?;
    let mut refusing = bounds.clone();
    refusing.retain(|name, bound| {
        let only = Bounds::from([(name.clone(), *bound)]);
        !results.clone().any(|results| are_within(&only, results))
    });
    let refusing = in_words(if refusing.is_empty() { bounds } else { &refusing });
    let name = Some(name(place)).filter(|name| !name.is_empty());
    let name = name.map_or(String::new(), |name| format!("{name} with "));
    Some(format!("within {refusing}; the nearest is {name}{of_nearest}"))
}

/// Bounds in words, such as `frame_ms at most 10`.
pub fn in_words(bounds: &Bounds) -> String {
    let bounds = bounds.iter().map(|(name, bound)| format!("{name} {bound}"));
    bounds.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_is_what_misses_the_worst_bound_least() {
        let of = |frame_ms: f64, cycles: f64| {
            Values::from([("frame_ms".to_owned(), frame_ms), ("cycles".to_owned(), cycles)])
        };
        let results = [of(6.0, 36_000.0), of(23.0, 18_000.0), of(9.0, 21_000.0)];
        let bounds = |ms, cycles| {
            let bounds = [("frame_ms", Bound::Most(ms)), ("cycles", Bound::Most(cycles))];
            Bounds::from(bounds.map(|(name, bound)| (name.to_owned(), bound)))
        };
        assert_eq!(nearest(&bounds(10.0, 30_000.0), results.iter()), None);
        let found = nearest(&bounds(8.0, 20_000.0), results.iter());
        assert_eq!(found, Some((2, "cycles = 21000, frame_ms = 9".into())));
        assert_eq!(in_words(&bounds(8.0, 20_000.0)), "cycles at most 20000, frame_ms at most 8");
        let said =
            |ms, cycles| none_within(&bounds(ms, cycles), &results.iter(), |i| format!("p{i}"));
        let nearest_is = "the nearest is p2 with cycles = 21000, frame_ms = 9";
        assert_eq!(said(8.0, 17_000.0), Some(format!("within cycles at most 17000; {nearest_is}")));
        let both = "within cycles at most 20000, frame_ms at most 8";
        assert_eq!(said(8.0, 20_000.0), Some(format!("{both}; {nearest_is}")));
        let rate = Bounds::from([("frames_per_s".to_owned(), Bound::Least { least: 1.0 })]);
        let unknown = nearest(&rate, results.iter()).unwrap();
        assert!(unknown.1.contains("no frames_per_s") && !are_within(&rate, &results[0]));
        // The least is a bound from below, which it meets itself.
        let cycles = |least| Bounds::from([("cycles".to_owned(), Bound::Least { least })]);
        assert_eq!(nearest(&cycles(36_000.0), results.iter()), None);
        let least = nearest(&cycles(40_000.0), results.iter());
        assert_eq!(least, Some((0, "cycles = 36000".into())));
        assert!(are_within(&bounds(6.0, 36_000.0), &results[0]));
        // Misses are compared as factors: twice the time is more than one and a half times the cycles; without a
        // factor, as differences.
        let results = [of(16.0, 1000.0), of(8.0, 1500.0)];
        assert_eq!(nearest(&bounds(8.0, 1000.0), results.iter()).unwrap().0, 1);
        let missed = |least: f64, value| Bound::Least { least }.missed_by(value);
        assert_eq!([missed(4.0, 2.0), missed(4.0, 8.0)], [2.0_f64.ln(), 0.0]);
        assert_eq!([missed(4.0, 0.0), missed(4.0, -1.0), missed(-1.0, -3.0)], [4.0, 5.0, 2.0]);
    }
}
