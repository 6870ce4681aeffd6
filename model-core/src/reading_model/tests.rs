use std::vec::Vec;

use super::*;

const SIZES: Sizes = Sizes { readings: 3, factors: 1, components: 2, outputs: 2 };

/// Two components in a factor of the first two readings; the third reading is left out.
fn block() -> Vec<f32> {
    [
        &[10.0, 20.0, 30.0][..],                  // mean
        &[1.0, 0.5, 2.0],                         // scale
        &[0.0],                                   // start of the projection
        &[0.7, 0.7, 0.0],                         // parts
        &[-1.0, -2.0, -1.0, 1.0, 0.25, 0.0, 2.0], // c, −o and W of the first component
        &[-2.0, 1.0, -1.0, 0.5, 0.0, 0.125, 2.0], // of the second
        &[0.04, 1.0],                             // variances of the first component
        &[0.16, 9.0],                             // variances of the second
        &[1.9, 2.1],                              // ratios
        &[5.0],                                   // threshold
    ]
    .concat()
}

fn assess_by(block: &[f32], readings: [f32; 3]) -> (f32, [f32; 2]) {
    let model = ReadingModel::new(SIZES, block).unwrap();
    let (mut scratch, mut deviation) = ([0.0; 9], [0.0; 2]);
    let novelty = model.assess(&readings, None, &mut scratch, &mut deviation).unwrap();
    (novelty.unwrap(), deviation)
}

/// Novelty and deviations, in f64 from the definition.
fn expected(readings: [f64; 3]) -> (f64, [f64; 2]) {
    let z = [readings[0] - 10.0, 0.5 * (readings[1] - 20.0), 2.0 * (readings[2] - 30.0)];
    let score = (z[0] + z[1]) * 0.7;
    let distance = (z.iter().map(|z| z * z).sum::<f64>() - score * score).max(0.0).sqrt();
    let first =
        -1.0 - 0.5 * ((score - 2.0).powi(2) + (0.25 * score + 2.0 * distance - 1.0).powi(2));
    let second = -2.0
        - 0.5 * ((0.5 * score + 0.125 * distance + 1.0).powi(2) + (2.0 * distance - 1.0).powi(2));
    let (a, b) = (first.exp(), second.exp());
    let of = |u: f64, v: f64| ((a * u + b * v) / (a + b)).sqrt();
    (-(a + b).ln() - 5.0, [of(0.04, 0.16), of(1.0, 9.0)])
}

#[test]
fn novelty_and_deviations_are_those_of_the_mixture() {
    for readings in [[12.0, 21.0, 30.2], [10.5, 18.0, 29.8], [10.0, 20.0, 30.0], [11.0, 20.5, 30.3]]
    {
        let (novelty, deviation) = assess_by(&block(), readings);
        let (of_novelty, of_deviation) = expected(readings.map(f64::from));
        assert!((f64::from(novelty) - of_novelty).abs() < 1e-4, "{novelty} {of_novelty}");
        for (found, of) in deviation.into_iter().zip(of_deviation) {
            assert!((f64::from(found) / of - 1.0).abs() < 1e-5, "{found} {of}");
        }
    }
}

#[test]
fn distant_frames_are_novel_and_incomplete_ones_have_no_novelty() {
    let (near, _) = assess_by(&block(), [12.0, 21.0, 30.2]);
    let (far, deviation) = assess_by(&block(), [112.0, 21.0, 30.2]);
    assert!(near < 0.0 && far > 100.0 && deviation.iter().all(|d| d.is_finite()));
    for beyond in [1e30, f32::INFINITY, f32::MAX] {
        let (novelty, deviation) = assess_by(&block(), [beyond, 21.0, 30.2]);
        assert!(novelty == f32::MAX && deviation.iter().all(|d| d.is_nan()), "{novelty}");
    }
    let (novelty, deviation) = assess_by(&block(), [12.0, f32::NAN, 30.2]);
    assert!(novelty.is_nan() && deviation.iter().all(|d| d.is_nan()));
}

