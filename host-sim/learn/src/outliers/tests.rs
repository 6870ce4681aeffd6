use taxel_data::{Purpose, Random, Stream};

use super::*;

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
    let frames = data.inputs.values.chunks_exact_mut(4).zip(&mut data.outputs.values);
    for (line, (inputs, force)) in frames.enumerate() {
        *force = if pressed(line) { 1.0 + random.unit() } else { 0.001 * random.normal() };
        for (channel, value) in inputs.iter_mut().enumerate() {
            let reacts = channel == line % 4;
            *value = 100.0 + if reacts { 50.0 * *force } else { 0.0 } + 0.02 * random.normal();
        }
    }
    data
}

fn outliers(data: &Dataset) -> Outliers {
    find(data, |frame| frame as u64 + 2)
}

fn assert_none(data: &Dataset) {
    let outliers = outliers(data);
    assert_eq!(outliers.found, [], "{} lines", data.frames());
    assert_eq!(outliers.kept.len(), data.frames());
    assert!(!outliers.left_out);
}

#[test]
fn data_without_outliers_keeps_every_line() {
    for lines in [1, 5, 25, 100, 1000, 3000] {
        assert_none(&measured(lines, 1));
    }
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
fn a_wild_line_is_named_and_left_out() {
    let mut data = measured(3000, 1);
    data.inputs.values[6 * 1500..6 * 1501].fill(1e6);
    let outliers = outliers(&data);
    assert_eq!((outliers.found.len(), outliers.lines, outliers.left_out), (6, 1, true));
    let first = &outliers.found[0];
    assert_eq!((first.line, first.column.as_str(), first.value), (1502, "ch1", 1e6));
    assert!(first.usual[0] > 20.0 && first.usual[1] < 60.0, "{:?}", first.usual);
    assert_eq!(outliers.kept.len(), 2999);
    assert!(!outliers.kept.contains(&1500));
}

#[test]
fn outliers_of_any_size_and_on_both_sides_are_found() {
    let mut data = measured(3000, 1);
    for (line, value) in [(10, 1e3), (20, 1e4), (30, 1e6), (40, -1e6), (50, -1e3)] {
        data.inputs.values[6 * line] = value;
    }
    data.outputs.values[2 * 60] = -40.0;
    let lines: Vec<u64> = outliers(&data).found.iter().map(|outlier| outlier.line).collect();
    assert_eq!(lines, [12, 22, 32, 42, 52, 62]);
}

#[test]
fn rare_presses_of_a_log_at_rest_are_no_outliers() {
    assert_none(&log(3000, |line| line % 100 == 0));
    assert_none(&log(400, |line| line % 100 == 0));
    assert_none(&log(20_000, |line| line % 600 == 0));
    assert_none(&log(20_000, |line| (7000..7200).contains(&line)));
}

#[test]
fn two_impacts_that_confirm_one_another_are_no_outliers() {
    let mut data = log(4000, |_| false);
    for (line, force) in [(900, 8.0), (3100, 12.0)] {
        data.outputs.values[line] = force;
        data.inputs.values[4 * line + 1] = 100.0 + 50.0 * force;
    }
    assert_none(&data);
    // What one line has alone may be garbled, and a reading that no force goes with is an outlier.
    data.outputs.values[3100] = 0.0;
    let lines: Vec<u64> = outliers(&data).found.iter().map(|outlier| outlier.line).collect();
    assert_eq!(lines, [902, 902, 3102]);
    // Nor do a small force with a wild reading and a large force confirm one another.
    data.outputs.values[3100] = 0.05;
    assert!(outliers(&data).found.len() >= 3);
}

#[test]
fn a_broken_wire_is_found_in_a_log_at_rest() {
    let mut data = log(3000, |line| line % 100 == 0);
    data.inputs.values[4 * 77 + 2] = 1000.0;
    let found = outliers(&data).found;
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].line, found[0].column.as_str()), (79, "ch3"));
    // During a press, where only the other presses tell.
    data.inputs.values[4 * 300 + 1] = 1e4;
    let found = outliers(&data).found;
    assert_eq!(found.iter().map(|outlier| outlier.line).collect::<Vec<_>>(), [79, 302]);
}

