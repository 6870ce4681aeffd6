//! Every exponential, over all numbers that it is for.

use model_core::exp::{ExpKernel, Polynomial};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tools::Tools;

pub const POLYNOMIAL: Promise = Promise {
    name: "exp-polynomial",
    text: "e^x within 2 ulp from -87 to 0, and 0 below",
    share: 1,
    check: polynomial,
};

/// Consecutive f32 that one case tests.
const BLOCK: u32 = 1 << 16;

/// First of the bits of −0.0 to −∞, and the blocks that hold them all.
const FIRST: u32 = 0x8000_0000;
const BLOCKS: u64 = ((0xFF80_0000_u32 - FIRST) / BLOCK) as u64 + 1;

fn polynomial(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let slip = |x: f32| {
        if effort.is_planted() { Polynomial::exp(x) * 1.000_001 } else { Polynomial::exp(x) }
    };
    Ok(effort.worst((BLOCKS / 64, BLOCKS), (2.0, "ulp"), |seed| {
        // An odd step visits every block once.
        let block = (seed.wrapping_mul(20_011) % BLOCKS) as u32;
        (0..BLOCK).filter_map(|offset| number(block, offset)).try_fold(0.0, |worst: f64, x| {
            let y = slip(x);
            if x < -87.0 {
                return if y == 0.0 { Ok(worst) } else { Err(format!("exp({x:e}) is {y:e}")) };
            }
            Ok(worst.max(error_ulp(x, y)))
        })
    }))
}

/// The number at `offset` of a block, if it is none behind −∞.
fn number(block: u32, offset: u32) -> Option<f32> {
    let x = f32::from_bits(FIRST + block * BLOCK + offset);
    (!x.is_nan()).then_some(x)
}

/// Error of `y` for e^`x`, in units in the last place of the true value.
fn error_ulp(x: f32, y: f32) -> f64 {
    let truth = f64::from(x).exp();
    let ulp = f64::from((truth as f32).next_up() - truth as f32);
    (f64::from(y) - truth).abs() / ulp
}