#[test]
fn a_density_that_is_no_number_is_not_passed_over() {
    let mut block = block();
    // W of the first component: ∞ − ∞ for a frame far off both ways, which the second still tells.
    let row = block.iter().position(|value| *value == 0.25).unwrap();
    (block[row], block[row + 2]) = (-3e38, 3e38);
    let (novelty, deviation) = assess_by(&block, [1e6, 20.0, 1e6]);
    assert!(novelty == f32::MAX && deviation.iter().all(|it| it.is_nan()), "{novelty}");
}

#[test]
fn a_novelty_beyond_f32_stays_a_number() {
    let mut block = block();
    let last = block.len() - 1;
    (block[10], block[17], block[last]) = (-3e38, -3e38, -3e38);
    assert_eq!(assess_by(&block, [12.0, 21.0, 30.2]).0, f32::MAX);
}

#[test]
fn the_probable_components_count() {
    let variances = [1.0, 2.0, 3.0, 400.0];
    let mut deviation = [0.0];
    deviations(&[1.0, 0.5, 0.5, 0.015], &variances, &mut deviation);
    assert!((deviation[0] - (3.5_f32 / 2.0).sqrt()).abs() < 1e-6, "{}", deviation[0]);
    deviations(&[0.0, 0.0, 1.0, 0.0], &variances, &mut deviation);
    assert!((deviation[0] - 3_f32.sqrt()).abs() < 1e-6, "{}", deviation[0]);
    deviations(&[0.0, 0.0, 1.0, LEAST_PROBABILITY], &variances, &mut deviation);
    assert!((deviation[0] - (9.25_f32 / 1.015_625).sqrt()).abs() < 1e-5, "{}", deviation[0]);
}

#[test]
fn what_cannot_be_a_reading_model_is_refused() {
    let what = "reading model";
    let good = block();
    let model = ReadingModel::new(SIZES, &good).unwrap();
    assert_eq!((model.ratios_95(), model.assesses()), (&[1.9, 2.1][..], true));
    let length = |found| NetworkError::Length { what, expected: good.len(), found };
    assert_eq!(ReadingModel::new(SIZES, &good[1..]), Err(length(good.len() - 1)));
    for sizes in [
        Sizes { readings: 0, ..SIZES },
        Sizes { factors: 0, ..SIZES },
        Sizes { outputs: 0, ..SIZES },
    ] {
        assert_eq!(ReadingModel::new(sizes, &good), Err(NetworkError::Empty));
    }
    let changed = |place: usize, value: f32| {
        let mut block = good.clone();
        block[place] = value;
        ReadingModel::new(SIZES, &block).map(|_| ())
    };
    for place in 0..good.len() {
        assert_eq!(changed(place, f32::NAN), Err(NetworkError::NotFinite { what }), "{place}");
    }
    // Two variances whose sum is beyond f32.
    assert_eq!(changed(24, 2e38), Err(NetworkError::NotFinite { what }));
    // Scale, variances and ratios.
    for place in [3, 5, 24, 27, 28, 29] {
        assert_eq!(changed(place, -1.0), Err(NetworkError::NotPositive { what }), "{place}");
        assert_eq!(changed(place, 0.0), Ok(()), "{place}");
    }
    assert_eq!(changed(9, 1.0), Err(NetworkError::NotPositive { what }));
}

