//! Elementary functions against those of libm.

use taxel_data::{Purpose, Random, Stream, exp, ln, normal_share_below, sin_cos};

/// A million uniform numbers on [0, 1).
fn units() -> impl Iterator<Item = f64> {
    let mut random = Random::new(7, Stream::Test, Purpose::Damage, 0, 0);
    (0..1_000_000).map(move |_| random.unit())
}

/// Numbers around one, bit by bit.
fn around(x: f64) -> impl Iterator<Item = f64> {
    (0..200_u64).map(move |i| f64::from_bits(x.to_bits() - 100 + i))
}

/// Whether `found` is `expected` or next to it; libm's own error is below 1 ulp.
fn is_close(found: f64, expected: f64) -> bool {
    (found.to_bits().cast_signed() - expected.to_bits().cast_signed()).abs() <= 1
}

#[test]
fn logarithms_are_within_an_ulp() {
    let fine = (0..=53).map(|power| 2.0_f64.powi(-power));
    let edges = [1.0, std::f64::consts::FRAC_1_SQRT_2].into_iter().flat_map(around);
    for x in units().map(|u| 1.0 - u).chain(fine).chain(edges) {
        assert!(is_close(ln(x), libm::log(x)), "ln {x:e}");
    }
}

#[test]
fn sines_and_cosines_are_within_their_bound_everywhere() {
    use std::f64::consts::{FRAC_PI_4, TAU};
    let small = (20..60).map(|power| 2.0_f64.powi(-power));
    // Where the number of quarter turns changes, by its bits and by value, and the axes themselves.
    let upper = [0x3fe9_21fb_u64, 0x4002_d97c, 0x400f_6a7a, 0x4015_fdbc];
    let edges = upper.into_iter().flat_map(|upper| around(f64::from_bits((upper + 1) << 32)));
    let eighths = (1..8).map(f64::from).flat_map(|n| around(n * FRAC_PI_4));
    let turns = units().chain(small).map(|turn| TAU * turn);
    for angle in turns.chain(edges).chain(eighths).chain([0.0]) {
        let (s, c) = sin_cos(angle);
        assert!((s - libm::sin(angle)).abs() <= 1.2e-16, "sin {angle:e}");
        assert!((c - libm::cos(angle)).abs() <= 1.2e-16, "cos {angle:e}");
    }
}

#[test]
fn exponentials_are_those_of_libm_and_end_at_zero() {
    let small = (0..60).map(|power| -(2.0_f64.powi(-power)));
    let edges = [0x3e30_0000_u64, 0x3fd6_2e42, 0x3ff0_a2b1, 0x3ff0_a2b2];
    let edges = edges.into_iter().flat_map(|u| around(f64::from_bits((u + 1) << 32)));
    let edges = edges.map(|x| -x);
    let drawn = units().map(|u| -3.0 * u).chain(units().map(|u| -708.0 * u * u));
    for x in drawn.chain(small).chain(edges).chain([0.0, -0.0, -708.0]) {
        assert_eq!(exp(x).to_bits(), libm::exp(x).to_bits(), "exp {x:e}");
    }
    for x in [-708.000_001, -745.0, -1e300, f64::NEG_INFINITY] {
        assert_eq!(exp(x), 0.0);
    }
}

#[test]
fn shares_of_the_normal_distribution_are_within_their_bound() {
    for x in units().map(|u| 14.0 * u - 7.0).chain([0.0, -7.0, 7.0]) {
        let expected = 0.5 * libm::erfc(-x / std::f64::consts::SQRT_2);
        let found = normal_share_below(x);
        assert!((found - expected).abs() <= 1e-15, "{x}: {found} {expected}");
    }
    assert_eq!(normal_share_below(40.0), normal_share_below(7.0));
}
