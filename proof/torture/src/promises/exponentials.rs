//! The exponential, over all numbers that it is for, and over all others.

use taxel_core::exp::{Exponential, Polynomial};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;

pub const POLYNOMIAL: Promise = Promise {
    name: "exp-polynomial",
    text: "e^x within 2 ulp, 0 below -87, falls, no NaN",
    share: 1,
    check: |effort, _| {
        let range = Range { exp: Polynomial::exp, end: -87.0, below: 0.0, step: ULP };
        range.sweep(effort, (2.0, "ulp"), |truth, y| {
            if y.is_normal() { error_ulp(truth, y) } else { f64::INFINITY }
        })
    },
};

/// Consecutive f32 that one case tests.
const BLOCK: u32 = 1 << 16;
/// Number of blocks that hold all f32.
const ALL: u64 = 1 << 16;
/// One of so many other blocks is tested at least.
const FEW: u64 = 128;

/// Blocks from −¼ to −4, which hold every way to reduce an argument, with the most digits: always tested.
const NEAR: [u64; 2] = [0xBE80, 0xC080];

/// Bits of −0.0, and of the first NaN behind −∞.
const NEGATIVE: [u32; 2] = [0x8000_0000, 0xFF80_0001];

const ULP: f64 = f32::EPSILON as f64;

/// An exponential, and where it is good.
struct Range {
    exp: fn(f32) -> f32,
    /// From here to 0 it has an error.
    end: f32,
    /// Largest result below.
    below: f32,
    /// Largest relative rise where it should fall: of rounding.
    step: f64,
}

impl Range {
    /// Tests numbers that are next to one another, block after block, and those at which the result's exponent or the
    /// way to it changes. The first case is of the latter.
    fn sweep(
        &self,
        effort: &Effort,
        bound: (f64, &'static str),
        error: impl Fn(f64, f32) -> f64 + Sync,
    ) -> Result<Found, String> {
        let near = NEAR[1] - NEAR[0];
        Ok(effort.worst((near + ALL / FEW, near + ALL), bound, |seed| {
            let number = seed.wrapping_sub(effort.seed());
            if number == 0 {
                let around = |x: f32| (x.to_bits().max(8) - 8)..=(x.to_bits() + 8);
                let halves = (-260..=0).map(|n| n as f32 * 0.5 * std::f32::consts::LN_2);
                let places = halves.chain([self.end, -104.0, -f32::MIN_POSITIVE, f32::MIN]);
                return places
                    .map(|x| self.worst(around(x), &error))
                    .try_fold(0.0, |worst: f64, found| Ok(worst.max(found?)));
            }
            let near = NEAR[0] + number - 1;
            // An odd step visits every block once.
            let block = if near < NEAR[1] { near } else { seed.wrapping_mul(20_011) % ALL };
            let first = block as u32 * BLOCK;
            self.worst(first..=first + (BLOCK - 1), &error)
        }))
    }

    /// Largest error at numbers of these bits. Those of larger bits are farther from 0.
    fn worst(
        &self,
        bits: impl Iterator<Item = u32>,
        error: impl Fn(f64, f32) -> f64,
    ) -> Result<f64, String> {
        let (mut worst, mut before) = (0.0_f64, f64::INFINITY);
        for bits in bits {
            let x = f32::from_bits(bits);
            if !(NEGATIVE[0]..NEGATIVE[1]).contains(&bits) {
                std::hint::black_box((self.exp)(x));
                continue;
            }
            let y = (self.exp)(x);
            let wide = f64::from(y);
            let most = if x < self.end { self.below } else { 1.0 };
            let is_higher = wide > before * (1.0 + self.step);
            if !(0.0..=most).contains(&y) || is_higher {
                return Err(format!("at {x:e} the result is {y:e}, after {before:e}"));
            }
            if x >= self.end {
                worst = worst.max(error(f64::from(x).exp(), y));
            }
            before = wide;
        }
        Ok(worst)
    }
}

/// Error of `y` for `truth`, in units in the last place of the true value.
fn error_ulp(truth: f64, y: f32) -> f64 {
    let ulp = f64::from((truth as f32).next_up() - truth as f32);
    (f64::from(y) - truth).abs() / ulp
}
