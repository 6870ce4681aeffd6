//! Random draws that are the same on every platform, in any order, on any number of threads.
//!
//! Generator: xoshiro256++ (Blackman & Vigna, 2021), one for every purpose, row and frame, seeded from
//! these by SplitMix64. A frame therefore never depends on the frames before it, nor on which rows are
//! read.
//!
//! Uniform: the upper 53 bits over 2^53. Normal: Box–Muller, √(−2 ln(1 − u₁))·(cos, sin)(2π u₂), by
//! functions that every platform computes alike (`elementary`).

use std::f64::consts::TAU;

use crate::elementary::{ln, sin_cos};

mod lanes;

pub use lanes::RandomLanes;

/// Purpose of random draws. Different purposes never share numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// The contact that a whole frame shares.
    Contact = 1,
    /// Deformation of one row's electrodes.
    Deformation = 2,
    /// Noise on one row's readings.
    Noise = 3,
    /// Start and restarts of K-means.
    Centres = 4,
    /// Assignment of samples to folds.
    Folds = 5,
    /// Damage that a device must survive.
    Damage = 8,
    /// Drift of the gain in one session.
    Drift = 9,
    /// Noise that is left in the baseline of one session.
    Baseline = 10,
    /// Samples from which the least possible error is computed.
    Posterior = 11,
    /// Start of a mixture of Gaussians.
    Mixture = 12,
    /// Points of a plan that are drawn.
    Setup = 14,
    /// The path of a contact.
    Path = 15,
    /// Noise with a memory on one row's readings.
    CorrelatedNoise = 16,
    /// What is left of such noise in the baseline of one session.
    CorrelatedBaseline = 17,
}

/// Set of frames that draws are for. Training and test frames are independent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stream {
    /// Frames to train on; also what `synth` writes.
    Training = 1,
    /// Frames to evaluate on.
    Test = 2,
    /// Frames that measure each channel's span.
    Span = 3,
    /// Frames that training is refined on, besides those it starts from.
    Refinement = 4,
    /// Frames that a model's confidence is calibrated on.
    Calibration = 5,
}

/// Seeded source of random draws.
#[derive(Debug, Clone)]
pub struct Random {
    state: [u64; 4],
    spare_normal: Option<f64>,
}

impl Random {
    /// Source for `purpose` number `index` (say a frame) and `part` (say a row) of `stream`.
    pub fn new(seed: u64, stream: Stream, purpose: Purpose, index: u64, part: u64) -> Self {
        let words = [stream as u64, purpose as u64, index, part];
        let mixed = words.iter().fold(seed, |state, word| split_mix(state ^ split_mix(*word)));
        Self { state: seeded(mixed), spare_normal: None }
    }

    /// Draws a uniform number on [0, 1).
    pub fn unit(&mut self) -> f64 {
        unit(next(&mut self.state))
    }

    /// Draws a uniform number on [`low`, `high`).
    pub fn between(&mut self, [low, high]: [f64; 2]) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Draws a uniform whole number from 0 to `end` − 1; 0 if `end` is 0.
    pub fn below(&mut self, end: usize) -> usize {
        ((self.unit() * end as f64) as usize).min(end.saturating_sub(1))
    }

    /// Draws a standard normal number, by Box–Muller.
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare_normal.take() {
            return spare;
        }
        let [first, second] = normal_pair([self.unit(), self.unit()]);
        self.spare_normal = Some(second);
        first
    }
}

/// State of xoshiro256++ from a seed, by SplitMix64.
#[inline(always)]
fn seeded(mut seed: u64) -> [u64; 4] {
    [0; 4].map(|_: u64| {
        let word = split_mix(seed);
        seed = seed.wrapping_add(SPLIT_MIX_STEP);
        word
    })
}

/// The next number of xoshiro256++.
#[inline(always)]
fn next(s: &mut [u64; 4]) -> u64 {
    let number = s[0].wrapping_add(s[3]).rotate_left(23).wrapping_add(s[0]);
    let shifted = s[1] << 17;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= shifted;
    s[3] = s[3].rotate_left(45);
    number
}

/// Two standard normal numbers from two uniform ones.
#[inline(always)]
fn normal_pair([radius, turn]: [f64; 2]) -> [f64; 2] {
    let radius = (-2.0 * ln(1.0 - radius)).sqrt();
    let (sine, cosine) = sin_cos(TAU * turn);
    [radius * cosine, radius * sine]
}

/// Uniform number on [0, 1) from 64 random bits: the upper 53 over 2^53.
#[inline(always)]
fn unit(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}

/// Step by which SplitMix64's state advances with every number.
const SPLIT_MIX_STEP: u64 = 0x9e37_79b9_7f4a_7c15;

/// One step of SplitMix64 (Steele, Lea & Flood, 2014).
#[inline(always)]
fn split_mix(state: u64) -> u64 {
    let mut z = state.wrapping_add(SPLIT_MIX_STEP);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
