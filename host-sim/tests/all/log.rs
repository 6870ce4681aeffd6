//! Logs: lines at rest, readings that drift, and errors over time.

use std::fmt::Write as _;

use serde_json::Value;

use crate::common::Folder;

/// Log of four channels whose gains drift by 5 to 20 % in ten minutes: presses of one second with pauses of one second, ten
/// lines a second, in which the place is missing.
fn log(drift: f64) -> String {
    let mut csv = String::from("time_s,ch1,ch2,ch3,ch4,x_mm,f_n\n");
    for line in 0..3000_u32 {
        let (time, press) = (f64::from(line) / 10.0, line / 20);
        let along = f64::from(line % 20) / 10.0;
        let x = f64::from(press * 37 % 101) / 101.0;
        let most = 1.0 + f64::from(press * 53 % 97) / 40.0;
        let force = if along < 1.0 { most * (std::f64::consts::PI * along).sin() } else { 0.0 };
        let _ = write!(csv, "{time}");
        for channel in 0..4 {
            let near = (-(4.0 * x - f64::from(channel)).powi(2)).exp();
            let gain = 1.0 + drift * f64::from(channel + 1) / 4.0 * time / 300.0;
            let noise = f64::from((line * 31 + channel * 17) % 23) / 230.0;
            let _ = write!(csv, ",{:.3}", gain * (50.0 + 8.0 * force * near + noise));
        }
        let place = if force > 0.0 { format!("{x:.4}") } else { String::new() };
        let _ = writeln!(csv, ",{place},{force:.4}");
    }
    csv
}

const COLUMNS: [&str; 7] =
    ["--inputs", "ch*", "--outputs", "x_mm,f_n", "--no-refine", "--centres", "32"];

/// RMSE of the force in the first decoder's errors.
fn force_rmse(document: &Value) -> f64 {
    let errors = document["decoders"][0]["errors"].as_array().unwrap();
    errors.iter().find(|it| it["group"] == "f_n").unwrap()["rmse"].as_f64().unwrap()
}

fn warnings(document: &Value) -> Vec<&str> {
    let warnings = document["verdict"]["warnings"].as_array().unwrap();
    warnings.iter().map(|it| it["name"].as_str().unwrap()).collect()
}

#[test]
fn a_drift_at_rest_is_named_and_the_baseline_of_each_pause_takes_it_out() {
    let folder = Folder::new("log-drift");
    folder.write("log.csv", log(0.2));
    let run = [&["run", "log.csv"], &COLUMNS[..]].concat();
    let plain = folder.json(&run);
    assert_eq!(warnings(&plain), ["drift-at-rest"]);
    let rest = &plain["data"]["over_time"]["rest"];
    // Eleven lines without force in each of 150 pauses, less the first and the last.
    assert_eq!((&rest["lines"], &rest["percent_of"]), (&Value::from(1350), &Value::from("rest")));
    assert_eq!(
        (&rest["most"], &rest["span"]),
        (&Value::from("ch4"), &Value::from("in 5.0 minutes"))
    );
    let most = rest["drifts"][0]["percent"].as_f64().unwrap();
    assert!((16.0..18.0).contains(&most), "{most}");
    let ratio = rest["relative_trial"]["ratio"].as_f64().unwrap();
    let relative = folder.json(&[&run[..], &["--relative-inputs"]].concat());
    let gained = force_rmse(&relative) / force_rmse(&plain);
    // The trial judges by lines that it was not trained on, as `run` does.
    let tried = rest["relative_trial"]["rmse"][1].as_f64().unwrap() / force_rmse(&plain);
    assert!((0.65..1.5).contains(&tried), "{tried}");
    assert!(ratio < 0.7 && gained < 0.7, "{ratio} {gained}");
    assert_eq!(warnings(&relative), [""; 0]);
    let words = relative["verdict"]["sentence"].as_str().unwrap();
    assert!(words.contains("errors at the end of the log"), "{words}");
    let page = std::fs::read_to_string(folder.path("out/log/report.html")).unwrap();
    assert!(
        page.contains("Over time")
            && page.contains("time in min")
            && page.contains("ch4 changes most")
    );

    // A sensor that stays as it was is not warned of.
    folder.write("still.csv", log(0.0));
    let still = folder.json(&[&["run", "still.csv"], &COLUMNS[..]].concat());
    assert_eq!(warnings(&still), [""; 0]);
    assert_eq!(still["data"]["over_time"]["rest"]["drifts"], serde_json::json!([]));
}

