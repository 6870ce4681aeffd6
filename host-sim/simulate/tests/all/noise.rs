//! What averaging leaves of noise.

use taxel_simulate::noise::{Noise, NoiseKind};

#[test]
fn averaging_reduces_white_noise_more_than_correlated_noise() {
    let noise = Noise {
        correlated_level: 0.03,
        time_constant_ms: 20.0,
        ..Noise::white(NoiseKind::Relative, 0.04)
    };
    assert!((noise.total_level() - 0.05).abs() < 1e-15);
    assert_eq!(noise.averaged(1, 0.001), noise);
    let close = noise.averaged(16, 36e-6);
    assert_eq!(close.level, 0.01);
    // Samples within 0.6 ms share their noise: its variance falls by a third of their span over τ.
    let expected = 0.03 * (1.0 - 15.0 * 36e-6 / 0.02 / 3.0_f64).sqrt();
    assert!((close.correlated_level / expected - 1.0).abs() < 1e-3, "{close:?}");
    let apart = noise.averaged(16, 1.0);
    assert!((apart.correlated_level - 0.03 / 4.0).abs() < 1e-9, "{apart:?}");
    assert_eq!(Noise::white(NoiseKind::Span, 0.1).averaged(4, 1.0).total_level(), 0.05);
}
