//! The program as a user runs it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// Folder of a test's own with a scene that runs in a moment: rows 4 and 5 of `press`, without refinement.
fn folder(name: &str, change: [&str; 2]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    let scene = include_str!("../../../scenes/press.toml");
    let mut scene = scene.split("[table1]").next().unwrap_or_default().to_owned();
    for [from, to] in [
        ["[training]", "[training]\nrefine = false"],
        ["[outputs]", "[readout]\nrow_wires = [4, 5]\n\n[outputs]"],
        ["frames = 20000", "frames = 1000"],
        ["centres = 64", "centres = 12"],
        change,
    ] {
        assert!(scene.contains(from), "{from}");
        scene = scene.replacen(from, to, 1);
    }
    std::fs::write(folder.join("scene.toml"), scene).unwrap();
    folder
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_study")).args(arguments).current_dir(folder).output().unwrap()
}

fn succeed(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {stderr}");
    String::from_utf8(output.stdout).unwrap()
}

fn fail(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

fn json(folder: &Path, arguments: &[&str]) -> Value {
    serde_json::from_str(&succeed(folder, &[arguments, &["--json"]].concat())).unwrap()
}

const AS_IT_IS: [&str; 2] = ["[noise]", "[noise]"];

#[test]
fn every_study_answers_in_words_and_in_json() {
    let folder = folder("studies", AS_IT_IS);
    for (arguments, field) in [
        (&["equations", "scene.toml", "-n", "3"][..], "rows"),
        (&["directions", "scene.toml", "-n", "3"], "rows"),
        (&["widths", "scene.toml", "--centres", "6", "--spread", "0.8"], "models"),
        (
            &[
                "map",
                "scene.toml",
                "--samples",
                "30,100",
                "--test-frames",
                "50",
                "--centres",
                "4,8",
            ],
            "maps",
        ),
        (&["recursion", "--centres", "3", "-n", "100"], "row_wire"),
        (&["drift", "scene.toml"], "lines"),
        (&["readout", "scene.toml", "--frames", "3"], "lines"),
        (&["confidence", "scene.toml", "-n", "100"], "coverage"),
    ] {
        let document = json(&folder, arguments);
        assert!(document["command"].as_str().unwrap().ends_with(arguments[0]), "{arguments:?}");
        assert!(!document[field].is_null(), "{arguments:?}: {document}");
        assert!(succeed(&folder, arguments).lines().count() > 3, "{arguments:?}");
    }
}

#[test]
fn a_fast_readout_is_better_on_contacts_that_move_and_no_better_on_still_ones() {
    let motion = "[motion]\nspeed_mm_per_s = [100.0, 100.0]\npress_rate_hz = [5.0, 5.0]\n\
                  duration_s = 0.4\ntrajectories = 4\n\n[noise]";
    let folder = folder("studies-rate", ["[noise]", motion]);
    let result = json(&folder, &["rate", "scene.toml", "-o", "rate.svg"]);
    let lines = result["lines"].as_array().unwrap();
    let of = |readout: &str, samples: u64, ms: f64, field: &str| {
        let line = lines.iter().find(|line| {
            line["readout"] == readout
                && line["samples_averaged"] == samples
                && line["time_constant_ms"] == ms
        });
        line.unwrap()[field].as_f64().unwrap()
    };
    assert_eq!(lines.len(), 24);
    assert_eq!(of("spi", 4, 0.0, "still"), of("onchip", 4, 0.0, "still"));
    let best = |readout: &str, samples: &[u64]| {
        let errors = samples.iter().map(|samples| of(readout, *samples, 0.0, "moving"));
        errors.fold(f64::INFINITY, f64::min)
    };
    assert!(best("onchip", &[1, 4, 12, 48]) < 0.8 * best("spi", &[1, 2, 4, 16]), "{result}");
    // More samples help a still touch, and not one that moves on meanwhile.
    assert!(of("spi", 16, 0.0, "still") < 0.8 * of("spi", 1, 0.0, "still"), "{result}");
    assert!(of("spi", 16, 0.0, "moving") > 1.5 * of("spi", 1, 0.0, "moving"), "{result}");
    // Samples of one scan share noise of 20 ms.
    assert!(of("onchip", 12, 0.0, "still") < 0.9 * of("onchip", 12, 20.0, "still"), "{result}");
    let picture = std::fs::read_to_string(folder.join("rate.svg")).unwrap();
    assert!(picture.contains("on-chip: moving, filtered"));
    assert!(fail(&folder, &["rate", "press"]).contains("[motion]"));
}

#[test]
fn equations_refuse_what_they_do_not_decode_and_draw_a_picture() {
    let of_z = folder("studies-z", ["[\"x\", \"y\", \"z\"]", "[\"z\"]"]);
    let said = fail(&of_z, &["equations", "scene.toml"]);
    assert!(said.contains("equations give all deformations"), "{said}");
    assert!(fail(&of_z, &["equations", "press", "-n", "0"]).contains("frames = 0"));

    let folder = folder("studies-equations", AS_IT_IS);
    let page = succeed(&folder, &["equations", "scene.toml", "-n", "4", "-o", "e.svg"]);
    let solved = page.lines().find(|line| line.starts_with("solved exactly")).unwrap();
    let shares: Vec<&str> = solved.split_whitespace().skip(3).collect();
    assert_eq!(shares, ["100", "0", "0", "0", "0", "0", "0", "0"], "{page}");
    let picture = std::fs::read_to_string(folder.join("e.svg")).unwrap();
    assert!(picture.starts_with("<svg") && picture.contains("equations, damped"));
}

#[test]
fn a_scenes_own_readout_replaces_the_typical_values() {
    let own = "[readout]\ncross_talk = true\nrow_switch_ohm = 5.0\nline_ohm = 0.0\n\
               sampler = \"on-chip\"\nrow_drive = \"shift-register\"";
    let folder = folder("studies-readout", ["[readout]", own]);
    let result = json(&folder, &["readout", "scene.toml", "--frames", "5"]);
    let uncorrected = &result["lines"][6 + 2];
    assert_eq!(uncorrected["stage"], "series");
    // A series resistance of 5 Ω lies before the 3.1 Ω of a row.
    let rms_percent = uncorrected["readings"]["rms_percent"].as_f64().unwrap();
    assert!((140.0..190.0).contains(&rms_percent), "{rms_percent}");
}

#[test]
fn a_confidence_covers_errors_and_finds_faults_novel() {
    let folder = folder("studies-confidence", ["frames = 1000", "frames = 3000"]);
    let result = json(&folder, &["confidence", "scene.toml", "-n", "2000"]);
    for group in result["coverage"].as_array().unwrap() {
        let of = |field: &str| group["all"][field].as_f64().unwrap();
        assert!((of("percent_within_68") - 68.3).abs() < 3.0, "{group}");
        assert!((of("percent_within_95") - 95.0).abs() < 2.0, "{group}");
    }
    let detections = result["detections"].as_array().unwrap();
    assert_eq!(detections.len(), 10);
    let novel = |at: usize| detections[at]["percent_novel"].as_f64().unwrap();
    assert!(novel(0) < 1.5, "{}", detections[0]);
    assert!((1..5).all(|at| novel(at) > 95.0), "{detections:?}");
}

/// RMSE of z in a list of errors.
fn z(errors: &Value) -> f64 {
    let errors = errors.as_array().unwrap();
    errors.iter().find(|it| it["group"] == "dz_mm").unwrap()["rmse"].as_f64().unwrap()
}

#[test]
fn drift_costs_readings_a_factor_and_relative_inputs_nothing() {
    let folder = folder("studies-drift", ["frames = 1000", "frames = 8000"]);
    let result = json(&folder, &["drift", "scene.toml", "--gain", "0.02"]);
    for line in result["lines"].as_array().unwrap().iter().filter(|it| it["decoder"] != "mean") {
        let ratio = z(&line["drifted"]) / z(&line["undrifted"]);
        if line["relative_inputs"] == true {
            assert!((ratio - 1.0).abs() < 0.001, "{line}");
        } else if line["trained_with_drift"] == false {
            assert!(ratio > 1.5, "{ratio}: {line}");
        }
    }
}

#[test]
fn creep_costs_forces_and_not_places_and_its_own_equation_takes_it_back() {
    let motion = "[motion]\nspeed_mm_per_s = [10.0, 50.0]\npress_rate_hz = [1.0, 3.0]\nduration_s = 0.4\n\
                  trajectories = 20\n";
    // All rows: two do not tell the force on the whole face.
    let folder = folder("studies-rubber", ["[readout]\nrow_wires = [4, 5]\n", motion]);
    let page = succeed(&folder, &["rubber", "scene.toml"]);
    assert!(page.contains("80 % of a deformation at once"), "{page}");
    let result = json(&folder, &["rubber", "scene.toml", "--instant-share", "0.6"]);
    let lines = |outputs: usize| result["outputs"][outputs].as_array().unwrap();
    let of = |line: &Value, rubber: &str| line[rubber]["when_read"].clone();
    let force = |line: &Value, rubber: &str| of(line, rubber)[0]["rmse"].as_f64().unwrap();
    let network = |trained_on: &str, undone: bool| {
        let mut lines = lines(1).iter().filter(|line| line["decoder"] == "network");
        let is = |it: &&Value| it["trained_on"] == trained_on && it["creep_undone"] == undone;
        force(lines.find(is).unwrap(), "creeping")
    };
    let still = network("still", false);
    assert!(network("still", true) < 0.7 * still && network("creeping", false) < 0.95 * still);
    for line in lines(0).iter().filter(|line| line["trained_on"] == "still") {
        let ratio = z(&of(line, "creeping")) / z(&of(line, "at_once"));
        assert!((0.6..1.1).contains(&ratio), "{ratio}: {line}");
    }
}

#[test]
fn cross_talk_ruins_the_divider_and_spares_zero_potential() {
    let all_rows = ["row_wires = [4, 5]", "row_wires = [1, 2, 3, 4, 5, 6, 7, 8]"];
    let folder = folder("studies-circuits", all_rows);
    let result = json(&folder, &["readout", "scene.toml", "--frames", "50"]);
    let rms = |circuit: &str, stage: &str| {
        let mut lines = result["lines"].as_array().unwrap().iter();
        let line = lines.find(|it| it["circuit"] == circuit && it["stage"] == stage).unwrap();
        line["readings"]["rms_percent"].as_f64().unwrap()
    };
    assert!((5.0..8.0).contains(&rms("divider", "cross-talk")));
    assert!(rms("divider", "quantised") < 0.1 && rms("zero-potential", "cross-talk") < 0.02);
    // Switches and leads cost 13 %, which correction recovers.
    assert!((10.0..17.0).contains(&rms("zero-potential", "series")));
    assert!(rms("zero-potential", "corrected") < 0.04);
    assert!((0.5..2.5).contains(&rms("zero-potential", "miscalibrated")));
}

#[test]
fn a_wait_shorter_than_the_time_constant_needs_fails() {
    let hasty = "[readout]\ntime_constant_us = 5.0\nsettling_us = 10";
    let folder = folder("studies-hasty", ["[readout]", hasty]);
    let output = run(&folder, &["readout", "scene.toml"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("settling takes 46 µs"), "{said}");
}

#[test]
fn what_cannot_be_studied_is_refused_by_name() {
    let small = folder("studies-refused", AS_IT_IS);
    let wide = folder("studies-wide", ["column_wires = 18", "column_wires = 19"]);
    let forward = ["[training]", "[training]\ndirection = \"forward\""];
    let forward = folder("studies-forward", forward);
    for (folder, command, says) in [
        (&small, "map --row 9", "--row 9"),
        (&small, "map --group dw_mm", "--group dw_mm"),
        (&small, "map --samples 2,30", "--samples 2"),
        (&small, "map --centres 0,64", "--centres 0"),
        (&small, "map --spread 1,0.1", "--spread"),
        (&small, "map --noise 2", "--noise 2"),
        (&small, "map --initial-covariance -1", "--initial-covariance -1"),
        (&small, "widths press --spread -1", "--spread -1"),
        (&small, "widths press --centres 0", "--centres 0"),
        (&small, "recursion --row 9", "--row 9"),
        (&small, "recursion --centres 0", "--centres 0"),
        (&small, "recursion -n 10", "--updates 10"),
        (&small, "drift press --gain 1", "--gain 1"),
        (&small, "rubber scene.toml", "motion = still contacts: rubber creeps"),
        (&small, "rubber moving --instant-share 1.1", "--instant-share 1.1"),
        (&small, "rubber moving --time-constant-ms 0", "--time-constant-ms 0"),
        (&small, "confidence scene.toml -n 0", "--frames = 0: give from 1"),
        (&small, "readout scene.toml --frames 0", "--frames = 0"),
        (&wide, "readout scene.toml", "19 column-wires"),
        (&forward, "drift scene.toml", "direction = forward: drift is about models that decode"),
        (
            &forward,
            "readout scene.toml",
            "direction = forward: readout is about models that decode",
        ),
        (&forward, "confidence scene.toml", "forward: confidence is about models that decode"),
    ] {
        let said = fail(folder, &command.split(' ').collect::<Vec<_>>());
        assert!(said.contains(says), "{command}: {said}");
    }
}
