//! Decoders behind a filter in time, and the rule for its settings.

use taxel_core::filter::{Settings, State};
use taxel_core::{Estimate, RowStatus};
use taxel_data::{Purpose, Random, Stream};
use taxel_learn::filtered::{Movement, filter_frames, settings_for, time_constant_for};
use taxel_learn::{Decoder, Estimates, Filtered, FrameDecoder, Frames, Timing};

/// Decoder of a test, whose outputs are the readings.
struct Same;

impl FrameDecoder for Same {
    type State = ();

    fn name(&self) -> &'static str {
        "same"
    }

    fn inputs(&self) -> usize {
        2
    }

    fn decode(&self, (): &mut (), frames: Frames<'_>) -> Estimates {
        Estimates::of_values(frames.readings.to_vec())
    }
}

#[test]
fn each_trajectory_is_filtered_by_its_times_as_a_device_filters() {
    let settings = Settings { time_constant_us: 4000, lead_us: 1500 };
    let filtered = Filtered::new(Same, settings);
    let mut readings: Vec<f64> = (0..40).map(|i| f64::from(i * 7 % 11) * 0.1).collect();
    readings[9] = f64::NAN;
    let start_us: Vec<u64> =
        (0..20).map(|frame| 1_000_000 * (frame / 10) + (900 + 20 * frame) * frame).collect();
    let timing = Timing { start_us: &start_us, reading_offset_us: &[] };
    let frames = Frames { readings: &readings, timing: Some(timing) };
    let found = filtered.decode_frames(frames, 10).values;

    let mut expected = Vec::new();
    for trajectory in 0..2 {
        let mut state = State::new([[0.0; 2]; 2]);
        for frame in 10 * trajectory..10 * (trajectory + 1) {
            let mut outputs = [readings[2 * frame] as f32, readings[2 * frame + 1] as f32];
            let good = |value: f32| {
                if value.is_nan() { RowStatus::MissingReading } else { RowStatus::Decoded }
            };
            let mut status = outputs.map(good);
            let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
            state.filter(settings, start_us[frame], &mut estimate);
            expected.extend(outputs);
        }
    }
    let bits = |value: f64| (value as f32).to_bits();
    let is_same = |(a, b): (&f64, &f32)| (a.is_nan() && b.is_nan()) || bits(*a) == b.to_bits();
    assert!(found.iter().zip(&expected).all(is_same), "{found:?}\n{expected:?}");
    assert!(found[9].is_nan() && found[11] == f64::from(readings[11] as f32));
    assert_ne!(found[2], readings[2]);
    assert_eq!(Decoder::name(&filtered), "same, filtered");
}

#[test]
fn frames_without_times_are_not_filtered() {
    let settings = Settings { time_constant_us: 4000, lead_us: 0 };
    let readings = [0.5, 1.0, 0.75, 0.25];
    let found = Filtered::new(Same, settings).decode_all(&readings, 2);
    assert_eq!(found.values, readings);
}

/// Root mean square error behind the filter, of an output that accelerates: simulated.
fn simulated(noise: f64, acceleration: f64, period_us: u64, settings: Settings) -> f64 {
    let mut random = Random::new(3, Stream::Test, Purpose::Noise, 0, 0);
    let (mut squares, mut count) = (0.0, 0);
    for _ in 0..500 {
        let mut state = State::new(vec![[0.0; 2]]);
        for frame in 0..500 {
            let start_us = period_us * frame;
            let truth = |us: f64| 0.5 * acceleration * (us * 1e-6).powi(2);
            let mut value = [truth(start_us as f64) + noise * random.normal()];
            filter_frames(&mut state, settings, &[start_us], &mut value);
            if frame >= 200 {
                let lead_us = f64::from(settings.lead_us);
                squares += (value[0] - truth(start_us as f64 + lead_us)).powi(2);
                count += 1;
            }
        }
    }
    (squares / f64::from(count)).sqrt()
}

#[test]
fn the_rule_finds_the_least_error_of_a_simulation() {
    for (noise, acceleration, period_us, lead_us) in [
        (0.03, 100.0, 1000, 0),
        (0.03, 100.0, 1000, 3000),
        (0.03, 20.0, 5300, 5400), // the filter has few frames
        (0.1, 400.0, 500, 500),
    ] {
        let (output, lead) = ([noise, acceleration], f64::from(lead_us));
        let (best_us, squared) = time_constant_for(output, period_us as f64, [lead; 2]);
        let at = |factor: f64| {
            let time_constant_us = (best_us * factor).round() as u32;
            simulated(noise, acceleration, period_us, Settings { time_constant_us, lead_us })
        };
        let [shorter, found, longer] = [0.7, 1.0, 1.4].map(at);
        assert!(found < shorter && found < longer, "{best_us}: {shorter} {found} {longer}");
        let expected = squared.sqrt();
        assert!((found / expected - 1.0).abs() < 0.03, "{found} instead of {expected}");
        assert!(found < 0.8 * noise, "{found} of {noise}");
    }
}

#[test]
fn fast_outputs_are_extrapolated_and_slow_noisy_ones_are_not() {
    let of = |noise: f64, rate_per_s: f64| {
        let movement = Movement { rate_per_s, acceleration_per_s2: 80.0 };
        settings_for(noise, movement, 5600.0, 5700.0).lead_us
    };
    assert_eq!((of(0.001, 50.0), of(0.1, 0.0)), (5700, 0));
    let between = of(0.02, 2.1);
    assert!((500..4000).contains(&between), "{between}");
}

#[test]
fn the_rule_keeps_to_what_a_device_takes() {
    let still = Movement { rate_per_s: 10.0, acceleration_per_s2: 0.0 };
    assert_eq!(
        settings_for(1e-3, still, 1000.0, 3e6),
        Settings { time_constant_us: 1_000_000, lead_us: 1_000_000 }
    );
    let shaken = Movement { rate_per_s: 1.0, acceleration_per_s2: 50.0 };
    assert_eq!(settings_for(0.0, shaken, 5.0, 0.4), Settings { time_constant_us: 1, lead_us: 0 });
}
