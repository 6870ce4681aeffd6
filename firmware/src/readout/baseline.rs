//! The baseline: the frame of the unloaded sensor.

use taxel_core::blob::Floats;

/// The mean of frames at rest, with which other frames are compared.
///
/// It takes memory for one frame. A reading that was missing, open or shorted in any of the frames stays NaN.
///
/// ```
/// use taxel_firmware::readout::Baseline;
/// let mut memory = [0.0; 2];
/// let mut baseline = Baseline::new(&mut memory);
/// baseline.restart(2);
/// baseline.add(&[59.0, 60.0]);
/// baseline.add(&[61.0, f32::NAN]);
/// assert_eq!(baseline.frames(), 2);
/// assert_eq!(baseline.mean()[0], 60.0);
/// assert_eq!(baseline.largest_relative_deviation(&[54.0, 1.0]), Some(0.1));
/// ```
#[derive(Debug, PartialEq)]
pub struct Baseline<'m> {
    memory: &'m mut [f32],
    readings: usize,
    frames: u16,
}

impl<'m> Baseline<'m> {
    /// Makes a baseline of no frames, with `memory` for the longest one.
    pub const fn new(memory: &'m mut [f32]) -> Self {
        Self { memory, readings: 0, frames: 0 }
    }

    /// Forgets all frames, and expects frames of so many `readings`, at most as many as there is memory for.
    pub fn restart(&mut self, readings: usize) {
        (self.readings, self.frames) = (readings.min(self.memory.len()), 0);
        self.memory.fill(0.0);
    }

    /// Replaces all frames by so many `frames` with the mean `readings` (Ω), which were kept.
    pub fn restore(&mut self, readings: Floats<'_>, frames: u16) {
        self.restart(readings.0.len() / 4);
        for (mean, ohm) in self.memory.iter_mut().zip(readings.iter()) {
            *mean = if usable(ohm) { ohm } else { f32::NAN };
        }
        self.frames = frames;
    }

    /// Adds one frame at rest (Ω) to the mean; after 65 535 frames nothing changes any more.
    pub fn add(&mut self, frame: &[f32]) {
        let Some(frames) = self.frames.checked_add(1) else { return };
        let share = 1.0 / f32::from(frames);
        for (mean, ohm) in self.memory.iter_mut().take(self.readings).zip(frame) {
            *mean = match (usable(*ohm), frames) {
                (false, _) => f32::NAN,
                (true, 1) => *ohm,
                (true, _) => *mean + (*ohm - *mean) * share,
            };
        }
        self.frames = frames;
    }

    /// Number of frames added so far.
    pub fn frames(&self) -> u16 {
        self.frames
    }

    /// The mean of the frames in Ω; NaN where a reading is not known, and 0 before the first frame.
    pub fn mean(&self) -> &[f32] {
        self.memory.get(..self.readings).unwrap_or_default()
    }

    /// The largest |R/R_rest − 1| of `frame`, or `None` if no reading is known in both.
    pub fn largest_relative_deviation(&self, frame: &[f32]) -> Option<f32> {
        let pairs = self.mean().iter().zip(frame);
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

    /// A baseline of these frames.
    fn of(frames: &[[f32; 3]]) -> Baseline<'static> {
        let mut baseline = Baseline::new(Box::leak(Box::new([0.0; 4])));
        baseline.restart(3);
        frames.iter().for_each(|frame| baseline.add(frame));
        baseline
    }

    #[test]
    fn the_mean_of_many_frames_is_theirs_to_the_last_digits() {
        let mut baseline = of(&[[60.0, 50.0, 40.0], [62.0, 50.0, 41.0]]);
        assert_eq!(baseline.mean(), [61.0, 50.0, 40.5]);
        baseline.restart(3);
        for i in 0..7000_u16 {
            baseline.add(&[55.0, 56.0, 57.0].map(|ohm| ohm + f32::from(i % 7) * 0.1));
        }
        for (mean, expected) in baseline.mean().iter().zip([55.3, 56.3, 57.3]) {
            assert!((mean / expected - 1.0).abs() < 1e-5, "{mean} instead of {expected}");
        }
    }

    #[test]
    fn what_is_not_known_is_compared_with_nothing() {
        for bad in [f32::NAN, f32::INFINITY, 0.0] {
            for place in 0..3 {
                let mut frames = [[60.0, 50.0, 40.0]; 3];
                frames[place][0] = bad;
                let baseline = of(&frames);
                assert!(baseline.mean()[0].is_nan());
                assert_eq!(baseline.mean()[1..], [50.0, 40.0]);
                let deviation = baseline.largest_relative_deviation(&[1.0, 50.0, 30.0]);
                assert_eq!(deviation, Some(0.25));
            }
        }
        let known = of(&[[60.0; 3]]);
        assert_eq!(known.largest_relative_deviation(&[60.0; 3]), Some(0.0));
        assert_eq!(known.largest_relative_deviation(&[f32::NAN; 3]), None);
        assert_eq!(of(&[]).largest_relative_deviation(&[60.0; 3]), None);
    }

    #[test]
    fn a_bad_stored_reading_is_missing_and_a_full_counter_stops() {
        let mut baseline = Baseline::new(Box::leak(Box::new([0.0; 4])));
        baseline.restore(Floats::new(&[60.0, 0.0, -1.0]), u16::MAX);
        baseline.add(&[1.0; 3]);
        let [first, others @ ..] = baseline.mean() else { panic!("three") };
        assert!(*first == 60.0 && others.len() == 2 && others.iter().all(|ohm| ohm.is_nan()));
        assert_eq!(baseline.frames(), u16::MAX);
    }
}