#[test]
fn a_model_with_relative_inputs_takes_the_baseline_from_the_log_that_it_decodes() {
    let folder = Folder::new("log-relative");
    folder.write("log.csv", log(0.2));
    let train =
        [&["train", "log.csv", "--first-share", "0.8", "-o", "m.bin"], &COLUMNS[..]].concat();
    folder.succeed(&[&train[..], &["--relative-inputs"]].concat());
    let eval = ["eval", "m.bin", "log.csv", "--last-share", "0.2", "--html", "eval.html"];
    let judged = folder.json(&eval);
    let run = [&["run", "log.csv", "--relative-inputs", "--json"], &COLUMNS[..]].concat();
    let run: Value = serde_json::from_str(&folder.succeed(&run)).unwrap();
    assert!(
        run["verdict"]["sentence"].as_str().unwrap().contains("renewed in each pause"),
        "{run}"
    );
    let ratio = force_rmse(&judged) / force_rmse(&run);
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
    assert!(std::fs::read_to_string(folder.path("eval.html")).unwrap().contains("Over time"));
    // The model knows the first lines, and all of them together.
    for share in [&["--first-share", "0.8"][..], &["--last-share", "0.5"], &[]] {
        let flattered = folder.json(&[&eval[..3], share].concat());
        assert_eq!(warnings(&flattered), ["judged-by-training-data"], "{share:?}");
    }
    assert_eq!(warnings(&judged), [""; 0]);
    // `decode` has the same baseline, and a file without the force has none.
    folder.succeed(&["decode", "m.bin", "log.csv", "-o", "estimates.csv"]);
    let of_force = |name: &str, column: usize| -> Vec<f64> {
        let text = std::fs::read_to_string(folder.path(name)).unwrap();
        let fields = text.lines().skip(1).map(|line| line.split(',').nth(column).unwrap().parse());
        fields.map(Result::unwrap).collect()
    };
    let squares: f64 = of_force("log.csv", 6)
        .iter()
        .zip(of_force("estimates.csv", 1))
        .map(|(truth, estimate)| (truth - estimate).powi(2))
        .sum();
    assert!((squares / 3000.0).sqrt() < 1.25 * force_rmse(&judged));
    let text = log(0.2);
    let without: Vec<&str> = text.lines().map(|line| line.rsplit_once(',').unwrap().0).collect();
    folder.write("readings.csv", without.join("\n") + "\n");
    let refused = folder.fail(&["decode", "m.bin", "readings.csv", "-o", "e.csv"], 2);
    assert!(refused.contains("--baseline FILE") && refused.contains("--rest"), "{refused}");
    // Another column may tell it.
    folder.succeed(&["decode", "m.bin", "log.csv", "--rest", "f_n", "-o", "e.csv"]);
    assert_eq!(of_force("e.csv", 1), of_force("estimates.csv", 1));
}

#[test]
fn folds_of_a_log_are_blocks_and_those_of_shuffled_lines_are_not() {
    let folder = Folder::new("log-folds");
    let text = log(0.0);
    folder.write("log.csv", &text);
    let mut lines: Vec<&str> = text.lines().collect();
    let mut shuffled: Vec<&str> = (0..3000).map(|i| lines[1 + i * 1237 % 3000]).collect();
    shuffled.insert(0, lines[0]);
    lines.clear();
    folder.write("shuffled.csv", shuffled.join("\n") + "\n");
    let train = |name: &str, more: &[&str]| -> Vec<u8> {
        let columns = ["--inputs", "ch*", "--outputs", "f_n", "--centres", "16", "-o", "m.bin"];
        folder.succeed(&[&["train", name], &columns[..], more].concat());
        std::fs::read(folder.path("m.bin")).unwrap()
    };
    let blocks = train("log.csv", &["--fold-blocks", "5"]);
    assert_eq!(train("log.csv", &[]), blocks);
    assert_ne!(train("log.csv", &["--folds", "5"]), blocks);
    assert_eq!(train("shuffled.csv", &[]), train("shuffled.csv", &["--folds", "5"]));
    let flattered = folder.succeed(&[
        "train",
        "log.csv",
        "--inputs",
        "ch*",
        "--outputs",
        "f_n",
        "--centres",
        "16",
        "--folds",
        "5",
        "--json",
        "-o",
        "m.bin",
    ]);
    let flattered: Value = serde_json::from_str(&flattered).unwrap();
    assert_eq!(warnings(&flattered), ["random-folds-of-a-log"]);
}

