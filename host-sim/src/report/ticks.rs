//! Ticks of axes, in steps of 1, 2 and 5.

use super::format::fixed;

/// Range of an axis with its ticks.
#[derive(Debug, Clone, PartialEq)]
pub struct Ticks {
    /// Least value of the range.
    pub low: f64,
    /// Greatest value of the range.
    pub high: f64,
    /// Ticks with their labels.
    pub at: Vec<(f64, String)>,
}

/// Range with about `wanted` intervals that covers all finite `values` and ends on ticks.
pub fn linear(values: impl IntoIterator<Item = f64>, wanted: usize) -> Ticks {
    let (low, high) = extent(values).unwrap_or((0.0, 1.0));
    let (low, high) = if high > low {
        (low, high)
    } else {
        let room = if low == 0.0 { 1.0 } else { low.abs() / 10.0 };
        (low - room, high + room)
    };
    let rough = (high - low) / wanted as f64;
    let exponent = rough.log10().floor();
    let mantissa = rough / 10_f64.powf(exponent);
    // The step changes at the geometric means of 1, 2, 5 and 10.
    let (mantissa, exponent) = match mantissa {
        m if m < 1.41 => (1.0, exponent),
        m if m < 3.16 => (2.0, exponent),
        m if m < 7.07 => (5.0, exponent),
        _ => (1.0, exponent + 1.0),
    };
    let step = mantissa * 10_f64.powf(exponent);
    // Whole numbers are divided, so that 0.3 is 0.3.
    let scale = 10_f64.powf(-exponent);
    let tick = |i: i64| i as f64 * mantissa / scale;
    // The slack keeps rounding from adding an interval at an end that is a tick.
    let first = (low / step + 1e-9).floor() as i64;
    let last = (high / step - 1e-9).ceil() as i64;
    let decimals = (-exponent).max(0.0) as usize;
    let at = (first..=last).map(|i| (tick(i), fixed(tick(i), decimals)));
    Ticks { low: tick(first), high: tick(last), at: at.collect() }
}

/// Range with exact ends, and about `wanted` intervals between round ticks.
pub fn within(low: f64, high: f64, wanted: usize) -> Ticks {
    let mut ticks = linear([low, high], wanted);
    let slack = 1e-9 * (high - low);
    ticks.at.retain(|(value, _)| (low - slack..=high + slack).contains(value));
    Ticks { low, high, ..ticks }
}

/// Logarithmic range around all positive `values`, with some room. Its ticks are at 1-2-5, or closer
/// within one decade.
pub fn logarithmic(values: impl IntoIterator<Item = f64>, label: impl Fn(f64) -> String) -> Ticks {
    let positive = values.into_iter().filter(|value| *value > 0.0);
    let (low, high) = extent(positive).unwrap_or((0.01, 0.1));
    let room = (high / low).powf(0.08).max(1.2);
    let (low, high) = (low / room, high * room);
    let mantissas: &[f64] =
        if high / low < 12.0 { &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0] } else { &[1.0, 2.0, 5.0] };
    let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let at = decades
        .flat_map(|decade| mantissas.iter().map(move |mantissa| mantissa * 10_f64.powi(decade)))
        .filter(|value| (low..=high).contains(value))
        .map(|value| (value, label(value)));
    Ticks { low, high, at: at.collect() }
}

/// Step from one written label to the next: the least with which neighbours are `apart` enough, from the `places` of all
/// ticks on the screen.
pub fn written(places: &[f64], apart: impl Fn(usize, usize) -> f64) -> usize {
    let fits = |step: &usize| {
        let written: Vec<usize> = (0..places.len()).step_by(*step).collect();
        let pairs = written.windows(2);
        pairs.into_iter().all(|p| (places[p[1]] - places[p[0]]).abs() >= apart(p[0], p[1]))
    };
    (1..=places.len()).find(fits).unwrap_or(1)
}

/// Entries at places that are at least `apart`, in ascending order: those for which there is no room are left out.
pub fn spread_out<T>(mut entries: Vec<(f64, T)>, apart: f64) -> Vec<(f64, T)> {
    entries.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut free = f64::NEG_INFINITY;
    entries.retain(|(at, _)| {
        let fits = *at >= free;
        if fits {
            free = at + apart;
        }
        fits
    });
    entries
}

/// Least and greatest of all finite values.
pub fn extent(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    values.into_iter().filter(|value| value.is_finite()).fold(None, |extent, value| {
        let (low, high) = extent.unwrap_or((value, value));
        Some((value.min(low), value.max(high)))
    })
}

#[cfg(test)]
mod tests {
    use super::super::format::percent;
    use super::*;

    fn labels(ticks: &Ticks) -> Vec<&str> {
        ticks.at.iter().map(|(_, label)| label.as_str()).collect()
    }

    #[test]
    fn linear_ticks_are_round_and_cover_the_values() {
        assert_eq!(labels(&linear([0.0, 1.0], 5)), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(&linear([48.2, 66.0], 4)), ["45", "50", "55", "60", "65", "70"]);
        let ticks = linear([-0.013, f64::NAN, 0.26], 5);
        assert_eq!((ticks.low, ticks.high), (-0.05, 0.3));
        assert_eq!(labels(&ticks)[..2], ["\u{2212}0.05", "0.00"]);
        assert_eq!(labels(&linear([0.0, 30_000.0], 3)), ["0", "10000", "20000", "30000"]);
    }

    #[test]
    fn no_range_still_has_ticks() {
        for values in [vec![], vec![f64::NAN], vec![0.0], vec![3.0, 3.0], vec![-2e-9]] {
            let ticks = linear(values.clone(), 4);
            assert!(ticks.high > ticks.low && ticks.at.len() >= 2, "{values:?}: {ticks:?}");
        }
    }

    #[test]
    fn labels_are_written_in_equal_steps() {
        let places = [0.0, 10.0, 20.0, 30.0, 40.0];
        assert_eq!(written(&places, |_, _| 10.0), 1);
        assert_eq!(written(&places, |_, _| 11.0), 2);
        assert_eq!(written(&places, |_, _| 1000.0), 5, "one is always written");
        assert_eq!(written(&[], |_, _| 1.0), 1);
    }

    #[test]
    fn numbers_that_would_overlap_are_left_out() {
        let numbers = vec![(30.0, 3), (0.0, 1), (8.0, 2), (30.0, 4)];
        assert_eq!(spread_out(numbers, 10.0), [(0.0, 1), (30.0, 3)]);
    }

    #[test]
    fn logarithmic_ticks_lie_inside() {
        let ticks = logarithmic([0.0, 0.005, 0.1], percent);
        assert_eq!(labels(&ticks), ["0.5\u{a0}%", "1\u{a0}%", "2\u{a0}%", "5\u{a0}%", "10\u{a0}%"]);
        assert!(ticks.low < 0.005 && ticks.high > 0.1);
        assert!(!logarithmic([0.01], percent).at.is_empty());
        assert!(logarithmic([], percent).low > 0.0);
    }
}
