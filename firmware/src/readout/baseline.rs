//! The baseline: the frame of the unloaded sensor.

use model_core::Frame;

/// The mean of frames at rest, with which other frames are compared.
///
/// It takes one array of readings. A reading that was missing, open or shorted in any of the frames stays NaN.
///
/// ```
/// use firmware::readout::Baseline;
/// use model_core::Frame;
/// let mut baseline = Baseline::<1, 2>::new();
/// baseline.add(&Frame { row_column_resistance_ohm: [[59.0, 60.0]] });
/// baseline.add(&Frame { row_column_resistance_ohm: [[61.0, f32::NAN]] });
/// assert_eq!(baseline.frames(), 2);
/// assert_eq!(baseline.mean().row_column_resistance_ohm[0][0], 60.0);
/// let pressed = Frame { row_column_resistance_ohm: [[54.0, 1.0]] };
/// assert_eq!(baseline.largest_relative_deviation(&pressed), Some(0.1));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Baseline<const ROWS: usize, const COLS: usize> {
    mean: Frame<ROWS, COLS>,
    frames: u16,
}

impl<const ROWS: usize, const COLS: usize> Default for Baseline<ROWS, COLS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const ROWS: usize, const COLS: usize> Baseline<ROWS, COLS> {
    /// Makes a baseline of no frames, in which no reading is known.
    #[must_use]
    pub const fn new() -> Self {
        Self { mean: Frame { row_column_resistance_ohm: [[0.0; COLS]; ROWS] }, frames: 0 }
    }

    /// Adds one frame at rest to the mean; after 65 535 frames nothing changes any more.
    pub fn add(&mut self, frame: &Frame<ROWS, COLS>) {
        let Some(frames) = self.frames.checked_add(1) else { return };
        let share = 1.0 / f32::from(frames);
        let means = self.mean.row_column_resistance_ohm.as_flattened_mut();
        for (mean, ohm) in means.iter_mut().zip(frame.row_column_resistance_ohm.as_flattened()) {
            *mean = match (usable(*ohm), frames) {
                (false, _) => f32::NAN,
                (true, 1) => *ohm,
                (true, _) => *mean + (*ohm - *mean) * share,
            };
        }
        self.frames = frames;
    }

    /// Number of frames added so far.
    #[must_use]
    pub fn frames(&self) -> u16 {
        self.frames
    }

    /// The mean of the frames in Ω; NaN where a reading is not known, and 0 before the first frame.
    #[must_use]
    pub fn mean(&self) -> &Frame<ROWS, COLS> {
        &self.mean
    }

    /// The largest |R/R_rest − 1| of `frame`, or `None` if no reading is known in both.
    #[must_use]
    pub fn largest_relative_deviation(&self, frame: &Frame<ROWS, COLS>) -> Option<f32> {
        let rest = self.mean.row_column_resistance_ohm.as_flattened().iter();
        let pairs = rest.zip(frame.row_column_resistance_ohm.as_flattened());
        pairs
            .filter(|(rest, ohm)| usable(**rest) && usable(**ohm))
            .map(|(rest, ohm)| ((ohm - rest) / rest).abs())
            .reduce(f32::max)
    }
}

fn usable(ohm: f32) -> bool {
    ohm.is_finite() && ohm > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(ohm: [f32; 3]) -> Frame<1, 3> {
        Frame { row_column_resistance_ohm: [ohm] }
    }

    #[test]
    fn the_mean_of_many_frames_is_theirs_to_the_last_digits() {
        let mut baseline = Baseline::<1, 3>::new();
        let reading = |i: u16, k: f32| 55.0 + k + f32::from(i % 7) * 0.1;
        for i in 0..7000 {
            baseline.add(&frame([reading(i, 0.0), reading(i, 1.0), reading(i, 2.0)]));
        }
        for (k, mean) in baseline.mean().row_column_resistance_ohm[0].iter().enumerate() {
            let expected = 55.3 + k as f32;
            assert!((mean / expected - 1.0).abs() < 1e-5, "{mean} instead of {expected}");
        }
    }

    #[test]
    fn what_was_missing_once_stays_missing() {
        for bad in [f32::NAN, f32::INFINITY, 0.0] {
            for place in 0..3 {
                let mut baseline = Baseline::<1, 3>::new();
                for i in 0..3 {
                    let first = if i == place { bad } else { 60.0 };
                    baseline.add(&frame([first, 50.0, 40.0]));
                }
                let [[first, rest @ ..]] = baseline.mean().row_column_resistance_ohm;
                assert!(first.is_nan());
                assert_eq!(rest, [50.0, 40.0]);
                let deviation = baseline.largest_relative_deviation(&frame([1.0, 50.0, 30.0]));
                assert_eq!(deviation, Some(0.25));
            }
        }
    }

    #[test]
    fn nothing_known_is_no_deviation_at_all() {
        let mut baseline = Baseline::<1, 3>::new();
        assert_eq!(baseline.largest_relative_deviation(&frame([60.0; 3])), None);
        baseline.add(&frame([60.0; 3]));
        assert_eq!(baseline.largest_relative_deviation(&frame([f32::NAN; 3])), None);
        assert_eq!(baseline.largest_relative_deviation(&frame([60.0; 3])), Some(0.0));
    }

    #[test]
    fn a_counter_at_its_end_changes_nothing_more() {
        let mut baseline = Baseline { mean: frame([60.0; 3]), frames: u16::MAX };
        let before = baseline.clone();
        baseline.add(&frame([1.0; 3]));
        assert_eq!(baseline, before);
    }
}
