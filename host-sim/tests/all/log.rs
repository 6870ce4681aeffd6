//! Logs: lines at rest, readings that drift, and errors over time.

use std::fmt::Write as _;

use serde_json::Value;

use crate::common::{Folder, rmse};

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

fn force_rmse(document: &Value) -> f64 {
    rmse(&document["decoders"][0]["errors"], "f_n")
}

fn warnings(document: &Value) -> Vec<&str> {
    let warnings = document["verdict"]["warnings"].as_array().unwrap();
    warnings.iter().map(|it| it["name"].as_str().unwrap()).collect()
}

#[test]
fn drift_at_rest_is_reported_and_removed_by_renewed_baselines() {
    let folder = Folder::new("log-drift");
    folder.write("log.csv", log(0.2));
    let run = [&["run", "log.csv"], &COLUMNS[..]].concat();
    let plain = folder.json(&run);
    assert_eq!(warnings(&plain), ["drift-at-rest"]);
    let rest = &plain["over_time"]["rest"];
    // Eleven lines without force in each of 150 pauses, less the first and the last.
    assert_eq!((&rest["lines"], &rest["percent_of"]), (&Value::from(1350), &Value::from("rest")));
    assert_eq!(
        (&rest["most"], &rest["span"]),
        (&Value::from("ch4"), &Value::from("in 5.0 minutes"))
    );
    let most = rest["drifts"][0]["percent"].as_f64().unwrap();
    assert!((16.0..18.0).contains(&most), "{most}");
    let warning = plain["verdict"]["warnings"][0]["text"].as_str().unwrap();
    assert!(warning.contains("4 of 4 inputs drift in 5.0 minutes: ch4 by 1"), "{warning}");
    let relative = folder.json(&[&run[..], &["--relative-inputs"]].concat());
    let gained = force_rmse(&relative) / force_rmse(&plain);
    assert!(gained < 0.7, "{gained}");
    assert_eq!(warnings(&relative), [""; 0]);
    let words = relative["verdict"]["sentence"].as_str().unwrap();
    assert!(words.contains("errors at the end of the log"), "{words}");
    let page = folder.read("out/log/report.html");
    assert!(
        page.contains("Over time")
            && page.contains("time in min")
            && page.contains("ch4 changes most")
    );

    // A sensor that stays as it was is not warned of.
    folder.write("still.csv", log(0.0));
    let still = folder.json(&[&["run", "still.csv"], &COLUMNS[..]].concat());
    assert_eq!(warnings(&still), [""; 0]);
    assert_eq!(still["over_time"]["rest"]["drifts"], serde_json::json!([]));
}

#[test]
fn places_that_are_logged_in_pauses_count_as_missing() {
    let folder = Folder::new("log-idle");
    let empty = log(0.0);
    // A machine that stands idle has a place, too.
    folder.write("empty.csv", &empty);
    folder.write("idle.csv", empty.replace(",,", ",0.9,"));
    let of = |name: &str| folder.json(&[&["run", name], &COLUMNS[..]].concat());
    let [empty, idle] = ["empty.csv", "idle.csv"].map(of);
    let x = |document: &Value| rmse(&document["decoders"][0]["errors"], "x_mm");
    assert!((x(&idle) / x(&empty) - 1.0).abs() < 0.2, "{} {}", x(&idle), x(&empty));
    let output = folder.run(&[&["run", "idle.csv"], &COLUMNS[..]].concat());
    let notes = String::from_utf8(output.stderr).unwrap();
    let says = "lines of idle.csv: the position there (x_mm) counts as missing";
    assert_eq!(notes.matches(says).count(), 1, "{notes}");
}

#[test]
fn a_model_with_relative_inputs_takes_its_baseline_from_the_log() {
    let folder = Folder::new("log-relative");
    folder.write("log.csv", log(0.2));
    let train =
        [&["train", "log.csv", "--first-share", "0.8", "-o", "m.bin"], &COLUMNS[..]].concat();
    folder.succeed(&[&train[..], &["--relative-inputs"]].concat());
    let eval = ["eval", "m.bin", "log.csv", "--last-share", "0.2", "--html", "eval.html"];
    let judged = folder.json(&eval);
    let run = folder.json(&[&["run", "log.csv", "--relative-inputs"], &COLUMNS[..]].concat());
    assert!(
        run["verdict"]["sentence"].as_str().unwrap().contains("renewed in each pause"),
        "{run}"
    );
    let ratio = force_rmse(&judged) / force_rmse(&run);
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
    assert!(folder.read("eval.html").contains("Over time"));
    // The model knows the first lines, and all of them together.
    for share in [&["--first-share", "0.8"][..], &["--last-share", "0.5"], &[]] {
        let flattered = folder.json(&[&eval[..3], share].concat());
        assert_eq!(warnings(&flattered), ["judged-by-training-data"], "{share:?}");
    }
    assert_eq!(warnings(&judged), [""; 0]);
    // `decode` has the same baseline, and a file without the force has none.
    folder.succeed(&["decode", "m.bin", "log.csv", "-o", "estimates.csv"]);
    let of_force = |name: &str, column: usize| -> Vec<f64> {
        let text = folder.read(name);
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
