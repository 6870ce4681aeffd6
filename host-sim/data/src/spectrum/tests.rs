use super::*;
use crate::random::{Purpose, Random, Stream};

/// Readings of 500 Ω with white noise and an AR(1) part of these variances and this time constant, in frames, and the
/// part that `drift` adds to frame and reading.
fn readings(
    (frames, columns): (usize, usize),
    (white, correlated, time_constant): (f64, f64, f64),
    seed: u64,
    drift: impl Fn(usize) -> f64,
) -> Table {
    let decay: f64 = if time_constant > 0.0 { (-1.0 / time_constant).exp() } else { 0.0 };
    let mut random = Random::new(seed, Stream::Test, Purpose::Noise, 0, 0);
    let mut states: Vec<f64> = (0..columns).map(|_| random.normal()).collect();
    let mut values = Vec::with_capacity(frames * columns);
    for frame in 0..frames {
        for state in &mut states {
            *state = decay * *state + (1.0 - decay * decay).sqrt() * random.normal();
            let noise = white.sqrt() * random.normal() + correlated.sqrt() * *state;
            values.push(500.0 + noise + drift(frame));
        }
    }
    Table { names: (0..columns).map(|column| format!("ch{column}")).collect(), values }
}

fn judge(table: &Table, interval_s: f64) -> Spectrum {
    let numbers: Vec<usize> = (0..table.len()).collect();
    let times: Vec<f64> = numbers.iter().map(|n| *n as f64 * interval_s).collect();
    Spectrum::new(table, &numbers, Some(&times)).unwrap()
}

#[test]
fn a_time_constant_of_20_ms_is_recognised_with_and_without_white_noise() {
    for (rate, white) in [(100, 0.0), (100, 1.0), (300, 1.0), (1000, 0.0), (1000, 1.0)] {
        let rate_hz = rate as f64;
        let table = readings((10 * rate, 24), (white, 1.0, 0.02 * rate_hz), 3, |_| 0.0);
        let found = judge(&table, 1.0 / rate_hz);
        assert_eq!(found.colour, NoiseColour::Correlated, "{rate} {white}");
        let tau_s = found.time_constant_s.unwrap();
        assert!((tau_s / 0.02 - 1.0).abs() < 0.15, "{rate} {white}: {tau_s}");
        let share = 1.0 / (1.0 + white);
        assert!((found.correlated_share - share).abs() < 0.08, "{rate} {white}: {found:?}");
        let [white_level, correlated_level] = found.levels.unwrap();
        assert!((500.0 * correlated_level - 1.0).abs() < 0.1, "{white_level} {correlated_level}");
    }
}

#[test]
fn white_noise_is_white_for_one_reading_and_for_many() {
    for (frames, columns, seeds) in [(1000, 1, 1000), (300, 20, 500), (2000, 144, 4)] {
        for seed in 0..seeds {
            let found = judge(&readings((frames, columns), (1.0, 0.0, 0.0), seed, |_| 0.0), 0.01);
            let frames = found.frames;
            assert_eq!(found.colour, NoiseColour::White, "{frames} × {columns}, seed {seed}");
            assert_eq!((found.pays_up_to, found.time_constant_s), (None, None), "seed {seed}");
        }
    }
}

#[test]
fn noise_that_readings_share_is_no_more_certain_than_that_of_one() {
    for seed in 0..60 {
        let one = readings((500, 1), (1.0, 0.0, 0.0), seed, |_| 0.0);
        let values = one.values.iter().flat_map(|value| [*value; 100]).collect();
        let names = (0..100).map(|column| format!("ch{column}")).collect();
        let found = judge(&Table { names, values }, 0.01);
        assert_eq!(found.colour, NoiseColour::White, "seed {seed}");
        assert!((found.autocorrelation[0].bound - 2.0 / 499_f64.sqrt()).abs() < 1e-9);
    }
}

#[test]
fn a_drift_is_no_time_constant() {
    let drifts: [&dyn Fn(usize) -> f64; 3] =
        [&|frame| 0.01 * frame as f64, &|frame| 5.0 * (frame as f64 / 700.0).sin(), &|frame| {
            -20.0 * (-(frame as f64) / 1500.0).exp()
        }];
    for (which, drift) in drifts.into_iter().enumerate() {
        let found = judge(&readings((3000, 24), (1.0, 0.0, 0.0), 5, drift), 0.01);
        assert_ne!(found.colour, NoiseColour::Correlated, "{which}: {found:?}");
        assert!(found.pays_up_to.is_some_and(|frames| frames < 300), "{which}: {found:?}");
        let found = judge(&readings((3000, 24), (1.0, 1.0, 4.0), 5, drift), 0.01);
        assert_eq!(found.colour, NoiseColour::Correlated, "{which}: {found:?}");
        let tau = found.time_constant_frames.unwrap();
        assert!((tau / 4.0 - 1.0).abs() < 0.3, "{which}: {tau}");
    }
    // A random walk has no time constant either, and says so.
    let mut walk = 0.0;
    let mut random = Random::new(1, Stream::Test, Purpose::Noise, 1, 0);
    let steps: Vec<f64> = (0..3000)
        .map(|_| {
            walk += 0.1 * random.normal();
            walk
        })
        .collect();
    let found = judge(&readings((3000, 24), (1.0, 0.0, 0.0), 5, |frame| steps[frame]), 0.01);
    assert_eq!(found.colour, NoiseColour::Slow, "{found:?}");
    assert_eq!(found.correlated_share, 0.0);
}

