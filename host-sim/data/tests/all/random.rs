//! Random draws: their bits, and their distribution.

use taxel_data::{Purpose, Random, Stream};

#[test]
fn draws_are_fixed_for_all_time() {
    let mut random = Random::new(1, Stream::Training, Purpose::Noise, 2, 3);
    let drawn: Vec<u64> = (0..2).map(|_| random.unit().to_bits()).collect();
    assert_eq!(drawn, [0x3fea_aca6_aa3b_c8ab, 0x3fee_ddef_39ea_72b4]);
    assert_eq!(random.normal().to_bits(), 0xbff6_6d30_0488_dda6);
    let mut other = Random::new(1, Stream::Training, Purpose::Noise, 3, 2);
    assert_ne!(drawn[0], other.unit().to_bits());
}

#[test]
fn whole_numbers_below_an_end_are_all_drawn_equally_often() {
    let mut random = Random::new(1, Stream::Test, Purpose::Noise, 0, 0);
    let mut counts = [0_i32; 5];
    (0..50_000).for_each(|_| counts[random.below(5)] += 1);
    // Six standard deviations.
    assert!(counts.iter().all(|count| (count - 10_000).abs() < 540), "{counts:?}");
    assert_eq!((random.below(1), random.below(0)), (0, 0));
}

#[test]
fn normal_draws_have_the_moments_of_a_normal() {
    let n = 400_000;
    let mut moments = [0.0; 4];
    let mut random = Random::new(5, Stream::Test, Purpose::Noise, 0, 0);
    for _ in 0..n {
        let x = random.normal();
        for (power, moment) in (1..).zip(&mut moments) {
            *moment += x.powi(power) / f64::from(n);
        }
    }
    // Five standard errors of each sample moment.
    let root = f64::from(n).sqrt();
    for (moment, (expected, variance)) in
        moments.iter().zip([(0.0, 1.0_f64), (1.0, 2.0), (0.0, 15.0), (3.0, 96.0)])
    {
        assert!((moment - expected).abs() < 5.0 * variance.sqrt() / root, "{moments:?}");
    }
}
