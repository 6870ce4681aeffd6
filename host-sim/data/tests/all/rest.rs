//! Lines at rest, and the baseline that they make.

use std::path::Path;

use taxel_data::data_file::Reading;
use taxel_data::rest::{is_zero_at_rest, lines_at_rest, lines_without_load};
use taxel_data::{DataFile, Rest, Table};

fn file(lines: &[[f64; 2]]) -> DataFile {
    let lines: Vec<String> = lines.iter().map(|[a, f]| format!("{a},{f}\n")).collect();
    let text = format!("a,f_n\n{}", lines.concat());
    DataFile::parse(Path::new("log.csv"), text.as_bytes(), &Reading::default()).unwrap()
}

#[test]
fn forces_and_deformations_are_zero_at_rest_and_positions_not() {
    for name in ["fz_n", "force (N)", "load_g", "p_kPa", "Fz", "weight", "r4e2_dz_mm"] {
        assert!(is_zero_at_rest(name), "{name}");
    }
    for name in ["x_mm", "contact_x_mm", "c5", "temp_degC", "class", "time_s"] {
        assert!(!is_zero_at_rest(name), "{name}");
    }
}

#[test]
fn lines_at_rest_have_neighbours_at_rest() {
    let force = |line: usize| match line % 40 {
        0..20 => 0.001,
        20 => 0.05,
        _ => 5.0,
    };
    let log = file(&(0..200).map(|line| [1.0, force(line)]).collect::<Vec<_>>());
    let at_rest = lines_at_rest(&log, &[1]);
    // 20 is as far from zero as may be, and the line before a press is left out.
    let of_press = at_rest.iter().filter(|line| (40..80).contains(*line)).copied();
    assert_eq!(of_press.collect::<Vec<_>>(), (41..60).collect::<Vec<_>>());
    let without_load = lines_without_load(&log, &[1]);
    assert_eq!((without_load.len(), without_load[21]), (5 * 21, 40));
    // A scale that was not tared, about whose zero there is noise.
    let noise = |line: usize| [-0.02, 0.02, 0.0][line % 40 % 3];
    let off = |line: usize| [1.0, force(line) + 0.2 + noise(line)];
    let off: Vec<[f64; 2]> = (0..200).map(off).collect();
    assert_eq!(lines_at_rest(&file(&off), &[1]), at_rest);
    // Lines in random order count by themselves.
    let force = |line: usize| if line.is_multiple_of(3) { 0.0 } else { 5.0 };
    let shuffled = file(&(0..90).map(|line| [1.0, force(line)]).collect::<Vec<_>>());
    assert_eq!(lines_at_rest(&shuffled, &[1]).len(), 30);
    assert_eq!(lines_without_load(&shuffled, &[1]), [0; 0]);
    for none in [vec![[1.0, 0.0]; 50], vec![[1.0, f64::NAN]; 50], vec![[1.0, 5.0]; 50]] {
        assert_eq!(lines_at_rest(&file(&none), &[1]), [0; 0]);
    }
    assert_eq!(lines_at_rest(&log, &[]), [0; 0]);
    // Ten lines are enough.
    let pause = |lines: usize| {
        file(&(0..60).map(|at| [1.0, if at < lines { 0.0 } else { 5.0 }]).collect::<Vec<_>>())
    };
    assert_eq!([10, 9].map(|lines| lines_at_rest(&pause(lines), &[1]).len()), [10, 0]);
    assert_eq!([12, 11].map(|lines| lines_without_load(&pause(lines), &[1]).len()), [12, 0]);
    // Wild values are no measure for zero.
    let mut wild: Vec<[f64; 2]> = (0..200).map(|line| [1.0, f64::from(line % 40 / 20)]).collect();
    let sound = lines_at_rest(&file(&wild), &[1]);
    wild[30..33].fill([1.0, 1e6]);
    assert_eq!((sound.len(), lines_at_rest(&file(&wild), &[1])), (91, sound));
}

#[test]
fn the_baseline_is_that_of_the_pauses_before_a_line() {
    // 300 lines at rest, of which every one reads its own number, and the same below zero.
    let names = ["a", "b"].map(String::from).to_vec();
    let values = (0..300).flat_map(|line| [f64::from(line), -f64::from(line)]).collect();
    let readings = Table { names, values };
    let lines = Some((0..300).map(|line| 2 * line).collect());
    let log = Rest { readings: readings.clone(), lines };
    // The first hundred serve all lines among them; lines 401 and 402 have lines 0 to 400 before them, 201 at rest.
    let means = [49.5, 49.5, 150.5, 150.5, 249.5].map(|mean| [mean, -mean]);
    assert_eq!(log.baselines(&[0, 50, 401, 402, 900]).values[..], means.concat());
    let apart = Rest { readings, lines: None };
    assert_eq!(apart.baselines(&[3, 4]).values, [149.5, -149.5]);
}

#[test]
fn a_drift_is_no_noise() {
    let noise = |line: i32| f64::from(line * 37 % 101) / 101.0;
    let value = |line: i32| 50.0 * f64::from(line / 100) + noise(line);
    let readings = Table { names: vec!["a".into()], values: (0..1000).map(value).collect() };
    // A pause between two drifts: its ends are no successive lines.
    let lines = (0..1000).map(|line| line + 50 * (line / 100)).collect();
    let told = |lines| Rest { readings: readings.clone(), lines }.noise()[0];
    // Steps are of 37 and −64 parts in 101: half their mean square is 37 · 64/2.
    let found = told(Some(lines));
    assert!((0.335..0.345).contains(&found), "{found}");
    assert!(told(None) > 100.0);
    assert_eq!(told(Some((0..1000).map(|line| 2 * line).collect())), told(None));
}
