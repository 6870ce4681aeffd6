//! Densities of pairs of truth and estimate.

const BINS: usize = 32;

/// Numbers of pairs of truth and estimate in square bins.
#[derive(Debug, Clone, PartialEq)]
pub struct Density {
    /// Least truth and estimate that have a bin, in the unit of the outputs.
    pub low: f64,
    /// Largest truth and estimate that have a bin.
    pub high: f64,
    /// Number of bins along either axis.
    pub bins: usize,
    /// Number of pairs in each bin, `bins × bins`: truths from low to high for the lowest estimates, then for the next.
    pub counts: Vec<usize>,
    /// Number of pairs whose estimate is beyond the bins.
    pub outside: usize,
}

impl Density {
    /// Density of `pairs` of truth and estimate; the bins cover all truths.
    pub(super) fn new(pairs: &[[f64; 2]]) -> Self {
        let truths = pairs.iter().map(|[truth, _]| *truth);
        let (low, high) = truths.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), truth| {
            (low.min(truth), high.max(truth))
        });
        let (low, high) = match high - low {
            // One bin to spare on either side, for estimates just beyond.
            span if span > 0.0 => {
                let bin = span / (BINS - 2) as f64;
                (low - bin, high + bin)
            }
            _ if pairs.is_empty() => (0.0, 1.0),
            _ => (low - 0.5, low + 0.5),
        };
        let mut density = Self { low, high, bins: BINS, counts: vec![0; BINS * BINS], outside: 0 };
        let bin = |value: f64| {
            let place = (value - low) / (high - low) * BINS as f64;
            (0.0..BINS as f64).contains(&place).then_some(place as usize)
        };
        for [truth, estimate] in pairs {
            match (bin(*truth), bin(*estimate)) {
                (Some(x), Some(y)) => density.counts[y * BINS + x] += 1,
                _ => density.outside += 1,
            }
        }
        density
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_lie_in_their_bins() {
        let pairs = [[0.0, 0.0], [30.0, 29.5], [15.0, 80.0], [15.0, -0.5]];
        let density = Density::new(&pairs);
        assert_eq!((density.low, density.high), (-1.0, 31.0));
        assert_eq!(density.outside, 1);
        assert_eq!(density.counts[32 + 1], 1, "0 is in the second bin of both");
        assert_eq!(density.counts[30 * 32 + 31], 1);
        assert_eq!(density.counts[16], 1, "below the least truth");
        assert_eq!(Density::new(&[[3.0, 3.0]]).counts[16 * 32 + 16], 1);
    }
}
