//! Data files as sensors and scripts leave them: two logs, no header, codes for missing values, numpy's arrays.

use std::fmt::Write as _;

use crate::common::Folder;

/// Distance of the scale's clock from the sensor's, in seconds: the scale's reads less.
const LAG_S: f64 = 2.5;
/// Time of the sensor's first line, in seconds.
const START_S: f64 = 1_743_486_221.590_758;

/// Force at a time of the sensor's clock.
fn force(time_s: f64) -> f64 {
    50.0 + 40.0 * (0.7 * (time_s - START_S)).sin()
}

/// Log of a sensor at about 30 lines a second: time and three readings of the force, without a header.
fn sensor_log(lines: u32) -> String {
    let mut text = String::new();
    for line in 0..lines {
        let jitter = 0.004 * f64::from(line * 37 % 11) / 11.0;
        let time = START_S + f64::from(line) / 30.0 + jitter;
        let force = force(time);
        let readings = [2.0 * force, 100.0 - force, 0.01 * force * force];
        let _ = writeln!(text, "{time},{},{},{}", readings[0], readings[1], readings[2]);
    }
    text
}

/// Log of a scale at about 80 lines a second, with a clock of its own: time, force, and −1 where it gave none.
fn scale_log(lines: u32) -> String {
    let mut text = String::new();
    for line in 0..lines {
        let time = START_S - 1.0 + f64::from(line) / 80.0 + 0.001 * f64::from(line * 13 % 7) / 7.0;
        let value = if line % 10 == 3 { -1.0 } else { force(time) };
        let _ = writeln!(text, "{},{value}", time - LAG_S);
    }
    text
}

/// Fields of each line of a CSV file, the header included.
fn fields(folder: &Folder, name: &str) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(folder.path(name)).unwrap();
    text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

