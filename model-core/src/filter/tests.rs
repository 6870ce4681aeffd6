use super::*;

/// Filter of one output, whose frames come each millisecond.
struct One {
    settings: Settings,
    state: State<[Track; 1]>,
}

impl One {
    fn new(time_constant_us: u32, lead_us: u32) -> Self {
        Self { settings: Settings { time_constant_us, lead_us }, state: State::new([[0.0; 2]]) }
    }

    /// Output for a frame at `start_us` whose row ends with this `status` and `output`.
    fn row(&mut self, start_us: u64, status: RowStatus, output: f32) -> f32 {
        let (mut outputs, mut status) = ([output], [status]);
        let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
        self.state.filter(self.settings, start_us, &mut estimate);
        outputs[0]
    }

    /// Output for a frame at `start_us` that is decoded to `output`.
    fn at(&mut self, start_us: u64, output: f32) -> f32 {
        self.row(start_us, RowStatus::Decoded, output)
    }
}

#[test]
fn a_ramp_is_followed_without_lag_however_frames_come() {
    for (lead_us, tolerance) in [(0, 2e-6), (2500, 4e-6)] {
        let mut one = One::new(5000, lead_us);
        let mut us = 1_u64 << 40; // a time that f32 does not hold
        let start_us = us;
        let mm = |us: u64| 30.0 * ((us - start_us) as f32 * 1e-6);
        for frame in 0..400 {
            let filtered = one.at(us, mm(us));
            if frame > 150 {
                let truth = mm(us + u64::from(lead_us));
                assert!((filtered / truth - 1.0).abs() < tolerance, "{filtered} for {truth}");
            }
            us += [1000, 900, 1100, 4000][frame % 4]; // late frames and missed ones
        }
    }
}

#[test]
fn a_step_is_answered_as_by_two_equal_poles() {
    for (time_constant_us, period_us) in [(500, 1000), (2000, 1000), (12_000, 1000), (5000, 2300)] {
        let mut one = One::new(time_constant_us, 0);
        let theta = (-(period_us as f64) / f64::from(time_constant_us)).exp();
        one.at(0, 0.0);
        for n in 0..50 {
            let expected = 1.0 - theta.powi(n + 1) * (theta - (1.0 - theta) * f64::from(n));
            let found = f64::from(one.at(period_us * (n as u64 + 1), 1.0));
            assert!((found - expected).abs() < 1e-5, "{found} instead of {expected}, {n}");
        }
    }
}

#[test]
fn a_repeated_frame_changes_nothing() {
    let (mut once, mut again) = (One::new(4000, 1500), One::new(4000, 1500));
    for frame in 0..40 {
        let mm = ((frame * 7) % 5) as f32 * -0.1;
        let expected = once.at(800 * frame, mm);
        for other in [mm, mm, 1e3] {
            assert_eq!(again.at(800 * frame, other).to_bits(), expected.to_bits());
        }
    }
    assert_eq!(once.state, again.state);
}

#[test]
fn a_long_gap_and_a_time_that_goes_back_start_anew() {
    for (start_us, is_new) in [(299_999, false), (300_000, false), (300_001, true), (199_999, true)]
    {
        let mut one = One::new(10_000, 10_000);
        one.at(100_000, 0.0);
        one.at(200_000, 1.0);
        let filtered = one.at(start_us, 0.25);
        assert_eq!(filtered == 0.25, is_new, "{filtered} at {start_us}");
    }
    let mut one = One::new(10_000, 0);
    one.at(1000, 0.0);
    one.state.restart();
    assert_eq!(one.at(2000, 0.5), 0.5);
    // A gap of which the low 32 bits are small is long.
    assert_eq!(one.at(2000 + (1 << 32), 0.75), 0.75);
}

#[test]
fn a_row_that_is_not_decoded_starts_anew_and_others_go_on() {
    let settings = Settings { time_constant_us: 3000, lead_us: 1000 };
    let mut state = State::new([[0.0; 2]; 4]);
    let mut filtered = |frame, outputs: [f32; 4], status: [RowStatus; 2]| {
        let (mut outputs, mut status) = (outputs, status);
        let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
        state.filter(settings, 1000 * frame, &mut estimate);
        outputs
    };
    let (good, nan) = (RowStatus::Decoded, f32::NAN);
    let mut other = One::new(3000, 1000);
    for (frame, faulty) in [RowStatus::MissingReading, RowStatus::Overflow].into_iter().enumerate()
    {
        let frame = 3 * frame as u64;
        other.at(1000 * frame, 0.1);
        filtered(frame, [0.5, 0.6, 0.1, 0.2], [good; 2]);
        other.at(1000 * frame + 1000, 0.3);
        let [a, b, c, _] = filtered(frame + 1, [nan, nan, 0.3, 0.2], [faulty, good]);
        assert!(a.is_nan() && b.is_nan() && c.is_finite());
        let [a, b, c, _] = filtered(frame + 2, [0.7, 0.4, 0.2, 0.2], [good; 2]);
        assert_eq!([a, b, c], [0.7, 0.4, other.at(1000 * frame + 2000, 0.2)]);
    }
}

#[test]
fn no_output_makes_a_filter_fail_for_good() {
    let mut one = One::new(1000, 1000);
    one.at(0, f32::MAX);
    one.at(1000, f32::MIN); // the innovation overflows
    assert_eq!(one.at(2000, 0.5), 0.5);
    assert_eq!(one.at(3000, 0.5), 0.5);
}

#[test]
fn nothing_is_filtered_without_a_time_constant_or_room() {
    let mut one = One::new(0, 5000);
    assert_eq!([one.at(0, 0.5), one.at(1000, 0.75)], [0.5, 0.75]);
    let mut state = State::new([[0.0; 2]; 0]);
    let (mut outputs, mut status) = ([0.5], [RowStatus::Decoded]);
    let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
    let settings = Settings { time_constant_us: 1000, lead_us: 0 };
    state.filter(settings, 0, &mut estimate);
    state.filter(settings, 0, &mut Estimate { outputs: &mut [], status: &mut [] });
    assert_eq!(outputs, [0.5]);
}

#[test]
fn the_longest_time_constant_keeps_its_coefficients() {
    let mut worst = 0.0_f64;
    for gap_us in 100..20_000 {
        let settings = Settings { time_constant_us: Settings::MOST_US, lead_us: 0 };
        let Step { alpha, .. } = settings.step(gap_us).unwrap();
        let expected = -(-2e-6 * gap_us as f64).exp_m1(); // 1 − θ²
        worst = worst.max((f64::from(alpha) / expected - 1.0).abs());
    }
    assert!(worst < 1e-3, "{worst}");
}
