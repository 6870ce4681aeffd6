//! Exponents of Gaussians from inputs, in either form of single precision.

use model_core::scale::{CLAMP, UNITS};
use pulp::Simd;

use super::exp::{exp, exp2};
use super::lines::{ABREAST, Lanes, VECTORS};
use super::tiles::{Accumulate, CENTRES, accumulate};

/// Form of exponents: expanded or direct.
pub(super) trait Exponent {
    /// Clamps a scaled input.
    fn clamp(&self, scaled: f32) -> f32;
    /// Start of the second partial sum, which the centres share.
    fn open<S: Simd>(&self, simd: S, x: &[Lanes<S>]) -> Lanes<S>;
    /// Exponents of the centres of a `tile`.
    fn exponents<S: Simd>(
        &self,
        simd: S,
        opened: &Lanes<S>,
        tile: &[[f32; CENTRES]],
        x: &[Lanes<S>],
    ) -> [Lanes<S>; CENTRES];

    /// Turns exponents into activations.
    fn powers<S: Simd>(simd: S, exponents: &mut [S::f32s; ABREAST]);
}

/// Four partial sums of each centre, from their starts, added in pairs.
#[inline(always)]
fn four_sums<S: Simd, const SQUARES: bool>(
    terms: Terms<S, SQUARES>,
    starts: [[Lanes<S>; CENTRES]; 4],
    tile: &[[f32; CENTRES]],
    x: &[Lanes<S>],
) -> [Lanes<S>; CENTRES] {
    let Terms(simd) = terms;
    let [mut first, mut second, mut third, mut fourth] = starts;
    let (x_first, x_rest) = x.split_at(x.len().div_ceil(4));
    let (x_second, x_rest) = x_rest.split_at((x.len() + 2) / 4);
    let (x_third, x_fourth) = x_rest.split_at((x.len() + 1) / 4);
    let (tile_first, rest) = tile.split_at(x_first.len());
    let (tile_second, rest) = rest.split_at(x_second.len());
    let (tile_third, tile_fourth) = rest.split_at(x_third.len());
    accumulate(terms, x_first, tile_first, &mut first);
    accumulate(terms, x_second, tile_second, &mut second);
    add(simd, &mut first, &second);
    accumulate(terms, x_third, tile_third, &mut third);
    accumulate(terms, x_fourth, tile_fourth, &mut fourth);
    add(simd, &mut third, &fourth);
    add(simd, &mut first, &third);
    first
}

#[inline(always)]
fn add<S: Simd>(simd: S, to: &mut [Lanes<S>; CENTRES], what: &[Lanes<S>; CENTRES]) {
    for (to, what) in to.iter_mut().zip(what) {
        for (to, &what) in to.iter_mut().zip(what) {
            *to = simd.add_f32s(*to, what);
        }
    }
}

/// Accumulation of products, or of squares of differences, not contracted: the device does not either.
#[derive(Clone, Copy)]
pub(super) struct Terms<S, const SQUARES: bool>(pub S);

impl<S: Simd, const SQUARES: bool> Accumulate for Terms<S, SQUARES> {
    type Shared = f32;
    type Register = S::f32s;

    #[inline(always)]
    fn splat(self, shared: f32) -> S::f32s {
        self.0.splat_f32s(shared)
    }

    #[inline(always)]
    fn accumulate(self, sum: S::f32s, factor: S::f32s, shared: S::f32s) -> S::f32s {
        let term = if SQUARES {
            let difference = self.0.sub_f32s(factor, shared);
            self.0.mul_f32s(difference, difference)
        } else {
            self.0.mul_f32s(factor, shared)
        };
        self.0.add_f32s(sum, term)
    }
}

/// Expanded distances, as in `model_core::rbf::expanded`.
pub(super) struct Expanded {
    pub decay: f32,
}

impl Exponent for Expanded {
    /// Clamps like `model_core::scale::clamp_units` (tested), without integers.
    #[inline(always)]
    fn clamp(&self, scaled: f32) -> f32 {
        let number = if scaled.is_nan() { 0.0 } else { scaled };
        let above = if number > -UNITS { number } else { -UNITS };
        let inside = if above < UNITS { above } else { UNITS };
        inside.trunc() + 0.0 // −0 becomes 0
    }

    #[inline(always)]
    fn open<S: Simd>(&self, simd: S, x: &[Lanes<S>]) -> Lanes<S> {
        let zero = [simd.splat_f32s(0.0); VECTORS];
        let mut sums = [zero; 4];
        let mut rest = x;
        for (number, sums) in sums.iter_mut().enumerate() {
            let (now, later) = rest.split_at((x.len() + 3 - number) / 4);
            rest = later;
            for x in now {
                for (sum, &x) in sums.iter_mut().zip(x) {
                    *sum = simd.add_f32s(*sum, simd.mul_f32s(x, x));
                }
            }
        }
        let decay = simd.splat_f32s(self.decay);
        let mut opened = zero;
        for (v, opened) in opened.iter_mut().enumerate() {
            let first = simd.add_f32s(sums[0][v], sums[1][v]);
            let square = simd.add_f32s(first, simd.add_f32s(sums[2][v], sums[3][v]));
            *opened = simd.neg_f32s(simd.mul_f32s(decay, square));
        }
        opened
    }

    #[inline(always)]
    fn exponents<S: Simd>(
        &self,
        simd: S,
        opened: &Lanes<S>,
        tile: &[[f32; CENTRES]],
        x: &[Lanes<S>],
    ) -> [Lanes<S>; CENTRES] {
        let zero = [simd.splat_f32s(0.0); VECTORS];
        let mut heads = [zero; CENTRES];
        for (place, &head) in heads.iter_mut().zip(&tile[0]) {
            *place = [simd.splat_f32s(head); VECTORS];
        }
        let starts = [heads, [*opened; CENTRES], [zero; CENTRES], [zero; CENTRES]];
        four_sums(Terms::<S, false>(simd), starts, &tile[1..], x)
    }

    #[inline(always)]
    fn powers<S: Simd>(simd: S, exponents: &mut [S::f32s; ABREAST]) {
        exp2(simd, exponents);
    }
}

/// Direct distances, as in `model_core::rbf::direct`.
pub(super) struct Direct;

impl Exponent for Direct {
    #[inline(always)]
    fn clamp(&self, scaled: f32) -> f32 {
        scaled.clamp(CLAMP[0], CLAMP[1])
    }

    #[inline(always)]
    fn open<S: Simd>(&self, simd: S, _: &[Lanes<S>]) -> Lanes<S> {
        [simd.splat_f32s(0.0); VECTORS]
    }

    #[inline(always)]
    fn exponents<S: Simd>(
        &self,
        simd: S,
        opened: &Lanes<S>,
        tile: &[[f32; CENTRES]],
        x: &[Lanes<S>],
    ) -> [Lanes<S>; CENTRES] {
        let mut values = four_sums(Terms::<S, true>(simd), [[*opened; CENTRES]; 4], &tile[1..], x);
        for (values, &decay) in values.iter_mut().zip(&tile[0]) {
            let decay = simd.splat_f32s(decay);
            for value in values {
                *value = simd.mul_f32s(decay, *value);
            }
        }
        values
    }

    #[inline(always)]
    fn powers<S: Simd>(simd: S, exponents: &mut [S::f32s; ABREAST]) {
        exp(simd, exponents);
    }
}