/// Stderr of a command that succeeds.
fn notes(folder: &Folder, arguments: &[&str]) -> String {
    let output = folder.run(arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{arguments:?}: {stderr}");
    stderr
}

/// Runs a command and expects a refusal that contains all of `says`.
fn refused(folder: &Folder, arguments: &[&str], says: &[&str]) {
    let output = folder.run(arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
    for part in says {
        assert!(stderr.contains(part), "{arguments:?}: {part:?} is not in {stderr:?}");
    }
}

/// Sensor and scale log; the last 50 of the sensor's 600 lines are later than the scale's last.
fn two_logs(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("sensor.csv", sensor_log(600));
    let end = (1.0 + 550.0 / 30.0 - 0.02) * 80.0;
    folder.write("scale.csv", scale_log(end as u32));
    folder
}

const BY_TIME: [&str; 6] = ["--on", "c1", "--tolerance", "0.008", "--lag", "2.5"];

#[test]
fn two_logs_with_lag_jitter_and_missing_codes_are_joined() {
    let folder = two_logs("join");
    let join =
        [&["join", "sensor.csv", "scale.csv", "-o", "j.csv", "--missing", "-1"], &BY_TIME[..]];
    let said = notes(&folder, &join.concat());
    assert!(said.contains("sensor.csv names no columns: they are called c1 to c4 "), "{said}");
    assert!(said.contains("values of scale.csv are -1, and count as missing"), "{said}");
    assert!(said.contains("0 values of sensor.csv are -1"), "{said}");
    assert!(said.contains("550 of 600 lines of sensor.csv have a partner in scale.csv"), "{said}");
    assert!(said.contains("50 are left out; the partner's columns are b.c1, b.c2"), "{said}");
    let joined = fields(&folder, "j.csv");
    assert_eq!(joined[0], ["c1", "c2", "c3", "c4", "b.c1", "b.c2"]);
    assert_eq!(joined.len(), 551);
    let sensor = fields(&folder, "sensor.csv");
    let mut missing = 0;
    for (line, of_sensor) in joined[1..].iter().zip(&sensor) {
        assert_eq!(line[..4], of_sensor[..]); // no digit of the time is lost
        let [time, other]: [f64; 2] = [0, 4].map(|column| line[column].parse().unwrap());
        assert!((other + LAG_S - time).abs() <= 0.0075, "{line:?}");
        if line[5].is_empty() {
            missing += 1;
        } else {
            let value: f64 = line[5].parse().unwrap();
            assert!((value - force(time)).abs() < 40.0 * 0.7 * 0.0075, "{line:?}");
        }
    }
    assert!((30..90).contains(&missing), "{missing} of 550");
}

#[test]
fn a_model_of_joined_logs_decodes_the_sensor_alone_and_decoding_keeps_the_time_as_it_stands() {
    let folder = two_logs("train-join");
    let columns = ["--inputs", "c2..c4", "--outputs", "b.c2", "--no-refine", "--centres", "8"];
    folder.succeed(
        &[&["join", "sensor.csv", "scale.csv", "-o", "j.csv", "--missing", "-1"], &BY_TIME[..]]
            .concat(),
    );
    folder.succeed(&[&["train", "j.csv", "-o", "joined.bin"], &columns[..]].concat());
    let text = folder.succeed(&["eval", "joined.bin", "j.csv", "--json"]);
    let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
    let error = summary["decoders"][0]["errors"][0]["rmse"].as_f64().unwrap();
    assert!(error < 0.2, "{error}"); // the scale is read up to 7 ms apart

    let kept = ["--keep", "c1,c3", "-o", "e.csv"];
    folder.succeed(&[&["decode", "joined.bin", "sensor.csv"], &kept[..]].concat());
    let (estimates, sensor) = (fields(&folder, "e.csv"), fields(&folder, "sensor.csv"));
    assert_eq!(estimates[0], ["c1", "c3", "b.c2", "status"]);
    assert_eq!(estimates.len(), 601);
    for (line, of_sensor) in estimates[1..].iter().zip(&sensor) {
        assert_eq!([&line[0], &line[1]], [&of_sensor[0], &of_sensor[2]]);
        let value: f32 = line[2].parse().unwrap();
        assert_eq!(value.to_string(), line[2]);
    }
}

#[test]
fn whole_numbers_of_any_length_are_kept_and_joined_as_they_are_written() {
    let folder = Folder::new("long-numbers");
    let log = |more: i64| -> String {
        let time = |line: i64| 1_743_486_221_590_758_123 + 100 * line + more;
        let line = |line: i64| format!("{},0{}.50,{}\n", time(line), line, line * line);
        (0..60).map(line).collect::<Vec<_>>().concat()
    };
    folder.write("a.csv", format!("t_ns,x,y\n{}", log(0)));
    folder.write("b.csv", format!("t_ns,x,y\n{}", log(7)));
    folder.succeed(&["join", "a.csv", "b.csv", "--on", "t_ns", "--tolerance", "7", "-o", "j.csv"]);
    let [a, b, joined] = ["a.csv", "b.csv", "j.csv"].map(|name| fields(&folder, name));
    for line in 1..=60 {
        assert_eq!(joined[line], [&a[line][..], &b[line]].concat());
    }
    let columns = ["--inputs", "x", "--outputs", "y", "--no-refine", "--centres", "4"];
    folder.succeed(&[&["train", "a.csv", "-o", "m.bin"], &columns[..]].concat());
    folder.succeed(&["decode", "m.bin", "a.csv", "--keep", "t_ns,x", "-o", "e.csv"]);
    let estimates = fields(&folder, "e.csv");
    for line in 0..=60 {
        assert_eq!(estimates[line][..2], a[line][..2]);
    }
}

#[test]
fn arrays_and_text_train_the_same_model() {
    let folder = Folder::new("arrays");
    let values: Vec<[f64; 3]> =
        (0..60).map(|i| f64::from(i) / 60.0).map(|x| [x, (5.0 * x).sin(), x * x]).collect();
    let line = |[a, b, c]: &[f64; 3]| format!("{a},{b},{c}");
    let text = values.iter().map(line).collect::<Vec<_>>().join("\n");
    folder.write("d.csv", &text);
    folder.write("d.npy", npy(&values));
    let columns = ["--inputs", "c1,c2", "--outputs", "c3", "--no-refine", "--centres", "5"];
    let mut estimates = vec![];
    for data in ["d.csv", "d.npy"] {
        let said = notes(&folder, &[&["train", data, "-o", "m.bin"], &columns[..]].concat());
        assert!(said.contains("names no columns"), "{said}");
        folder.succeed(&["decode", "m.bin", data, "-o", "e.csv"]);
        estimates.push(std::fs::read_to_string(folder.path("e.csv")).unwrap());
    }
    assert_eq!(estimates[0], estimates[1]);
    // A header of numbers is taken as one if that is said.
    folder.write("numbered.csv", format!("1,2,3\n{text}"));
    let named = ["--inputs", "1,2", "--outputs", "3", "--no-refine", "--centres", "5", "--header"];
    folder.succeed(&[&["train", "numbered.csv", "-o", "m.bin"], &named[..]].concat());
    folder.succeed(&["decode", "m.bin", "numbered.csv", "--header", "-o", "e.csv"]);
    let numbered = std::fs::read_to_string(folder.path("e.csv")).unwrap();
    assert_eq!(numbered.replacen("3,", "c3,", 1), estimates[0]);
}

/// Bytes of a `.npy` file with an array of f64, by numpy's description of format 1.0.
fn npy(values: &[[f64; 3]]) -> Vec<u8> {
    let shape = format!("({}, 3)", values.len());
    let dictionary = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
    let length = (10 + dictionary.len() + 1).next_multiple_of(64) - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(format!("{dictionary:<0$}\n", length - 1).bytes());
    bytes.extend(values.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
    bytes
}

#[test]
fn wrong_usage_of_data_files_is_refused() {
    let folder = two_logs("refused-data");
    let join = |more: &[&'static str]| {
        [&["join", "sensor.csv", "scale.csv", "-o", "j.csv"], more].concat()
    };
    for (options, says) in [
        (
            &["--on", "time", "--tolerance", "1"][..],
            &["sensor.csv", "\"time\" is missing", "c1, c2", "--on"][..],
        ),
        (&["--on", "c1,c3", "--tolerance", "1"], &["scale.csv", "\"c3\" is missing", "--on"]),
        (&["--on", "c1,c1,c1", "--tolerance", "1"], &["--on c1,c1,c1", "one for each file"]),
        (&["--on", "c1", "--tolerance", "-1"], &["--tolerance -1", "from 0"]),
        (&["--on", "c1", "--tolerance", "1", "--lag", "inf"], &["--lag inf", "time"]),
        (
            &["--on", "c1", "--tolerance", "0.008", "--lag", "9000"],
            &["sensor.csv", "tolerance = 0.008", "nearest are 8976.5", "--lag"],
        ),
        (&["--on", "c2", "--tolerance", "1"], &["line", "column \"c2\"", "earlier than", "--on"]),
        (&["--on", "c1"], &["--tolerance"]),
    ] {
        refused(&folder, &join(options), says);
    }
    assert!(!folder.path("j.csv").exists());
    let train = |more: &[&'static str]| {
        let columns = ["--inputs", "c2..c3", "--outputs", "c4", "-o", "m.bin", "--no-refine"];
        [&["train", "sensor.csv"], &columns[..], more].concat()
    };
    for (options, says) in [
        (&["--first-share", "1.5"][..], &["--first-share 1.5", "up to 1"][..]),
        (&["--last-share", "0.0001"], &["--last-share 0.0001", "no line of 600"]),
        (&["--first-share", "0.5", "--last-share", "0.5"], &["cannot be used with"]),
        (&["--fold-blocks", "1"], &["--fold-blocks 1", "from 2 to 600"]),
        (&["--inputs", "c2..c9"], &["\"c2..c9\"", "--inputs"]),
    ] {
        let mut arguments = train(options);
        if options[0] == "--inputs" {
            arguments.drain(2..4);
        }
        refused(&folder, &arguments, says);
    }
    for option in [&["--missing", "-1"][..], &["--header"], &["--first-share", "0.5"]] {
        let scene = [&["train", "press", "-o", "m.bin"], option].concat();
        refused(&folder, &scene, &[option[0], "data files", "leave it out"]);
    }
    folder.succeed(&[&train(&["--centres", "4"])[..], &[]].concat());
    refused(&folder, &["eval", "m.bin", "sensor.csv", "--html", "sensor.csv"], &["sensor.csv"]);
    assert!(std::fs::read_to_string(folder.path("sensor.csv")).unwrap().contains(','));
    let decode = ["decode", "m.bin", "sensor.csv", "-o", "e.csv", "--keep"];
    refused(&folder, &[&decode[..], &["time"]].concat(), &["\"time\" is missing", "--keep"]);
    refused(&folder, &[&decode[..], &["c4"]].concat(), &["--keep c4", "column of that name"]);
    for name in ["novelty_nats", "c4_deviation"] {
        let assessed = [&decode[..], &[name, "--confidence"]].concat();
        refused(&folder, &assessed, &["--keep", name, "column of that name"]);
    }
    refused(&folder, &[&decode[..], &["c2,c2"]].concat(), &["--keep c2", "once"]);
    folder.write("d.npy", "1,2\n");
    let array = ["train", "d.npy", "--inputs", "c1", "--outputs", "c2", "-o", "x.bin"];
    refused(&folder, &array, &["d.npy", "not a .npy file", "numpy.save"]);
}