#[test]
fn lines_at_rest_that_are_not_there_are_asked_for() {
    let folder = Folder::new("log-no-rest");
    folder.write("log.csv", log(0.0));
    let train = [&["train", "log.csv", "--relative-inputs", "-o", "m.bin"], &COLUMNS[..]].concat();
    for (rest, words) in [
        ("none", "no line is known to be at rest"),
        ("ch1", "no ten lines are within 1 % of zero"),
        ("touch", "no column matches \"touch\""),
    ] {
        let refused = folder.fail(&[&train[..], &["--rest", rest]].concat(), 2);
        assert!(refused.contains(words) && refused.contains("--rest"), "{refused}");
    }
    let run = [&["run", "log.csv", "--time", "ch2"], &COLUMNS[..]].concat();
    let refused = folder.fail(&run, 2);
    assert!(refused.contains("is earlier than") && refused.contains("(--time)"), "{refused}");
    // An offset of the force, and a time that goes back.
    let offset = |line: &str| match line
        .rsplit_once(',')
        .map(|(rest, force)| (rest, force.parse::<f64>()))
    {
        Some((rest, Ok(force))) => format!("{rest},{}\n", force + 0.3),
        _ => format!("{line}\n"),
    };
    let text = log(0.0).replace("\n4.5,", "\n1.5,");
    folder.write("offset.csv", text.lines().map(offset).collect::<Vec<_>>().concat());
    let output = folder.run(&[&["run", "offset.csv"], &COLUMNS[..]].concat());
    let notes = String::from_utf8(output.stderr).unwrap();
    for words in [
        "f_n is within 1 % of zero; has it an offset?",
        "time_s is not taken for the time: line 47 is before",
    ] {
        assert!(notes.contains(words), "{words}: {notes}");
    }
}

#[test]
fn the_unit_of_an_output_that_is_there_in_pauses_changes_no_other() {
    let folder = Folder::new("log-units");
    folder.write("n.csv", log(0.1));
    let in_mn = |line: &str| {
        let (rest, force) = line.rsplit_once(',').unwrap();
        format!("{rest},{}\n", 1000.0 * force.parse::<f64>().unwrap())
    };
    let text = log(0.1);
    let lines: Vec<String> = text.lines().skip(1).map(in_mn).collect();
    folder.write(
        "mn.csv",
        format!("{}\n{}", text.lines().next().unwrap().replace("f_n", "f_mN"), lines.concat()),
    );
    let place = |file: &str, outputs: &str| {
        let run =
            ["run", file, "--inputs", "ch*", "--outputs", outputs, "--centres", "8", "--json"];
        let document: Value = serde_json::from_str(&folder.succeed(&run)).unwrap();
        let over_time = document["data"]["over_time"]["mean_rmse"][0].as_f64().unwrap();
        (document["decoders"][0]["errors"][0]["rmse"].as_f64().unwrap(), over_time)
    };
    let ((n, mean), (mn, mean_mn)) = (place("n.csv", "x_mm,f_n"), place("mn.csv", "x_mm,f_mN"));
    assert!(
        (n / mn - 1.0).abs() < 0.01 && (mean / mean_mn - 1.0).abs() < 1e-9,
        "{n} {mn} {mean} {mean_mn}"
    );
    // The place is uniform on 0 to 1.
    assert!((0.2..0.4).contains(&mean), "{mean}");
}

#[test]
fn a_reading_that_dies_in_a_log_takes_no_baseline_from_the_others() {
    let folder = Folder::new("log-dead");
    folder.write("log.csv", log(0.0));
    let train = [&["train", "log.csv", "--relative-inputs", "-o", "m.bin"], &COLUMNS[..]].concat();
    folder.succeed(&train);
    let without = |line: &str| {
        let fields = line.split(',').enumerate();
        let kept = fields.map(|(i, field)| if i == 3 && field != "ch3" { "" } else { field });
        kept.collect::<Vec<_>>().join(",") + "\n"
    };
    folder.write("dead.csv", log(0.0).lines().map(without).collect::<Vec<_>>().concat());
    let output = folder.run(&["decode", "m.bin", "dead.csv", "-o", "e.csv"]);
    let notes = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && notes.contains("are at rest"), "{notes}");
}
