//! Random draws of many frames at once, one frame a lane: the same numbers as [`Random`](super::Random)
//! draws.

#![allow(clippy::needless_range_loop, reason = "lanes of several arrays are indexed alike")]

use super::{Purpose, Stream, next, normal_pair, seeded, split_mix, unit};
use crate::simd::{LANES, Lanes};

/// Sources of the same purpose for consecutive frames.
#[derive(Debug, Clone)]
pub struct RandomLanes {
    state: [Lanes<u64>; 4],
    /// `split_mix` of every frame's number: the frame's share of the seed.
    mixed_frames: Lanes<u64>,
}

impl RandomLanes {
    /// Sources for the frames from number `first` on; call [`start`](Self::start) before drawing.
    #[inline(always)]
    pub fn new(first: usize) -> Self {
        Self::every(first, 1)
    }

    /// Sources for every `step`th frame from number `first` on; call [`start`](Self::start) before
    /// drawing.
    #[inline(always)]
    pub fn every(first: usize, step: usize) -> Self {
        let mut mixed_frames = [0; LANES];
        for (lane, mixed) in mixed_frames.iter_mut().enumerate() {
            *mixed = split_mix((first + lane * step) as u64);
        }
        Self { state: [[0; LANES]; 4], mixed_frames }
    }

    /// Starts the sources for `purpose` and `part` (say a row) of every frame, seeded like
    /// [`super::Random::new`].
    #[inline(always)]
    pub fn start(&mut self, seed: u64, stream: Stream, purpose: Purpose, part: u64) {
        let common = [stream as u64, purpose as u64].into_iter();
        let common = common.fold(seed, |state, word| split_mix(state ^ split_mix(word)));
        let part = split_mix(part);
        for lane in 0..LANES {
            let mixed = split_mix(split_mix(common ^ self.mixed_frames[lane]) ^ part);
            for (words, word) in self.state.iter_mut().zip(seeded(mixed)) {
                words[lane] = word;
            }
        }
    }

    /// Draws `N` uniform numbers a lane, one from each range [`low`, `high`), equal to those of
    /// [`super::Random::between`].
    #[inline(always)]
    pub fn between<const N: usize>(&mut self, ranges: [[f64; 2]; N], lanes: &mut [Lanes; N]) {
        for lane in 0..LANES {
            let mut state = self.state.each_ref().map(|words| words[lane]);
            for ([low, high], place) in ranges.into_iter().zip(0..) {
                lanes[place][lane] = low + (high - low) * unit(next(&mut state));
            }
            for (words, word) in self.state.iter_mut().zip(state) {
                words[lane] = word;
            }
        }
    }

    /// Draws two standard normal numbers a lane, equal to those of [`super::Random::normal`].
    #[inline(always)]
    pub fn normal_pair(&mut self, first: &mut Lanes, second: &mut Lanes) {
        let mut units = [[0.0; LANES]; 2];
        self.between([[0.0, 1.0]; 2], &mut units);
        for lane in 0..LANES {
            [first[lane], second[lane]] = normal_pair(units.map(|unit| unit[lane]));
        }
    }
}
