use std::vec::Vec;

use super::*;

/// Numbers between −½ and ½, as a generator of one line draws them.
fn draws(seed: u32) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 24) - 0.5
    }
}

/// Loadings K (`readings × factors`) whose columns are orthogonal, and the block of the fill of covariance I + K·Kᵀ.
fn model(readings: usize, factors: usize, seed: u32) -> (Vec<Vec<f64>>, Vec<f32>) {
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
    for reading in 0..readings {
        for column in &columns {
            let lambda = 1.0 + column.iter().map(|c| c * c).sum::<f64>();
            block.push((column[reading] / lambda.sqrt()) as f32);
        }
    }
    (columns, block)
}

#[test]
fn missing_readings_are_those_expected_of_the_others() {
    for (readings, factors, missing) in
        [(12, 3, vec![5]), (40, 8, (0..10).collect()), (144, 16, (72..90).collect::<Vec<_>>())]
    {
        let (columns, block) = model(readings, factors, 7);
        let fill = Fill::new(readings, factors, &block).unwrap();
        let mut draw = draws(99);
        let of_factors: Vec<f64> = (0..factors).map(|_| 2.0 * draw()).collect();
        let z: Vec<f64> = (0..readings)
            .map(|i| columns.iter().zip(&of_factors).map(|(c, f)| c[i] * f).sum::<f64>() + draw())
            .collect();
        let unit = |i: usize| f64::from(block[readings + i]);
        let mean = |i: usize| f64::from(block[i]);
        let mut frame: Vec<f32> =
            (0..readings).map(|i| (mean(i) + z[i] / unit(i)) as f32).collect();
        let before = frame.clone();
        missing.iter().for_each(|i| frame[*i] = f32::NAN);
        let mut scratch = vec![f32::NAN; fill.scratch_floats()];
        assert_eq!(fill.fill(&mut frame, &mut scratch), missing.len());
        // What is expected makes zᵀ·(I − V·Vᵀ)·z least: its slope is 0.
        let parts = |i: usize, factor: usize| f64::from(block[2 * readings + i * factors + factor]);
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
        others.for_each(|i| assert_eq!(frame[i].to_bits(), before[i].to_bits()));
    }
}

#[test]
fn frames_that_are_whole_or_miss_too_much_stay_as_they_are() {
    let (_, block) = model(12, 3, 3);
    let fill = Fill::new(12, 3, &block).unwrap();
    let mut scratch = vec![0.0; fill.scratch_floats()];
    let whole = [55.0; 12];
    let filled = |missing: usize, scratch: &mut [f32]| {
        let mut frame = whole;
        frame[..missing].fill(f32::INFINITY);
        let count = fill.fill(&mut frame, scratch);
        (count, frame.iter().filter(|reading| !reading.is_finite()).count())
    };
    assert_eq!(filled(0, &mut scratch), (0, 0));
    assert_eq!(filled(3, &mut scratch), (3, 0));
    assert_eq!(filled(4, &mut scratch), (0, 4)); // one in three
    assert_eq!(filled(1, &mut scratch[1..]), (0, 1));
    assert_eq!(fill.fill(&mut [f32::NAN, 55.0], &mut scratch), 0);
}

#[test]
fn a_reading_that_never_changed_is_filled_with_its_mean() {
    let mut block = [[60.0; 4], [10.0; 4], [0.4; 4]];
    (block[1][2], block[2][2]) = (0.0, 0.0);
    let fill = Fill::new(4, 1, block.as_flattened()).unwrap();
    let mut frame = [63.0, 63.0, f32::NAN, 63.0];
    assert_eq!(fill.fill(&mut frame, &mut [0.0; 2]), 1);
    assert_eq!(frame[2], 60.0);
}

#[test]
fn blocks_that_do_not_fit_are_refused() {
    let (_, block) = model(4, 1, 1);
    let with = |place: usize, value: f32| {
        let mut block = block.clone();
        block[place] = value;
        Fill::new(4, 1, &block).map(drop)
    };
    let length = NetworkError::Length { what: "fill", expected: 12, found: 11 };
    assert_eq!(Fill::new(4, 1, &block[1..]), Err(length));
    assert_eq!(Fill::new(4, 0, &[]), Err(NetworkError::Empty));
    assert_eq!(Fill::new(0, 1, &[]), Err(NetworkError::Empty));
    assert_eq!(with(0, f32::NAN), Err(NetworkError::NotFinite { what: "fill" }));
    assert_eq!(with(5, -1.0), Err(NetworkError::NotPositive { what: "fill" }));
    assert_eq!(with(8, 1.0), Err(NetworkError::NotPositive { what: "fill" }));
    assert_eq!(with(0, 1.0), Ok(()));
}
