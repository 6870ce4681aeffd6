//! Exponentials of several registers side by side.

use core::f32::consts::LOG2_E;

use model_core::exp::{EXP_COEFFICIENTS, EXP2_COEFFICIENTS, LN_2_PARTS, ROUND};
use pulp::Simd;

use super::lines::ABREAST;

/// Polynomial ((c₀·r + c₁)·r + …) of several registers.
#[inline(always)]
fn polynomial<S: Simd>(
    simd: S,
    r: &[S::f32s; ABREAST],
    coefficients: &[f32],
) -> [S::f32s; ABREAST] {
    let mut p = [simd.splat_f32s(coefficients[0]); ABREAST];
    for &c in &coefficients[1..] {
        let c = simd.splat_f32s(c);
        for (p, &r) in p.iter_mut().zip(r) {
            *p = simd.add_f32s(simd.mul_f32s(*p, r), c);
        }
    }
    p
}

/// Powers 2^x, bit for bit `model_core::exp::exp2`.
#[inline(always)]
pub(super) fn exp2<S: Simd>(simd: S, values: &mut [S::f32s; ABREAST]) {
    let round = simd.splat_f32s(ROUND);
    let (mut rounded, mut f) = (*values, *values);
    for (rounded, f) in rounded.iter_mut().zip(&mut f) {
        *rounded = simd.add_f32s(*rounded, round);
        *f = simd.sub_f32s(*f, simd.sub_f32s(*rounded, round));
    }
    let p = polynomial(simd, &f, &EXP2_COEFFICIENTS);
    let places = simd.splat_u32s(23);
    for ((value, &p), &rounded) in values.iter_mut().zip(&p).zip(&rounded) {
        let power = simd.wrapping_dyn_shl_u32s(simd.transmute_u32s_f32s(rounded), places);
        *value = simd.transmute_f32s_u32s(simd.add_u32s(simd.transmute_u32s_f32s(p), power));
    }
}

/// Exponentials e^x, bit for bit `model_core::exp::Polynomial`.
#[inline(always)]
pub(super) fn exp<S: Simd>(simd: S, values: &mut [S::f32s; ABREAST]) {
    let (round, log2_e) = (simd.splat_f32s(ROUND), simd.splat_f32s(LOG2_E));
    let [high, low] = LN_2_PARTS.map(|part| simd.splat_f32s(part));
    let (mut rounded, mut r) = (*values, *values);
    for (rounded, r) in rounded.iter_mut().zip(&mut r) {
        *rounded = simd.add_f32s(simd.mul_f32s(*rounded, log2_e), round);
        let n = simd.sub_f32s(*rounded, round);
        *r = simd.sub_f32s(*r, simd.mul_f32s(n, high));
        *r = simd.sub_f32s(*r, simd.mul_f32s(n, low));
    }
    let p = polynomial(simd, &r, &EXP_COEFFICIENTS);
    let (bias, places) = (simd.splat_u32s(127), simd.splat_u32s(23));
    let (least, zero) = (simd.splat_f32s(-87.0), simd.splat_f32s(0.0));
    for ((value, &p), &rounded) in values.iter_mut().zip(&p).zip(&rounded) {
        // The low bits of `rounded` hold n.
        let exponent = simd.add_u32s(simd.transmute_u32s_f32s(rounded), bias);
        let power = simd.wrapping_dyn_shl_u32s(exponent, places);
        let power = simd.mul_f32s(p, simd.transmute_f32s_u32s(power));
        *value = simd.select_f32s(simd.less_than_f32s(*value, least), zero, power);
    }
}
