//! What `train` makes of measured data as they are: outliers, few lines, columns that never change.

use crate::common::Folder;
use std::fmt::Write as _;

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// Lines of two channels and an output that follows them.
fn lines(count: usize) -> Vec<[f64; 3]> {
    let line = |i: usize| {
        let (a, b) = ((i * 37 % 101) as f64 / 101.0, (i * 53 % 97) as f64 / 97.0);
        [40.0 + 10.0 * a, 60.0 - 5.0 * b, (3.0 * a).sin() + b]
    };
    (0..count).map(line).collect()
}

fn write(folder: &Folder, name: &str, lines: &[[f64; 3]]) {
    let line = |[a, b, y]: &[f64; 3]| format!("{a},{b},{y}\n");
    folder.write(name, format!("a,b,y\n{}", lines.iter().map(line).collect::<String>()));
}

/// Trains on a file and returns stdout and stderr.
fn train(folder: &Folder, name: &str, more: &[&str]) -> (String, String) {
    let usual = ["train", name, "--inputs", "a,b", "--outputs", "y", "--no-refine", "-o", "m.bin"];
    let output = folder.run(&[&usual[..], more].concat());
    let [stdout, stderr] = [output.stdout, output.stderr].map(|b| String::from_utf8(b).unwrap());
    assert!(output.status.success(), "{stderr}");
    (stdout, stderr)
}

#[test]
fn outliers_are_named_left_out_and_listed_in_json() {
    let folder = Folder::new("measured-outliers");
    let clean = lines(400);
    write(&folder, "clean.csv", &clean);
    let mut wild = clean.clone();
    wild[99] = [1e6, 1e6, 0.5];
    wild[299][2] = -500.0;
    write(&folder, "wild.csv", &wild);

    let (_, notes) = train(&folder, "clean.csv", &["--centres", "8"]);
    assert!(!notes.contains("far from all others"), "{notes}");
    let (printed, notes) = train(&folder, "wild.csv", &["--centres", "8", "--json"]);
    assert!(notes.contains("2 of 400 lines of wild.csv hold a value far"), "{notes}");
    assert!(notes.contains("line 101: a = 1000000, where others are 40 to"), "{notes}");
    assert!(notes.contains("line 301: y = -500"), "{notes}");
    let summary = json(&printed);
    assert_eq!(summary["training_frames"], 398);
    assert_eq!(summary["outliers"]["found"][1]["column"], "b");
    assert_eq!(summary["outliers"]["lines"], 2);
    // Lines are counted, not values.
    let mut more = lines(1500);
    (0..7).for_each(|line| more[50 * line + 9] = [1e6, 1e6, 0.5]);
    write(&folder, "more.csv", &more);
    let (_, notes) = train(&folder, "more.csv", &["--centres", "8"]);
    assert!(
        notes.contains("7 of 1500 lines of more.csv") && notes.contains("and 2 more lines"),
        "{notes}"
    );

    let rmse = |name: &str, more: &[&str]| {
        train(&folder, name, &[&["--centres", "8"], more].concat());
        let evaluated = folder.json(&["eval", "m.bin", "clean.csv"]);
        evaluated["decoders"][0]["errors"][0]["rmse"].as_f64().unwrap()
    };
    let (of_clean, of_wild) = (rmse("clean.csv", &[]), rmse("wild.csv", &[]));
    assert!((of_wild / of_clean - 1.0).abs() < 0.05, "{of_wild} {of_clean}");
    assert!(rmse("wild.csv", &["--keep-outliers"]) > 2.0 * of_clean);
}

#[test]
fn dead_constant_and_duplicate_inputs_are_named_and_left_out() {
    let folder = Folder::new("measured-unused");
    let mut text = String::from("a,b,dead,flat,twin,bit,y\n");
    for (i, [a, b, y]) in lines(200).into_iter().enumerate() {
        let dead = if i % 3 == 0 { "1.5" } else { "" };
        let bit = i * i * 31 % 101 % 2;
        let _ = writeln!(text, "{a},{b},{dead},7,{a},{bit},{y}");
    }
    folder.write("all.csv", &text);
    // The file to judge by has them all, and follows the columns of the file to train on.
    let others: Vec<String> =
        text.lines().map(|line| format!("{}\n", line.replace(",7,", ",8,"))).collect();
    folder.write("test.csv", [&others[..1], &others[2..]].concat().concat());
    let usual =
        ["--inputs", "a,b,dead,flat,twin,bit", "--outputs", "y", "--no-refine", "--centres", "8"];
    let run = [&["run", "all.csv", "--test", "test.csv", "--json"], &usual[..]].concat();
    let output = folder.run(&run);
    let [printed, notes] = [output.stdout, output.stderr].map(|b| String::from_utf8(b).unwrap());
    assert!(output.status.success(), "{notes}");
    for note in [
        "note: dead has no value in more than half of the lines in all.csv; left out of the model",
        "note: flat never changes in all.csv; left out of the model",
        "note: bit flickers between two values, whatever the outputs are, in all.csv; left out of the model",
        "note: twin = a in every line in all.csv; left out of the model",
    ] {
        assert!(notes.contains(note), "{notes}");
    }
    let result = json(&printed);
    assert_eq!(result["model"]["inputs_per_network"][0], 2);
    assert_eq!(result["model"]["training_frames"], 200);
    let unused = &result["data"]["unused_inputs"];
    assert_eq!(unused["duplicated"], serde_json::json!([["twin", "a"]]));
}

#[test]
fn run_needs_frames_to_judge_by() {
    let folder = Folder::new("measured-run");
    write(&folder, "all.csv", &lines(100));
    write(&folder, "short.csv", &lines(4));
    let usual = ["--inputs", "a,b", "--outputs", "y", "--no-refine", "--centres", "8"];
    let fail = |words: &[&str]| folder.fail(&[words, &usual].concat(), 2);
    let none = fail(&["run", "short.csv"]);
    assert!(none.contains("no test frames"), "{none}");
    let other = fail(&["run", "all.csv", "--test", "m.bin"]);
    assert!(other.contains("m.bin"), "{other}");
}
