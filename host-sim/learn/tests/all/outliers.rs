//! Lines of measurements with a value far from all others.

use taxel_data::{Dataset, Purpose, Random, Stream};
use taxel_learn::outliers::{Outliers, find};

/// Readings of six channels and two outputs that follow them, in so many lines.
fn measured(lines: usize, seed: u64) -> Dataset {
    let mut random = Random::new(seed, Stream::Training, Purpose::Noise, 0, 0);
    let names = |name: &str, count: usize| (1..=count).map(|i| format!("{name}{i}")).collect();
    let mut data = Dataset::empty(names("ch", 6), names("f", 2), 1, lines);
    let frames =
        data.inputs.values.chunks_exact_mut(6).zip(data.outputs.values.chunks_exact_mut(2));
    for (inputs, outputs) in frames {
        let (x, y) = (random.unit(), random.unit());
        for (channel, value) in inputs.iter_mut().enumerate() {
            let phase = channel as f64;
            *value = 40.0 + 9.0 * (2.0 * x + phase).sin() + 5.0 * (3.0 * y - phase).cos();
            *value += 0.05 * random.normal();
        }
        outputs.copy_from_slice(&[x, 2.0 * y - x]);
    }
    data
}

/// Log at rest but for `pressed`: lines in which some channels and the force are up.
fn log(lines: usize, pressed: impl Fn(usize) -> bool) -> Dataset {
    let mut random = Random::new(4, Stream::Training, Purpose::Noise, 0, 0);
    let names = |name: &str, count: usize| (1..=count).map(|i| format!("{name}{i}")).collect();
    let mut data = Dataset::empty(names("ch", 4), names("f", 1), 1, lines);
    let frames = data.inputs.values.chunks_exact_mut(4).zip(data.outputs.values.iter_mut());
    for (line, (inputs, force)) in frames.enumerate() {
        *force = if pressed(line) { 1.0 + random.unit() } else { 0.001 * random.normal() };
        for (channel, value) in inputs.iter_mut().enumerate() {
            let reacts = channel == line % 4;
            *value = 100.0 + if reacts { 50.0 * *force } else { 0.0 } + 0.02 * random.normal();
        }
    }
    data
}

/// `data` with other inputs and outputs.
fn changed(mut data: Dataset, change: impl FnOnce(&mut [f64], &mut [f64])) -> Dataset {
    change(&mut data.inputs.values, &mut data.outputs.values);
    data
}

/// Log with two impacts, of which the second has this force; one channel reacts to both.
fn impacts(second: f64) -> Dataset {
    changed(log(4000, |_| false), |inputs, forces| {
        (forces[900], forces[3100]) = (8.0, second);
        (inputs[4 * 900 + 1], inputs[4 * 3100 + 1]) = (500.0, 700.0);
    })
}

fn outliers(data: &Dataset) -> Outliers {
    find(data, |frame| frame as u64 + 2)
}

/// Line of each outlier.
fn lines(data: &Dataset) -> Vec<u64> {
    outliers(data).found.iter().map(|outlier| outlier.line).collect()
}

#[test]
fn data_without_outliers_keeps_every_line() {
    let rare = |line: usize| line.is_multiple_of(100);
    let clusters = changed(measured(1000, 1), |inputs, _| {
        let first = inputs.iter_mut().step_by(6).enumerate();
        first.filter(|(line, _)| line % 10 < 3).for_each(|(_, value)| *value += 1e5);
    });
    let constant = changed(measured(500, 1), |inputs, _| {
        inputs.iter_mut().step_by(6).for_each(|value| *value = 77.0);
    });
    let slips = changed(measured(1000, 1), |_, outputs| {
        for (line, outputs) in outputs.chunks_exact_mut(2).enumerate() {
            outputs[1] = if line % 250 == 3 { 1.0 } else { 0.0 };
        }
    });
    let reached_once = changed(log(3000, rare), |inputs, _| {
        inputs.iter_mut().skip(1).step_by(4).for_each(|value| *value = 100.0);
        inputs[4 * 500 + 1] = 160.0;
    });
    let logs = [
        log(3000, rare),
        log(400, rare),
        log(20_000, |line| line % 600 == 0),
        log(20_000, |line| (7000..7200).contains(&line)),
    ];
    let sound = [1, 5, 25, 100, 1000, 3000].map(|lines| measured(lines, 1));
    let others = [clusters, constant, slips, reached_once, impacts(12.0)];
    for data in sound.iter().chain(&logs).chain(&others) {
        let outliers = outliers(data);
        assert_eq!(outliers.found, [], "{} lines", data.frames());
        assert_eq!((outliers.kept.len(), outliers.left_out), (data.frames(), false));
    }
}

