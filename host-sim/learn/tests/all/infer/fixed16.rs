//! Scaling of readings to 16 bits on lines side by side.

use taxel_core::rbf::{Shape, fixed16};
use taxel_core::scale::{UNITS, UNITS_PER_STEP, clamp_steps};
use taxel_learn::infer::infer;

/// Steps that `readings` of one input are scaled to: outputs of a network that tells these.
fn steps(midpoint: f32, per_unit: f32, readings: &[f64]) -> Vec<f64> {
    let shape = Shape { inputs: 1, centres: fixed16::CENTRES_AT_ONCE, outputs: 1 };
    // Centres in the middle, and weights of 0.
    let mut centres = [[fixed16::EXPONENT_MARGIN, 0]; fixed16::CENTRES_AT_ONCE].concat();
    centres.resize(fixed16::words_at_once(shape), 0);
    let parameters = fixed16::Parameters {
        input_midpoint: &[midpoint],
        input_per_unit: &[per_unit],
        decay: 1,
        bias: &[0],
        output_scale: &[1.0],
        affine: &[1],
        centres: &centres,
    };
    let words: Vec<u32> = parameters.words().collect();
    infer(&fixed16::Network::try_new(shape, true, &words).unwrap().into(), readings)
}

#[test]
fn steps_are_those_of_the_device_for_numbers_of_all_kinds() {
    let bits = (0..u32::MAX).step_by(4099).map(f32::from_bits);
    let near = (-40_000..40_000).flat_map(|step| {
        let whole = step as f32 * UNITS_PER_STEP;
        [whole.next_down(), whole, whole.next_up()]
    });
    let scaled = bits.chain(near).chain([UNITS, -UNITS, -0.5, 0.5, -1.0]);
    let scaled: Vec<f32> = scaled.filter(|scaled| scaled.is_finite()).collect();
    let found = steps(0.0, 1.0, &scaled.iter().copied().map(f64::from).collect::<Vec<_>>());
    for (scaled, found) in scaled.into_iter().zip(found) {
        assert_eq!(found, f64::from(clamp_steps(scaled)), "{scaled:e}");
    }
    // Readings that f32 holds, scaled beyond it.
    let ends = [f32::INFINITY, f32::NEG_INFINITY].map(|it| f64::from(clamp_steps(it)));
    assert_eq!(steps(0.0, 1e9, &[3e38, -3e38]), ends);
    assert_eq!(steps(-3e38, 0.0, &[3e38]), [f64::from(clamp_steps(f32::NAN))]);
}
