use super::*;

const SIZES: Sizes = Sizes { readings: 3, directions: 1, components: 2, outputs: 2 };

/// Two components along the sum of the first two readings; the third reading is left out.
fn block() -> Vec<f32> {
    let half = 0.5_f32.sqrt();
    [
        &[10.0, 20.0, 30.0][..],           // mean
        &[1.0, 0.5, 2.0],                  // scale
        &[0.0],                            // start of the projection
        &[half, half, 0.0],                // direction
        &[-1.0, 2.0, 1.0, 1.0, 0.25, 2.0], // c, o and W of the first component
        &[-2.0, -1.0, 1.0, 0.5, 0.0, 2.0], // of the second
        &[0.04, 1.0],                      // variances of the first component
        &[0.16, 9.0],                      // variances of the second
        &[1.9, 2.1],                       // ratios
        &[5.0],                            // threshold
    ]
    .concat()
}

fn assess(readings: [f32; 3]) -> (f32, [f32; 2]) {
    let block = block();
    let confidence = Confidence::new(SIZES, &block).unwrap();
    let (mut scratch, mut deviation) = ([0.0; 7], [0.0; 2]);
    let novelty = confidence.assess(readings.into_iter(), &mut scratch, &mut deviation).unwrap();
    (novelty, deviation)
}

/// The same in f64, from the definition.
fn expected(readings: [f64; 3]) -> (f64, [f64; 2]) {
    let z = [readings[0] - 10.0, 0.5 * (readings[1] - 20.0), 2.0 * (readings[2] - 30.0)];
    let along = (z[0] + z[1]) * 0.5_f64.sqrt();
    let left = (z.iter().map(|z| z * z).sum::<f64>() - along * along).max(0.0).sqrt();
    let first = -1.0 - 0.5 * ((along - 2.0).powi(2) + (0.25 * along + 2.0 * left - 1.0).powi(2));
    let second = -2.0 - 0.5 * ((0.5 * along + 1.0).powi(2) + (2.0 * left - 1.0).powi(2));
    let (a, b) = (first.exp(), second.exp());
    let of = |u: f64, v: f64| ((a * u + b * v) / (a + b)).sqrt();
    (-(a + b).ln() - 5.0, [of(0.04, 0.16), of(1.0, 9.0)])
}

#[test]
fn novelty_and_deviations_are_those_of_the_mixture() {
    for readings in [[12.0, 21.0, 30.2], [8.0, 17.0, 29.5], [10.0, 20.0, 30.0], [11.0, 19.0, 33.0]]
    {
        let (novelty, deviation) = assess(readings);
        let (of_novelty, of_deviation) = expected(readings.map(f64::from));
        assert!((f64::from(novelty) - of_novelty).abs() < 1e-4, "{novelty} {of_novelty}");
        for (found, of) in deviation.into_iter().zip(of_deviation) {
            assert!((f64::from(found) / of - 1.0).abs() < 1e-5, "{found} {of}");
        }
    }
}

#[test]
fn far_away_frames_are_novel_and_missing_readings_have_no_novelty() {
    let (near, _) = assess([12.0, 21.0, 30.2]);
    let (far, deviation) = assess([112.0, 21.0, 30.2]);
    assert!(near < 0.0 && far > 100.0 && deviation.iter().all(|d| d.is_finite()));
    for beyond in [1e30, f32::INFINITY, f32::MAX] {
        let (novelty, deviation) = assess([beyond, 21.0, 30.2]);
        assert!(novelty == f32::MAX && deviation.iter().all(|d| d.is_nan()), "{novelty}");
    }
    let (novelty, deviation) = assess([12.0, f32::NAN, 30.2]);
    assert!(novelty.is_nan() && deviation.iter().all(|d| d.is_nan()));
}

#[test]
fn a_density_that_is_no_number_is_not_passed_over() {
    let mut block = block();
    // The first component's last row: ∞ − ∞ for a frame far off both ways, which the second still tells.
    let row = block.iter().position(|value| *value == 0.25).unwrap();
    block[row..row + 2].copy_from_slice(&[-3e38, 3e38]);
    let confidence = Confidence::new(SIZES, &block).unwrap();
    let (mut scratch, mut deviation) = ([0.0; 7], [0.0; 2]);
    let readings = [1e6, 20.0, 1e6].into_iter();
    let novelty = confidence.assess(readings, &mut scratch, &mut deviation).unwrap();
    assert!(novelty == f32::MAX && deviation.iter().all(|it| it.is_nan()), "{novelty}");
}

