//! Readings at rest as series, in stretches of frames that follow one another.

use std::ops::Range;

use crate::table::Table;

/// Fewest frames that tell what noise is like.
const FEWEST_FRAMES: usize = 40;
/// Fewest lags that a time constant and a drift are told apart by.
const FEWEST_LAGS: usize = 4;
/// Most readings that are looked at, spread evenly: more tell no more.
const MOST_READINGS: usize = 256;
/// Most frames that are looked at: the first.
const MOST_FRAMES: usize = 100_000;
/// Most pairs of frames that tell how far readings share their noise.
const MOST_PAIRS: usize = 2000;
/// Share of lines without a value from which a reading is left out, rather than the lines.
const MISSING: f64 = 0.1;
/// Share of the median by which nine of ten times between frames may differ from it at a steady rate.
const STEADY: f64 = 0.25;
/// Times between frames above which frames are missing, in medians.
const GAP: f64 = 1.5;

/// Readings at rest, each as a series.
pub(super) struct Series {
    pub columns: Vec<Vec<f64>>,
    /// Place of each in the table.
    pub places: Vec<usize>,
    /// Stretches without a gap.
    stretches: Vec<Range<usize>>,
    /// Time between two frames, if it is steady.
    pub interval_s: Option<f64>,
}

impl Series {
    pub fn new(readings: &Table, numbers: &[usize], times_s: Option<&[f64]>) -> Option<Self> {
        let frames = readings.len().min(MOST_FRAMES);
        let counts = readings.counts();
        let least = (1.0 - MISSING) * readings.len() as f64;
        let ranges = readings.ranges();
        let changes = |column: &usize| ranges[*column][0] < ranges[*column][1];
        let whole = (0..counts.len()).filter(|column| counts[*column] as f64 >= least);
        let whole: Vec<usize> = whole.filter(changes).collect();
        let step = whole.len().div_ceil(MOST_READINGS).max(1);
        let places: Vec<usize> = whole.into_iter().step_by(step).collect();
        let column = |place: &usize| (0..frames).map(|line| readings.line(line)[*place]).collect();
        let columns: Vec<Vec<f64>> = places.iter().map(column).collect();
        let follows = |at: usize| numbers[at] == numbers[at - 1] + 1;
        let steps = |times_s: &[f64]| -> Vec<f64> {
            (1..frames).filter(|at| follows(*at)).map(|at| times_s[at] - times_s[at - 1]).collect()
        };
        let interval_s = times_s.and_then(|times_s| steady(steps(times_s)));
        let is_gap = |at: usize| {
            times_s.zip(interval_s).is_some_and(|(t, step)| t[at] - t[at - 1] > GAP * step)
        };
        let mut stretches: Vec<Range<usize>> = Vec::new();
        for at in 0..frames {
            if columns.iter().any(|column| column[at].is_nan()) {
                continue;
            }
            match stretches.last_mut() {
                Some(last) if last.end == at && follows(at) && !is_gap(at) => last.end = at + 1,
                _ => stretches.push(at..at + 1),
            }
        }
        let series = Self { columns, places, stretches, interval_s };
        (series.frames() >= FEWEST_FRAMES).then_some(series)
    }

    /// Number of frames in all stretches.
    pub fn frames(&self) -> usize {
        self.stretches.iter().map(ExactSizeIterator::len).sum()
    }

    /// Number of pairs of frames so far apart.
    pub fn pairs(&self, lag: usize) -> f64 {
        self.stretches.iter().map(|it| it.len().saturating_sub(lag)).sum::<usize>() as f64
    }

    /// Longest lag: half of the longest stretch, and a tenth of all frames.
    fn longest_lag(&self) -> usize {
        let longest = self.stretches.iter().map(ExactSizeIterator::len).max().unwrap_or(0);
        (longest / 2).min(self.frames() / 10)
    }

