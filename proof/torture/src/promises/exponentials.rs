//! Every exponential, over all numbers that it is for, and over all others.

use model_core::exp::{ExpKernel, Libm, Micromath, Polynomial, exp2};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tools::Tools;

pub const POLYNOMIAL: Promise = Promise {
    name: "exp-polynomial",
    text: "e^x within 2 ulp from -87 to 0, 0 below, no subnormal",
    share: 1,
    check: polynomial,
};

pub const LIBM: Promise = Promise {
    name: "exp-libm",
    text: "e^x within 1 ulp from -87 to 0, tiny below",
    share: 1,
    check: libm,
};

pub const MICROMATH: Promise = Promise {
    name: "exp-micromath",
    text: "e^x within 0.24 % from -80 to 0, 0 below",
    share: 1,
    check: micromath,
};

pub const EXP2: Promise = Promise {
    name: "exp-exp2",
    text: "2^x within 2 ulp from -126 to 1",
    share: 1,
    check: base_two,
};

pub const MONOTONE: Promise = Promise {
    name: "exp-monotone",
    text: "a larger x gives no smaller e^x, but for rounding",
    share: 1,
    check: monotone,
};

pub const ANY_NUMBER: Promise = Promise {
    name: "exp-any-number",
    text: "no f32 makes e^x panic; up to 0 none gives NaN",
    share: 1,
    check: any_number,
};

/// Consecutive f32 that one case tests.
const BLOCK: u32 = 1 << 16;
/// Number of blocks that hold all f32.
const ALL: u64 = 1 << 16;
/// One of so many blocks is tested at least.
const FEW: u64 = 64;
/// One of so many, where every number takes several exponentials.
const FEWER: u64 = 256;

/// Bits of −0.0, and of the first NaN behind −∞.
const NEGATIVE: [u32; 2] = [0x8000_0000, 0xFF80_0001];
/// Bits of 0, and of the next number after 1.
const UP_TO_ONE: [u32; 2] = [0, 0x3F80_0001];

fn polynomial(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let slip = if effort.is_planted() { 1.000_001 } else { 1.0 };
    Ok(sweep(effort, FEW, (2.0, "ulp"), &[NEGATIVE], |x| {
        let y = Polynomial::exp(x) * slip;
        if x < -87.0 {
            return require(y == 0.0, x, y);
        }
        require(y.is_normal(), x, y)?;
        Ok(error_ulp(f64::from(x).exp(), y))
    }))
}

fn libm(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let slip = if effort.is_planted() { 1.000_000_3 } else { 1.0 };
    Ok(sweep(effort, FEW, (1.0, "ulp"), &[NEGATIVE], |x| {
        let y = Libm::exp(x) * slip;
        if x < -87.0 {
            return require((0.0..1.7e-38).contains(&y), x, y);
        }
        Ok(error_ulp(f64::from(x).exp(), y))
    }))
}

fn micromath(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let slip = if effort.is_planted() { 1.0 / 128.0 } else { 0.0 };
    Ok(sweep(effort, FEW, (0.24, "%"), &[NEGATIVE], |x| {
        // Planted: the argument loses its last bits.
        let y = Micromath::exp(x + slip);
        if x < -80.0 {
            return require(y == 0.0 || slip > 0.0, x, y);
        }
        Ok(100.0 * (f64::from(y) / f64::from(x).exp() - 1.0).abs())
    }))
}

fn base_two(effort: &Effort, _: &Tools) -> Result<Found, String> {
    // Planted: a wrong bit in the result.
    let wrong = if effort.is_planted() { 4 } else { 0 };
    Ok(sweep(
        effort,
        FEW,
        (2.0, "ulp"),
        &[[NEGATIVE[0], (-126.0_f32).to_bits() + 1], UP_TO_ONE],
        |x| Ok(error_ulp(f64::from(x).exp2(), f32::from_bits(exp2(x).to_bits() ^ wrong))),
    ))
}

/// Steps against monotony, as shares of what each exponential may make.
fn monotone(effort: &Effort, _: &Tools) -> Result<Found, String> {
    const ULP: f64 = f32::EPSILON as f64;
    let planted = effort.is_planted();
    Ok(sweep(effort, FEWER, (1.0, "bounds"), &[NEGATIVE], |x| {
        let next = x.next_down();
        // Planted: a table with one bad entry.
        let polynomial = |x: f32| {
            let bad = planted && x.to_bits().trailing_zeros() >= 12 && x > -80.0;
            Polynomial::exp(x) * if bad { 0.999 } else { 1.0 }
        };
        let rise = |exp: fn(f32) -> f32| {
            let (here, below) = (f64::from(exp(x)), f64::from(exp(next)));
            if here > 0.0 { below / here - 1.0 } else { below }
        };
        let of_polynomial = match f64::from(polynomial(x)) {
            0.0 => f64::from(polynomial(next)),
            here => f64::from(polynomial(next)) / here - 1.0,
        };
        let of_two = if next >= -126.0 { rise(exp2) / ULP } else { 0.0 };
        let worst = (of_polynomial / ULP).max(of_two).max(rise(Micromath::exp) / 3e-5);
        let of_libm = rise(Libm::exp);
        // Subnormal numbers are an ulp of theirs apart.
        require(of_libm <= 0.0, x, Libm::exp(x))?;
        Ok(worst.max(0.0))
    }))
}

fn any_number(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let planted = effort.is_planted();
    Ok(sweep(effort, FEWER, (0.0, "faults"), &[[0, u32::MAX]], |x| {
        // Planted: a product that is 0·∞ for large numbers.
        let polynomial = Polynomial::exp(x) + if planted { x * x * 0.0 } else { 0.0 };
        // micromath asserts, in debug builds, that its argument is no larger than it is for.
        let results = [polynomial, Libm::exp(x), Micromath::exp(x.min(0.0))];
        std::hint::black_box(exp2(x));
        if x <= 0.0 {
            let bad = results.into_iter().find(|y| !(0.0..=1.0).contains(y));
            require(bad.is_none(), x, bad.unwrap_or(0.0))?;
        }
        Ok(0.0)
    }))
}

/// Tests all numbers whose bits are in `ranges`, block after block; at least one block of so many.
fn sweep(
    effort: &Effort,
    one_in: u64,
    bound: (f64, &'static str),
    ranges: &[[u32; 2]],
    test: impl Fn(f32) -> Result<f64, String> + Sync,
) -> Found {
    let is_tested = |bits: u32| ranges.iter().any(|[first, end]| (*first..*end).contains(&bits));
    effort.worst((ALL / one_in, ALL), bound, |seed| {
        // An odd step visits every block once.
        let first = (seed.wrapping_mul(20_011) % ALL) as u32 * BLOCK;
        let bits = (first..=first + (BLOCK - 1)).filter(|bits| is_tested(*bits));
        bits.map(f32::from_bits).try_fold(0.0, |worst: f64, x| Ok(worst.max(test(x)?)))
    })
}

fn require(holds: bool, x: f32, y: f32) -> Result<f64, String> {
    if holds { Ok(0.0) } else { Err(format!("at {x:e} the result is {y:e}")) }
}

/// Error of `y` for `truth`, in units in the last place of the true value.
fn error_ulp(truth: f64, y: f32) -> f64 {
    let ulp = f64::from((truth as f32).next_up() - truth as f32);
    (f64::from(y) - truth).abs() / ulp
}