#[test]
fn a_channel_that_few_presses_reach_is_no_outlier() {
    let mut data = log(3000, |line| line % 100 == 0);
    let channel = data.inputs.values.iter_mut().skip(1).step_by(4);
    channel.enumerate().filter(|(line, _)| *line != 500).for_each(|(_, value)| *value = 100.0);
    data.inputs.values[4 * 500 + 1] = 160.0;
    assert_none(&data);
}

#[test]
fn a_channel_that_is_constant_but_for_one_line_counts_that_line() {
    let mut data = measured(500, 1);
    data.inputs.values.iter_mut().step_by(6).for_each(|value| *value = 77.0);
    assert_none(&data);
    data.inputs.values[6 * 123] = 77.5;
    let outliers = outliers(&data);
    assert_eq!(outliers.found.len(), 1);
    assert_eq!((outliers.found[0].line, outliers.found[0].usual), (125, [77.0, 77.0]));
    assert_eq!(data.subset(&outliers.kept).inputs.ranges()[0], [77.0, 77.0]);
}

#[test]
fn two_clusters_are_no_outliers() {
    let mut data = measured(1000, 1);
    let column = data.inputs.values.iter_mut().step_by(6);
    column.enumerate().filter(|(line, _)| line % 10 < 3).for_each(|(_, value)| *value += 1e5);
    assert_none(&data);
}

#[test]
fn lines_that_are_too_many_for_outliers_are_reported_and_kept() {
    let mut data = measured(1000, 1);
    for line in 0..12 {
        data.inputs.values[6 * (80 * line) + line % 6] = 1e4;
    }
    let outliers = outliers(&data);
    assert_eq!((outliers.found.len(), outliers.lines, outliers.left_out), (12, 12, false));
    assert_eq!(outliers.kept.len(), 1000);
}

#[test]
fn missing_values_and_tables_without_outputs_are_no_obstacle() {
    let mut data = measured(300, 1);
    data.inputs.values.iter_mut().step_by(7).for_each(|value| *value = f64::NAN);
    data.inputs.values[6 * 200 + 1] = -1e5;
    let rest = Dataset { inputs: data.inputs, ..Dataset::empty(vec![], vec![], 1, 0) };
    let found = outliers(&rest).found;
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].line, found[0].column.as_str()), (202, "ch2"));
}

#[test]
fn wild_values_do_not_hide_each_other() {
    let clean = measured(1000, 1);
    for ratio in [1.01, 1.5, 2.5, 4.0, 30.0] {
        let mut two = clean.clone();
        two.inputs.values[6 * 17] = 1e6;
        two.inputs.values[6 * 530] = 1e6 / ratio;
        let lines: Vec<u64> = outliers(&two).found.iter().map(|outlier| outlier.line).collect();
        assert_eq!(lines, [19, 532], "ratio {ratio}");
    }
    let mut random = Random::new(9, Stream::Test, Purpose::Noise, 0, 0);
    for draw in 0..20 {
        let mut three = clean.clone();
        for line in [3, 400, 999] {
            three.inputs.values[6 * line] = random.between([1000.0, 65_535.0]);
        }
        assert_eq!(outliers(&three).found.len(), 3, "draw {draw}");
    }
}

#[test]
fn a_rare_event_of_an_output_that_is_else_constant_stays() {
    let mut slips = measured(1000, 1);
    for (line, outputs) in slips.outputs.values.chunks_exact_mut(2).enumerate() {
        outputs[1] = if line % 250 == 3 { 1.0 } else { 0.0 };
    }
    assert_none(&slips);
}

#[test]
fn values_that_spread_as_far_as_their_gap_are_no_outliers() {
    let bulk = || (0..1000).map(|i| f64::from(i) / 1000.0);
    let far = |values: [f64; 2]| far_above(&bulk().chain(values).collect::<Vec<_>>(), 0.0);
    assert_eq!(far([6.0, 6.5]), 2);
    assert_eq!(far([6.0, 12.0]), 0, "honest touches reach any depth");
    assert_eq!(far([40.0, 90.0]), 2, "too far for that");
}