    /// Lags to look at, ever farther apart; `None` if there are too few.
    pub fn lags(&self) -> Option<Vec<usize>> {
        let next = |lag: &usize| Some((*lag + 1).max((1.25 * *lag as f64) as usize));
        let longest = self.longest_lag();
        let lags: Vec<usize> =
            std::iter::successors(Some(1), next).take_while(|lag| *lag <= longest).collect();
        (lags.len() >= FEWEST_LAGS).then_some(lags)
    }

    /// Numbers of successive frames to average: powers of two.
    pub fn numbers_averaged(&self) -> Vec<usize> {
        let longest = self.longest_lag();
        std::iter::successors(Some(1), |n| Some(2 * n)).take_while(|n| *n <= longest).collect()
    }

    /// Half the mean squared difference of frames that are each of these `lags` apart.
    pub fn variogram(&self, column: &[f64], lags: &[usize]) -> Vec<f64> {
        let half = |lag: &usize| {
            let of = |stretch: &Range<usize>| -> f64 {
                let values = &column[stretch.clone()];
                let later = values.get(*lag..).unwrap_or_default();
                later.iter().zip(values).map(|(b, a)| (b - a) * (b - a)).sum()
            };
            self.stretches.iter().map(of).sum::<f64>() / (2.0 * self.pairs(*lag))
        };
        lags.iter().map(half).collect()
    }

    /// Allan variance of means of so many `frames`, over all starts.
    pub fn allan_variance(&self, column: &[f64], frames: usize) -> f64 {
        let (mut squares, mut count) = (0.0, 0_usize);
        for stretch in &self.stretches {
            let values = &column[stretch.clone()];
            let Some(starts) = (values.len() + 1).checked_sub(2 * frames) else { continue };
            let steps = values.get(frames..).unwrap_or_default().iter().zip(values);
            let steps: Vec<f64> = steps.map(|(b, a)| b - a).collect();
            let mut sum: f64 = steps[..frames.min(steps.len())].iter().sum();
            for start in 0..starts {
                squares += sum * sum;
                sum += steps.get(start + frames).unwrap_or(&0.0) - steps[start];
            }
            count += starts;
        }
        squares / (2.0 * (frames * frames * count) as f64)
    }

    /// Number of readings with noise of their own that tell as much as these `columns`: n²/Σρ², by the correlations ρ of
    /// their changes between neighbours. Chance's share of ρ² is taken off.
    pub fn independent(&self, columns: &[usize]) -> f64 {
        let starts =
            self.stretches.iter().flat_map(|it| it.clone().step_by(2).map(move |at| (at, it.end)));
        let starts: Vec<usize> =
            starts.filter(|(at, end)| at + 1 < *end).map(|(at, _)| at).take(MOST_PAIRS).collect();
        let unit = |column: &usize| {
            let of = &self.columns[*column];
            let changes: Vec<f64> = starts.iter().map(|at| of[at + 1] - of[*at]).collect();
            let length = changes.iter().map(|change| change * change).sum::<f64>().sqrt();
            changes.into_iter().map(|change| change / length.max(f64::MIN_POSITIVE)).collect()
        };
        let units: Vec<Vec<f64>> = columns.iter().map(unit).collect();
        let (mut squares, by_chance) = (0.0, 1.0 / starts.len() as f64);
        for (place, a) in units.iter().enumerate() {
            for b in &units[..place] {
                let correlation: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                squares += 2.0 * (correlation * correlation - by_chance) / (1.0 - by_chance);
            }
        }
        let all = columns.len() as f64;
        (all * all / (all + squares).max(all)).max(1.0)
    }
}

/// Median of `steps`, if nine of ten are near it.
fn steady(mut steps: Vec<f64>) -> Option<f64> {
    steps.sort_unstable_by(f64::total_cmp);
    let at = |share: usize| steps.get(share * steps.len() / 100).copied();
    let (low, median, high) = (at(5)?, at(50)?, at(95)?);
    let near = (1.0 - STEADY) * median <= low && high <= (1.0 + STEADY) * median;
    (median > 0.0 && near).then_some(median)
}