#[test]
fn wrong_lengths_are_refused_and_no_components_give_no_novelty() {
    let block = block();
    let model = ReadingModel::new(SIZES, &block).unwrap();
    let frame = [12.0, 21.0, 30.2];
    let length = |what, expected, found| Err(NetworkError::Length { what, expected, found });
    let mut deviation = [7.0; 2];
    let mut assess = |frame: &[f32], scratch: usize, outputs: usize| {
        model.assess(frame, None, &mut [0.0; 9][..scratch], &mut deviation[..outputs])
    };
    assert_eq!(assess(&frame, 8, 2), length("scratch", 9, 8));
    assert_eq!(assess(&frame, 9, 1), length("deviation", 2, 1));
    assert_eq!(assess(&frame[1..], 9, 2), length("frame", 3, 2));
    assert_eq!(deviation, [7.0; 2]);
    let fills = ReadingModel::new(Sizes { components: 0, ..SIZES }, &block[..10]).unwrap();
    assert_eq!(fills.assess(&frame, None, &mut [0.0; 9], &mut deviation), Ok(None));
    assert_eq!((fills.assesses(), fills.ratios_95(), deviation), (false, &[][..], [7.0; 2]));
}

/// Numbers between −½ and ½, as a generator of one line draws them.
fn draws(seed: u32) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 24) - 0.5
    }
}

/// Loadings K (`readings × factors`) whose columns are orthogonal, and the block of the model of covariance I + K·Kᵀ.
fn fills(readings: usize, factors: usize, seed: u32) -> (Vec<Vec<f64>>, Vec<f32>) {
    let mut draw = draws(seed);
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for factor in 0..factors {
        let mut column: Vec<f64> = (0..readings).map(|_| draw()).collect();
        for other in &columns {
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let part = dot(&column, other) / dot(other, other);
            column.iter_mut().zip(other).for_each(|(c, o)| *c -= part * o);
        }
        let length = column.iter().map(|c| c * c).sum::<f64>().sqrt();
        // Variances from 1000 times the noise's down to 10 times.
        let wanted = 1000.0_f64.powf(1.0 - 0.66 * factor as f64 / factors as f64).sqrt();
        columns.push(column.iter().map(|c| c / length * wanted).collect());
    }
    let mut block: Vec<f32> = (0..readings).map(|i| 50.0 + i as f32).collect();
    block.extend((0..readings).map(|i| 2.0 + i as f32 * 0.1));
    block.extend((0..factors).map(|_| 0.0));
    for reading in 0..readings {
        for column in &columns {
            let lambda = 1.0 + column.iter().map(|c| c * c).sum::<f64>();
            block.push((column[reading] / lambda.sqrt()) as f32);
        }
    }
    (columns, block)
}

fn sizes(readings: usize, factors: usize) -> Sizes {
    Sizes { readings, factors, components: 0, outputs: 1 }
}

