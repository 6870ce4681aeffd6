//! Exponentials of several registers side by side.

use core::f32::consts::LOG2_E;

use pulp::Simd;

use super::floats::ABREAST;

/// Adding and subtracting 1.5·2^23 rounds to the nearest integer, which the sum's low bits then hold.
const ROUND: f32 = 12_582_912.0;

/// ((c₀·r + c₁)·r + …)
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

/// As `model_core::exp::exp2`.
#[inline(always)]
pub(super) fn exp2<S: Simd>(simd: S, values: &mut [S::f32s; ABREAST]) {
    const C: [f32; 6] = [0.001_317_25, 0.009_672_681, 0.055_510_68, 0.240_222_17, 0.693_146_7, 1.0];
    let round = simd.splat_f32s(ROUND);
    let (mut rounded, mut f) = (*values, *values);
    for (rounded, f) in rounded.iter_mut().zip(&mut f) {
        *rounded = simd.add_f32s(*rounded, round);
        *f = simd.sub_f32s(*f, simd.sub_f32s(*rounded, round));
    }
    let p = polynomial(simd, &f, &C);
    let places = simd.splat_u32s(23);
    for ((value, &p), &rounded) in values.iter_mut().zip(&p).zip(&rounded) {
        let power = simd.wrapping_dyn_shl_u32s(simd.transmute_u32s_f32s(rounded), places);
        *value = simd.transmute_f32s_u32s(simd.add_u32s(simd.transmute_u32s_f32s(p), power));
    }
}

/// As `model_core::exp::Polynomial`.
#[inline(always)]
pub(super) fn exp<S: Simd>(simd: S, values: &mut [S::f32s; ABREAST]) {
    const LN2_HI: f32 = 0.693_359_4;
    const LN2_LO: f32 = -2.121_944_4e-4;
    const C: [f32; 7] =
        [0.001_384_461, 0.008_374_151, 0.041_667_98, 0.166_664_32, 0.499_999_94, 1.0, 1.0];
    let round = simd.splat_f32s(ROUND);
    let (log2_e, high, low) =
        (simd.splat_f32s(LOG2_E), simd.splat_f32s(LN2_HI), simd.splat_f32s(LN2_LO));
    let (mut rounded, mut r) = (*values, *values);
    for (rounded, r) in rounded.iter_mut().zip(&mut r) {
        *rounded = simd.add_f32s(simd.mul_f32s(*rounded, log2_e), round);
        let n = simd.sub_f32s(*rounded, round);
        *r = simd.sub_f32s(*r, simd.mul_f32s(n, high));
        *r = simd.sub_f32s(*r, simd.mul_f32s(n, low));
    }
    let p = polynomial(simd, &r, &C);
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