#[test]
fn the_most_probable_components_count() {
    // Six equal components, of which the last is a little less probable than four of them.
    let variances = [1.0, 2.0, 3.0, 4.0, 100.0, 200.0];
    let mut deviation = [0.0];
    deviations(&[1.0, 1.0, 1.0, 1.0, 0.6, 1e-9], &variances, &mut deviation);
    assert!((deviation[0] - 2.5_f32.sqrt()).abs() < 1e-6, "{}", deviation[0]);
    deviations(&[1e-9, 0.6, 1.0, 1.0, 1.0, 1.0], &variances, &mut deviation);
    assert!((deviation[0] - (307.0_f32 / 4.0).sqrt()).abs() < 1e-5, "{}", deviation[0]);
    // Fewer components than may count, and one alone that does.
    deviations(&[0.5, 1.0], &variances[..2], &mut deviation);
    assert!((deviation[0] - (2.5_f32 / 1.5).sqrt()).abs() < 1e-6, "{}", deviation[0]);
    deviations(&[0.0, 0.0, 1.0, 0.0], &variances, &mut deviation);
    assert!((deviation[0] - 3_f32.sqrt()).abs() < 1e-6, "{}", deviation[0]);
}

#[test]
fn what_cannot_be_a_confidence_is_refused() {
    let what = "confidence";
    let good = block();
    assert_eq!(Confidence::new(SIZES, &good).unwrap().ratios_95(), [1.9, 2.1]);
    let length = |found| NetworkError::Length { what, expected: good.len(), found };
    let short = &good[1..];
    assert_eq!(Confidence::new(SIZES, short), Err(length(short.len())));
    let empty = Sizes { components: 0, ..SIZES };
    assert_eq!(Confidence::new(empty, &good), Err(NetworkError::Empty));
    let changed = |place: usize, value: f32| {
        let mut block = good.clone();
        block[place] = value;
        Confidence::new(SIZES, &block).map(|_| ()).unwrap_err()
    };
    for place in 0..good.len() {
        assert_eq!(changed(place, f32::NAN), NetworkError::NotFinite { what }, "{place}");
    }
    // Scale, the diagonals of both triangles, variances and ratios.
    for place in [3, 13, 15, 19, 21, 22, 25, 26, 27] {
        assert_eq!(changed(place, -1.0), NetworkError::NotPositive { what }, "{place}");
    }
    assert_eq!(changed(15, 0.0), NetworkError::NotPositive { what });
}

#[test]
fn a_novelty_beyond_f32_stays_a_number_and_directions_are_at_most_readings() {
    let mut block = block();
    let last = block.len() - 1;
    (block[10], block[16], block[last]) = (-3e38, -3e38, -3e38);
    let confidence = Confidence::new(SIZES, &block).unwrap();
    let frame = [12.0, 21.0, 30.2].into_iter();
    let novelty = confidence.assess(frame, &mut [0.0; 7], &mut [0.0; 2]).unwrap();
    assert_eq!(novelty, f32::MAX);

    let sizes = Sizes { readings: 1, directions: 2, components: 1, outputs: 1 };
    let block = vec![1.0; sizes.block_floats()];
    let too_many = NetworkError::Length { what: "directions", expected: 1, found: 2 };
    assert_eq!(Confidence::new(sizes, &block), Err(too_many));
}

#[test]
fn slices_of_other_lengths_are_refused() {
    let block = block();
    let confidence = Confidence::new(SIZES, &block).unwrap();
    let frame = || [12.0, 21.0, 30.2].into_iter();
    let length = |what, expected, found| Err(NetworkError::Length { what, expected, found });
    let mut deviation = [7.0; 2];
    assert_eq!(confidence.assess(frame(), &mut [0.0; 6], &mut deviation), length("scratch", 7, 6));
    assert_eq!(deviation, [7.0; 2]);
    assert_eq!(
        confidence.assess(frame(), &mut [0.0; 7], &mut deviation[..1]),
        length("deviation", 2, 1)
    );
}