#[test]
fn pauses_of_a_log_are_no_neighbours() {
    // Pauses of 60 frames, each with a level of its own.
    let level = |frame: usize| (frame / 60 * 37 % 11) as f64;
    let table = readings((3000, 12), (1.0, 1.0, 5.0), 2, level);
    let numbers: Vec<usize> = (0..3000).map(|frame| frame + 10 * (frame / 60)).collect();
    let found = Spectrum::new(&table, &numbers, None).unwrap();
    assert_eq!((found.colour, found.interval_s), (NoiseColour::Correlated, None));
    let tau = found.time_constant_frames.unwrap();
    assert!((tau / 5.0 - 1.0).abs() < 0.3, "{tau}");
    assert_eq!((found.time_constant_s, found.irregular), (None, false));
}

#[test]
fn times_that_are_not_steady_are_counted_in_frames() {
    let table = readings((1000, 4), (1.0, 0.0, 0.0), 2, |_| 0.0);
    let numbers: Vec<usize> = (0..1000).collect();
    let times = |jitter: f64| -> Vec<f64> {
        (0..1000)
            .map(|n| 0.01 * (f64::from(n) + jitter * f64::from(n * 37 % 101) / 101.0))
            .collect()
    };
    let steady = Spectrum::new(&table, &numbers, Some(&times(0.1))).unwrap();
    assert!((steady.interval_s.unwrap() - 0.01).abs() < 0.001 && !steady.irregular);
    let found = Spectrum::new(&table, &numbers, Some(&times(0.9))).unwrap();
    assert_eq!((found.interval_s, found.irregular), (None, true));
    // A gap in time ends a stretch, whatever the numbers say.
    let mut gap = times(0.0);
    gap[500..].iter_mut().for_each(|time| *time += 1.0);
    let found = Spectrum::new(&table, &numbers, Some(&gap)).unwrap();
    let bound = found.autocorrelation[0].bound;
    assert!((bound - 2.0 / (4.0 * 998.0_f64).sqrt()).abs() < 1e-3 * bound, "{bound}");
}

#[test]
fn averaging_pays_as_far_as_the_noise_is_white() {
    let found = judge(&readings((20_000, 24), (1.0, 1.0, 20.0), 7, |_| 0.0), 0.001);
    for it in &found.averaging {
        // Means of so many frames of the same noise, drawn anew, and their standard deviation.
        let means = readings((4000 * it.frames.min(16), 1), (1.0, 1.0, 20.0), 11, |_| 500.0);
        if it.frames > 16 {
            continue;
        }
        let means: Vec<f64> = means
            .values
            .chunks(it.frames)
            .map(|it| it.iter().sum::<f64>() / it.len() as f64)
            .collect();
        let mean = means.iter().sum::<f64>() / means.len() as f64;
        let square = means.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / means.len() as f64;
        let expected = (square / 2.0).sqrt();
        assert!((it.error / expected - 1.0).abs() < 0.12, "{it:?} {expected}");
    }
    // Eight frames have 0.71 of the error of one, four have 0.77.
    assert_eq!(found.pays_up_to, Some(4), "{:?}", found.averaging);
    let white = judge(&readings((20_000, 4), (1.0, 0.0, 0.0), 7, |_| 0.0), 0.001);
    for it in &white.averaging {
        assert!((it.allan / it.white - 1.0).abs() < 0.25, "{it:?}");
        assert_eq!(it.error, it.white);
    }
}

#[test]
fn what_is_left_of_a_mean_is_the_exact_variance() {
    assert_eq!(
        (left_of_mean(1, 0.7), left_of_mean(8, 0.0), left_of_mean(5, 1.0)),
        (1.0, 0.125, 1.0)
    );
    // The closed form: ((1 + ρ)/(1 − ρ) − 2ρ(1 − ρⁿ)/(n(1 − ρ)²))/n.
    for (n, rho) in [(2, 0.5), (12, 0.9), (100, 0.99)] {
        let count = f64::from(n);
        let closed = ((1.0 + rho) / (1.0 - rho)
            - 2.0 * rho * (1.0 - f64::powi(rho, n)) / (count * (1.0 - rho) * (1.0 - rho)))
            / count;
        assert!((left_of_mean(n as usize, rho) / closed - 1.0).abs() < 1e-12);
    }
}

#[test]
fn too_little_is_not_judged() {
    let numbers = |frames: usize| (0..frames).collect::<Vec<_>>();
    let few = readings((39, 9), (1.0, 0.0, 0.0), 1, |_| 0.0);
    assert_eq!(Spectrum::new(&few, &numbers(39), None), None);
    let still = Table { names: vec!["ch1".into()], values: vec![5.0; 400] };
    assert_eq!(Spectrum::new(&still, &numbers(400), None), None);
    // A missing value parts the frames around it, and a dead reading does not count.
    let mut gaps = readings((400, 3), (1.0, 0.0, 0.0), 1, |_| 0.0);
    gaps.values[600] = f64::NAN;
    gaps.values.iter_mut().skip(1).step_by(3).for_each(|value| *value = 7.0);
    let found = Spectrum::new(&gaps, &numbers(400), None).unwrap();
    assert_eq!((found.frames, found.readings), (399, 2));
    // A few frames apart are no stretch.
    let apart: Vec<usize> = (0..400).map(|number| 2 * number).collect();
    assert_eq!(Spectrum::new(&gaps, &apart, None), None);
}
