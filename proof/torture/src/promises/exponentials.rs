//! Every exponential, over all numbers that it is for, and over all others.

use taxel_core::exp::{ExpKernel, Libm, Micromath, Polynomial, exp2};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tools::Tools;

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

pub const LIBM: Promise = Promise {
    name: "exp-libm",
    text: "e^x within 1 ulp, tiny below -87, falls, no NaN",
    share: 1,
    check: |effort, _| {
        let range = Range { exp: Libm::exp, end: -87.0, below: 1.7e-38, step: 0.0 };
        range.sweep(effort, (1.0, "ulp"), error_ulp)
    },
};

pub const MICROMATH: Promise = Promise {
    name: "exp-micromath",
    text: "e^x within 0.24 %, 0 below -80, falls, no NaN",
    share: 1,
    check: |effort, _| {
        let range = Range { exp: Micromath::exp, end: -80.0, below: 0.0, step: 3e-5 };
        range.sweep(effort, (0.24, "%"), |truth, y| 100.0 * (f64::from(y) / truth - 1.0).abs())
    },
};

pub const EXP2: Promise = Promise {
    name: "exp-exp2",
    text: "2^x within 2 ulp from -126 to 1, rises",
    share: 0,
    check: base_two,
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
                // micromath asserts, in debug builds, that its argument is no larger than it is for.
                std::hint::black_box((self.exp)(if x > 80.0 { 80.0 } else { x }));
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

/// Bits of 2⁻²⁶, nearer to 0 than which every number gives 1, and of ½.
const FRACTIONS: [u32; 2] = [0x3280_0000, 0x3F00_0000];
const FRACTIONS_AT_ONCE: u32 = 1 << 20;

/// 2^(n + f) is 2^f times a power of two, for n from −126 to 0 and f from −½ to ½: so every f is tested once, and with
/// every n some.
fn base_two(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let blocks = u64::from((FRACTIONS[1] - FRACTIONS[0]) / FRACTIONS_AT_ONCE);
    let cases = 2 * blocks + 2;
    Ok(effort.worst((cases, cases), (2.0, "ulp"), |seed| {
        let case = seed % cases;
        let bad = |u: f32| Err(format!("2^{u:e} is {:e}", exp2(u)));
        if case == 0 {
            // Anything else gives no panic, and what is next to 0 gives 1.
            for bits in 0..1 << 24 {
                std::hint::black_box(exp2(f32::from_bits(bits << 8)));
            }
            let tiny = [0.0, 1e-45, 1e-30, 1.4e-8].into_iter().flat_map(|f: f32| [f, -f]);
            return tiny.into_iter().find(|f| exp2(*f) != 1.0).map_or(Ok(0.0), bad);
        }
        if case == 1 {
            for (n, k) in (-126..=1).flat_map(|n| (-32_768..=32_768).map(move |k| (n, k))) {
                let f = k as f32 / 65_536.0;
                let u = n as f32 + f;
                let is_right = || f64::from(exp2(u)) == f64::from(exp2(f)) * 2_f64.powi(n);
                if (-126.0..=1.0).contains(&u) && f.abs() < 0.5 && !is_right() {
                    return bad(u);
                }
            }
            return Ok(0.0);
        }
        let sign = if case.is_multiple_of(2) { 1.0 } else { -1.0 };
        let first = FRACTIONS[0] + (case / 2 - 1) as u32 * FRACTIONS_AT_ONCE;
        let (mut worst, mut before) = (0.0_f64, 1.0);
        for bits in first..=first + FRACTIONS_AT_ONCE {
            let f = sign * f32::from_bits(bits);
            let y = exp2(f);
            let rise = f64::from(sign) * (f64::from(y) / f64::from(before) - 1.0);
            if bits > first && rise < -ULP {
                return bad(f);
            }
            worst = worst.max(error_ulp(f64::from(f).exp2(), y));
            before = y;
        }
        Ok(worst)
    }))
}

/// Error of `y` for `truth`, in units in the last place of the true value.
fn error_ulp(truth: f64, y: f32) -> f64 {
    let ulp = f64::from((truth as f32).next_up() - truth as f32);
    (f64::from(y) - truth).abs() / ulp
}
