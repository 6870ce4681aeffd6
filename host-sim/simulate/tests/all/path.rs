//! Paths of contacts.

use taxel_data::{LANES, Stream};
use taxel_simulate::motion::Draws;
use taxel_simulate::path::{Path, Paths};
use taxel_simulate::sensor::Sensor;

fn paths(path: &Path) -> Paths {
    let sensor = Sensor::paper();
    path.check(&sensor, 1.0).unwrap();
    path.place(&sensor, 1.0, &Path::draw(&mut Draws::new(1, Stream::Test, 0)))
}

#[test]
fn contacts_keep_to_their_speed_their_depth_and_the_face() {
    let path = Path { press_rate_hz: [1.0, 5.0], ..Path::at(50.0, 0.0) };
    let paths = paths(&path);
    let (step_s, mut fastest, mut deepest) = (1e-4, [0.0_f64; LANES], [0.0_f64; LANES]);
    let mut lifted = [0.0; LANES];
    let mut before = paths.at(0.0);
    // Ten periods of the slowest press, and some of the slowest path.
    for step in 1..=100_000 {
        let now = paths.at(f64::from(step) * step_s);
        for lane in 0..LANES {
            let [x, y] = now.0.map(|lanes| lanes[lane]);
            assert!((0.0..=20.0).contains(&x) && (0.0..=18.0).contains(&y), "{x} {y}");
            let moved = [0, 1].map(|axis| now.0[axis][lane] - before.0[axis][lane]);
            fastest[lane] = fastest[lane].max(moved[0].hypot(moved[1]) / step_s);
            deepest[lane] = deepest[lane].max(now.1[lane]);
            lifted[lane] += f64::from(u8::from(now.1[lane] == 0.0)) / 100_000.0;
        }
        before = now;
    }
    for lane in 0..LANES {
        // With directions half a radian out of phase, the greatest speed is a little below that of both in phase.
        assert!((40.0..50.01).contains(&fastest[lane]), "{} mm/s", fastest[lane]);
        assert!((0.3..=1.0).contains(&deepest[lane]), "{} mm", deepest[lane]);
        // sin < −2/3 for 26.8 % of a period; 10 s are not a whole number of periods.
        assert!((0.24..0.30).contains(&lifted[lane]), "{}", lifted[lane]);
    }
}

#[test]
fn a_slide_keeps_its_depth_and_a_press_in_place_its_centre() {
    let slide = paths(&Path::at(20.0, 0.0));
    assert_eq!(slide.at(0.0).1, slide.at(0.37).1);
    assert!(slide.at(0.0).1.iter().all(|depth_mm| *depth_mm >= 0.3));
    let press = paths(&Path::at(0.0, 2.0));
    assert_eq!(press.at(0.0).0, press.at(0.37).0);
    assert_ne!(press.at(0.0).1, press.at(0.37).1);
}

#[test]
fn settings_that_cannot_be_used_are_refused_by_name() {
    let usual = Path::at(50.0, 3.0);
    for (path, field) in [
        (Path { speed_mm_per_s: [5.0, 1.0], ..usual }, "speed_mm_per_s"),
        (Path { speed_mm_per_s: [f64::NAN; 2], ..usual }, "speed_mm_per_s"),
        (Path { press_rate_hz: [-1.0, 1.0], ..usual }, "press_rate_hz"),
        (Path { peak_depth_mm: Some([0.5, 1.1]), ..usual }, "peak_depth_mm"),
        (Path { centre_mm: Some([[1.0, 21.0], [1.0, 2.0]]), ..usual }, "centre_mm (x)"),
        (Path { half_length_mm: Some([[0.5, 1.0], [0.5, 9.0]]), ..usual }, "half_length_mm (y)"),
        (Path { half_length_mm: Some([[0.0, 1.0], [0.0, 1.0]]), ..usual }, "half_length_mm"),
        (Path { duration_s: 0.0, ..usual }, "duration_s"),
        (Path { trajectories: 0, ..usual }, "trajectories"),
    ] {
        let refused = path.check(&Sensor::paper(), 1.0).unwrap_err().to_string();
        assert!(refused.contains(&format!("motion.{field}")), "{refused}");
    }
}