#[test]
fn missing_readings_are_those_expected_of_the_others() {
    for (readings, factors, missing) in
        [(12, 3, vec![5]), (40, 8, (0..10).collect()), (144, 16, (72..90).collect::<Vec<_>>())]
    {
        let (columns, block) = fills(readings, factors, 7);
        let sizes = sizes(readings, factors);
        let model = ReadingModel::new(sizes, &block).unwrap();
        let mut draw = draws(99);
        let of_factors: Vec<f64> = (0..factors).map(|_| 2.0 * draw()).collect();
        let z: Vec<f64> = (0..readings)
            .map(|i| columns.iter().zip(&of_factors).map(|(c, f)| c[i] * f).sum::<f64>() + draw())
            .collect();
        let unit = |i: usize| f64::from(block[readings + i]);
        let mean = |i: usize| f64::from(block[i]);
        let whole: Vec<f32> = (0..readings).map(|i| (mean(i) + z[i] / unit(i)) as f32).collect();
        let mut frame = whole.clone();
        missing.iter().for_each(|i| frame[*i] = f32::NAN);
        // Readings in another unit: their baseline is 4.
        let mut scaled: Vec<f32> = frame.iter().map(|reading| 4.0 * reading).collect();
        let mut scratch = vec![f32::NAN; sizes.scratch_floats()];
        assert_eq!(model.fill(&mut frame, None, &mut scratch), missing.len());
        // What is expected makes zᵀ·(I − V·Vᵀ)·z least: its slope is 0.
        let parts = |i: usize, f: usize| f64::from(block[2 * readings + (i + 1) * factors + f]);
        let found: Vec<f64> =
            (0..readings).map(|i| (f64::from(frame[i]) - mean(i)) * unit(i)).collect();
        let along = |factor| (0..readings).map(|i| parts(i, factor) * found[i]).sum::<f64>();
        let along: Vec<f64> = (0..factors).map(along).collect();
        for i in &missing {
            let slope = found[*i] - (0..factors).map(|f| parts(*i, f) * along[f]).sum::<f64>();
            // In units of the noise, where the readings themselves are tens.
            assert!(slope.abs() < 5e-3, "{readings}: {slope}");
            assert!((found[*i] - z[*i]).abs() < 3.0, "{readings}: tells nothing");
        }
        let others = (0..readings).filter(|i| !missing.contains(i));
        others.for_each(|i| assert_eq!(frame[i].to_bits(), whole[i].to_bits()));

        let mut reciprocals = vec![0.25; readings];
        let of_baseline = Some(&reciprocals[..]);
        assert_eq!(model.fill(&mut scaled, of_baseline, &mut scratch), missing.len());
        scaled.iter().zip(&frame).for_each(|(a, b)| assert_eq!(*a, 4.0 * b));
        // A reading without a baseline stays missing, but does not keep others from being filled.
        missing.iter().for_each(|i| scaled[*i] = f32::NAN);
        reciprocals[missing[0]] = f32::NAN;
        let of_baseline = Some(&reciprocals[..]);
        assert_eq!(model.fill(&mut scaled, of_baseline, &mut scratch), missing.len() - 1);
        assert!(scaled[missing[0]].is_nan());
    }
}

#[test]
fn frames_that_are_whole_or_miss_too_much_stay_as_they_are() {
    let (_, block) = fills(12, 3, 3);
    let model = ReadingModel::new(sizes(12, 3), &block).unwrap();
    let mut scratch = vec![0.0; model.sizes().scratch_floats()];
    let filled = |missing: usize, scratch: &mut [f32]| {
        let mut frame = [55.0; 12];
        frame[..missing].fill(f32::INFINITY);
        let count = model.fill(&mut frame, None, scratch);
        (count, frame.iter().filter(|reading| !reading.is_finite()).count())
    };
    assert_eq!(filled(0, &mut scratch), (0, 0));
    assert_eq!(filled(3, &mut scratch), (3, 0));
    assert_eq!(filled(4, &mut scratch), (0, 4)); // one in three
    assert_eq!(filled(1, &mut scratch[1..]), (0, 1));
    assert_eq!(model.fill(&mut [f32::NAN, 55.0], None, &mut scratch), 0);
}

#[test]
fn a_reading_that_never_changed_is_filled_with_its_mean() {
    let mut block = [&[60.0; 4][..], &[10.0; 4], &[0.0], &[0.4; 4]].concat();
    (block[6], block[11]) = (0.0, 0.0);
    let model = ReadingModel::new(sizes(4, 1), &block).unwrap();
    let mut frame = [63.0, 63.0, f32::NAN, 63.0];
    assert_eq!(model.fill(&mut frame, None, &mut [0.0; 7]), 1);
    assert_eq!(frame[2], 60.0);
}

#[test]
fn readings_without_a_baseline_count_among_the_missing() {
    let (_, block) = fills(12, 3, 3);
    let model = ReadingModel::new(sizes(12, 3), &block).unwrap();
    let mut scratch = vec![0.0; model.sizes().scratch_floats()];
    let (mut reciprocals, mut frame) = ([1.0; 12], [55.0; 12]);
    reciprocals[..3].fill(f32::NAN);
    frame[5] = f32::NAN;
    assert_eq!(model.fill(&mut frame, Some(&reciprocals), &mut scratch), 0); // four of twelve
    reciprocals[0] = 1.0;
    assert_eq!(model.fill(&mut frame, Some(&reciprocals), &mut scratch), 1);
}
