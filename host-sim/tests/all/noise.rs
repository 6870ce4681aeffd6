//! Noise at rest: what the program says of it, from a scene to a recording.

use std::fmt::Write as _;

use crate::common::{Folder, small_scene};
use crate::json_schema::{checked, schema};

/// Scene with as much noise of a time constant of 20 ms as white noise.
fn remembering() -> String {
    small_scene().replace(
        "level = 0.005",
        "level = 0.005\ncorrelated_level = 0.005\ntime_constant_ms = 20.0",
    )
}

#[test]
fn a_time_constant_of_20_ms_is_recognised_and_white_noise_is_white() {
    let folder = Folder::new("noise-rest");
    folder.write("white.toml", small_scene());
    folder.write("coloured.toml", remembering());
    for scene in ["white", "coloured"] {
        let (file, csv) = (format!("{scene}.toml"), format!("{scene}.csv"));
        let synth = ["synth", &file, "-n", "3000", "--untouched", "--frame-rate", "300"];
        folder.succeed(&[&synth[..], &["--scan-ms", "1", "-o", &csv]].concat());
    }
    let white = checked(&folder, &schema(), &["noise", "white.csv"]);
    assert_eq!(white["noise"]["colour"], "white");
    assert_eq!(
        (&white["noise"]["readings"], &white["noise"]["frames"]),
        (&36.into(), &3000.into())
    );
    let coloured = checked(&folder, &schema(), &["noise", "coloured.csv"]);
    let noise = &coloured["noise"];
    assert_eq!(noise["colour"], "correlated");
    let number = |key: &str| noise[key].as_f64().unwrap();
    assert!((0.018..0.022).contains(&number("time_constant_s")), "{noise}");
    assert!((0.45..0.55).contains(&number("correlated_share")), "{noise}");
    let page = folder.succeed(&["noise", "coloured.csv"]);
    assert!(
        page.contains("% of the variance of the noise at rest has a time constant of"),
        "{page}"
    );
    // A part of it, of columns that are named.
    let lines =
        folder.succeed(&["noise", "coloured.csv", "--inputs", "r*c*_ohm", "--first-share", "0.1"]);
    assert!(lines.starts_with("300 frames of 36 readings, one every 3.333 ms"), "{lines}");
}

#[test]
fn a_log_is_judged_at_rest_and_its_page_shows_how_far_averaging_pays() {
    let folder = Folder::new("noise-log");
    folder.write("coloured.toml", remembering());
    let synth = ["synth", "coloured.toml", "-n", "1200", "--untouched", "--frame-rate", "300"];
    folder.succeed(&[&synth[..], &["--scan-ms", "1", "-o", "rest.csv"]].concat());
    // The same frames as a log, with a weight on the sensor in the second half of every two seconds.
    let rest = std::fs::read_to_string(folder.path("rest.csv")).unwrap();
    let mut log = String::from("time_s,ch1,ch2,ch3,f_n\n");
    for (number, line) in rest.lines().skip(1).enumerate() {
        let fields: Vec<&str> = line.split(',').collect();
        let force = if number % 600 < 300 { 0.0 } else { (number as f64 / 30.0).sin().abs() + 1.0 };
        let readings = fields[2..5].iter().map(|field| field.parse::<f64>().unwrap() - force);
        let readings: Vec<String> = readings.map(|reading| reading.to_string()).collect();
        let _ = writeln!(log, "{},{},{force}", fields[0], readings.join(","));
    }
    folder.write("log.csv", log);
    let run =
        ["run", "log.csv", "--inputs", "ch*", "--outputs", "f_n", "--no-refine", "--centres", "8"];
    let document = checked(&folder, &schema(), &run);
    let noise = &document["data"]["over_time"]["rest"]["noise"];
    assert_eq!(noise["colour"], "correlated", "{noise}");
    let tau_s = noise["time_constant_s"].as_f64().unwrap();
    assert!((0.014..0.026).contains(&tau_s), "{tau_s}");
    let warnings = document["verdict"]["warnings"].to_string();
    assert!(warnings.contains("noise-with-a-memory"), "{warnings}");
    let page = std::fs::read_to_string(folder.path("out/log/report.html")).unwrap();
    assert!(page.contains("Noise at rest by averaging time"), "no figure");
}
