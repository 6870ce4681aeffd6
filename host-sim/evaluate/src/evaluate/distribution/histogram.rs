//! Histograms of the size of errors.

const BINS: usize = 50;
/// Largest error that has a bin, relative to what 95 % of the errors do not exceed: few wild errors must not squeeze
/// all others into one bin.
const MOST_OF_PERCENTILE_95: f64 = 8.0;

/// Numbers of errors |e| in bins of equal width from 0 on.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// Width of a bin, in the unit of the errors.
    pub bin_width: f64,
    /// Number of errors in each bin.
    pub counts: Vec<usize>,
    /// Number of errors beyond the last bin.
    pub beyond: usize,
}

impl Histogram {
    /// Histogram of `errors` |e| in ascending order, of which 95 % do not exceed `percentile_95`.
    pub(super) fn new(errors: &[f64], percentile_95: f64) -> Self {
        let largest = errors.last().copied().unwrap_or(0.0);
        let most = if percentile_95 > 0.0 {
            largest.min(MOST_OF_PERCENTILE_95 * percentile_95)
        } else {
            largest
        };
        // Without any error there is still a bin for all of them.
        let bin_width = if most > 0.0 { most / BINS as f64 } else { 1.0 };
        let mut histogram = Self { bin_width, counts: vec![0; BINS], beyond: 0 };
        for error in errors {
            // The largest error belongs to the last bin.
            let bin =
                if *error <= most { ((error / bin_width) as usize).min(BINS - 1) } else { BINS };
            match histogram.counts.get_mut(bin) {
                Some(count) => *count += 1,
                None => histogram.beyond += 1,
            }
        }
        histogram
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_wild_errors_do_not_squeeze_the_others() {
        let mut errors: Vec<f64> = (0..99).map(f64::from).collect();
        errors.push(1e6);
        let histogram = Histogram::new(&errors, 95.0);
        assert_eq!((histogram.beyond, histogram.counts.iter().sum::<usize>()), (1, 99));
        assert!((histogram.bin_width - 8.0 * 95.0 / 50.0).abs() < 1e-12);
        let even = Histogram::new(&[0.0, 1.0, 2.0, 50.0], 50.0);
        assert_eq!((even.counts[0], even.counts[1], even.counts[49], even.beyond), (1, 1, 1, 0));
        assert_eq!(Histogram::new(&[0.0; 5], 0.0).counts[0], 5);
    }
}