#[test]
fn outliers_of_any_size_are_found_in_any_data() {
    let far = changed(measured(3000, 1), |inputs, outputs| {
        for (line, value) in [(10, 1e3), (20, 1e4), (30, 1e6), (40, -1e6), (50, -1e3)] {
            inputs[6 * line] = value;
        }
        outputs[2 * 60] = -40.0;
    });
    assert_eq!(lines(&far), [12, 22, 32, 42, 52, 62]);
    // A broken wire at rest, and one during a press, where only the other presses tell.
    let broken = changed(log(3000, |line| line % 100 == 0), |inputs, _| {
        (inputs[4 * 77 + 2], inputs[4 * 300 + 1]) = (1000.0, 1e4);
    });
    assert_eq!(lines(&broken), [79, 302]);
    // What one line has alone may be garbled, and a reading that no force goes with is an outlier. Nor do a small force
    // with a wild reading and a large force confirm one another.
    assert_eq!(lines(&impacts(0.0)), [902, 902, 3102]);
    assert!(lines(&impacts(0.05)).len() >= 3);
    let gaps = changed(measured(300, 1), |inputs, _| {
        inputs.iter_mut().step_by(7).for_each(|value| *value = f64::NAN);
        inputs[6 * 200 + 1] = -1e5;
    });
    let rest = Dataset { inputs: gaps.inputs, ..Dataset::empty(vec![], vec![], 1, 0) };
    assert_eq!(lines(&rest), [202], "without outputs");
}

#[test]
fn an_outlier_is_named_and_its_line_left_out() {
    // Six values of one line: lines are counted.
    let mut data = measured(1000, 1);
    data.inputs.values[6 * 500..6 * 501].fill(1e6);
    let found = outliers(&data);
    assert_eq!((found.found.len(), found.lines, found.left_out), (6, 1, true));
    let first = &found.found[0];
    assert_eq!((first.line, first.column.as_str(), first.value), (502, "ch1", 1e6));
    assert!(first.usual[0] > 20.0 && first.usual[1] < 60.0, "{:?}", first.usual);
    assert!(found.kept.len() == 999 && !found.kept.contains(&500));
    // Those that are too many are kept.
    let mut data = measured(1000, 1);
    for line in 0..12 {
        data.inputs.values[6 * (80 * line) + line % 6] = 1e4;
    }
    let found = outliers(&data);
    assert_eq!((found.found.len(), found.lines, found.left_out), (12, 12, false));
    assert_eq!(found.kept.len(), 1000);
}

#[test]
fn the_gap_of_an_outlier_is_wider_in_few_lines() {
    // One line, at four times the range of all others.
    let far = |lines: usize| {
        let mut data = measured(lines, 1);
        let (low, high) = (35.0, 60.0);
        for (line, value) in data.inputs.values.iter_mut().step_by(6).enumerate() {
            *value = low + (high - low) * line as f64 / lines as f64;
        }
        data.inputs.values[0] = high + 4.0 * (high - low);
        outliers(&data).lines
    };
    assert_eq!([100, 200, 1000].map(far), [0, 0, 1]);
}

#[test]
fn wild_values_do_not_hide_each_other() {
    for ratio in [1.01, 1.5, 2.5, 4.0, 30.0] {
        let two = changed(measured(1000, 1), |inputs, _| {
            (inputs[6 * 17], inputs[6 * 530]) = (1e6, 1e6 / ratio);
        });
        assert_eq!(lines(&two), [19, 532], "ratio {ratio}");
    }
    let mut random = Random::new(9, Stream::Test, Purpose::Noise, 0, 0);
    for draw in 0..20 {
        let three = changed(measured(1000, 1), |inputs, _| {
            for line in [3, 400, 999] {
                inputs[6 * line] = random.between([1000.0, 65_535.0]);
            }
        });
        assert_eq!(lines(&three).len(), 3, "draw {draw}");
    }
}

#[test]
fn values_that_spread_as_far_as_their_gap_are_no_outliers() {
    let bulk = || (0..1000).map(|i| f64::from(i) / 1000.0);
    let far = |values: [f64; 2]| {
        let mut data = Dataset::empty(vec!["ch1".into()], vec![], 1, 0);
        data.inputs.values.extend(bulk().chain(values));
        outliers(&data).lines
    };
    assert_eq!(far([6.0, 6.5]), 2);
    assert_eq!(far([6.0, 12.0]), 0, "honest touches reach any depth");
    assert_eq!(far([40.0, 90.0]), 2, "too far for that");
}
