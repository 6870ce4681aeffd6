//! Gating: how often noise wakes a row, and what accuracy it costs.

use crate::common::{Folder, small_scene, unrefined};
use host_sim::evaluate::gate::{self, GateResult, Settings, woken_by_theory};
use host_sim::experiment::Experiment;
use host_sim::metrics::Errors;
use taxel_data::{Purpose, Random, Silent, Stream};
use taxel_learn::Exponential;
use taxel_learn::cost::{Design, Frames, Prices};

const READINGS: usize = 18;

fn measured(scene: &Experiment, settings: &Settings) -> GateResult {
    let blob = scene.train(&Silent).unwrap();
    gate::measure(scene, &blob.prepare(Exponential::default()), settings, &Silent).unwrap()
}

fn z(errors: &[Errors]) -> f64 {
    errors.iter().find(|errors| errors.group == "dz_mm").unwrap().rmse
}

#[test]
fn noise_wakes_untouched_rows_as_often_as_theory_says() {
    let mut scene = Experiment::parse("small", &small_scene()).unwrap();
    scene.world.read_rows = vec![0, 3, 4, 7];
    let k = [2.5, 3.0, 3.5, 4.0];
    let settings = Settings {
        k: k.to_vec(),
        frames: 20_000,
        baseline_frames: 10_000,
        frame_cycles: Frames { ungated: 1, at_rest: 1, awake: 1 },
        flash_frame_cycles: None,
    };
    let result = measured(&scene, &settings);
    let rows = (settings.frames * scene.world.read_rows.len()) as f64;
    for (line, k) in result.lines.iter().zip(k) {
        // Between the readings alone, and readings and their sum as if these were independent.
        let [least, most] =
            [READINGS - 1, READINGS].map(|n| woken_by_theory(k, n, settings.baseline_frames));
        assert_eq!(line.woken_by_theory, most);
        let deviation = (most * (1.0 - most) / rows).sqrt();
        println!("k = {k}: {} from {least} to {most}, ± {deviation}", line.woken);
        assert!(line.woken > least - 4.0 * deviation && line.woken < most + 4.0 * deviation);
        // The measurement is fine enough to distinguish another k.
        assert!(woken_by_theory(0.97 * k, READINGS - 1, 10_000) > most + 4.0 * deviation);
    }
}

#[test]
fn press_loses_little_accuracy_and_saves_half_of_the_rows() {
    let scene = unrefined("press");
    let blob = scene.train(&Silent).unwrap();
    let model = blob.prepare(Exponential::default());
    let prices = Prices::accepted().unwrap();
    let frames = prices.frames(&Design::new(&blob), Exponential::default()).unwrap();
    let settings = Settings {
        k: vec![3.0, 3.5],
        frames: 4000,
        baseline_frames: 100,
        frame_cycles: frames.map(|cost| cost.cycles),
        flash_frame_cycles: None,
    };
    let result = gate::measure(&scene, &model, &settings, &Silent).unwrap();
    let [three, three_and_half] = &result.lines[..] else { panic!("two lines") };
    let worse = |errors: &[Errors]| z(errors) / z(result.ungated_errors());
    // Measured: 1.029 and 1.055.
    println!("z RMSE: {:.4} and {:.4} times", worse(&three.errors), worse(&three_and_half.errors));
    assert!(worse(&three.errors) < 1.04 && worse(&three_and_half.errors) < 1.07);
    // Measured: 0.509 and 0.567.
    assert!(three.skipped > 0.48 && three_and_half.skipped > 0.54);
    let cost = three.relative_cost;
    let rest_and_awake = [frames.at_rest, frames.awake].map(|cost| cost.cycles as f64);
    let mean = three.skipped * rest_and_awake[0] + (1.0 - three.skipped) * rest_and_awake[1];
    assert!((cost * frames.ungated.cycles as f64 / mean - 1.0).abs() < 1e-12, "{cost}");
    assert!(cost < 0.57 && three_and_half.relative_cost < cost);
    for group in ["dx_mm", "dy_mm"] {
        let of = |errors: &[Errors]| errors.iter().find(|e| e.group == group).unwrap().rmse;
        assert!(of(&three_and_half.errors) < 1.005 * of(result.ungated_errors()), "{group}");
    }
    // Larger touches are missed more rarely, and a larger tolerance misses more.
    for line in &result.lines {
        let shares: Vec<f64> = line.missed.iter().map(|missed| missed.share().unwrap()).collect();
        assert!(shares.is_sorted_by(|a, b| a > b), "{shares:?}");
    }
    let largest = |line: &gate::Line| line.missed.last().unwrap().share().unwrap();
    assert!(largest(three) < 0.02 && largest(three_and_half) > largest(three));
}

#[test]
fn the_command_prints_tables_and_json() {
    let folder = Folder::new("gate");
    folder.write("small.toml", small_scene());
    let arguments =
        ["gate", "small.toml", "-n", "200", "--k", "3.5,4", "--cycles", "4000,400,4250"];
    let text = folder.succeed(&arguments);
    for part in ["1.750 %", "2.000 %", "without a gate", "predicting the mean", "k = 4 "] {
        assert!(text.contains(part), "{part:?} is not in {text}");
    }
    assert!(text.contains("zero wait: 4000 without a gate, 400 with all rows untouched, 4250"));
    assert!(!text.contains("from flash: "), "{text}");
    // Without --cycles, the costs are predicted of the model.
    let predicted = folder.succeed(&arguments[..6]);
    assert!(
        predicted.contains("from flash: ") && !predicted.contains(": 4000 without"),
        "{predicted}"
    );
    let json: serde_json::Value =
        serde_json::from_str(&folder.succeed(&[&arguments[..], &["--json"]].concat())).unwrap();
    assert_eq!(json["lines"][1]["k"], 4.0);
    let at_rest = json["lines"][0]["skipped"].as_f64().unwrap();
    let cost = json["lines"][0]["relative_cost"].as_f64().unwrap();
    assert!((cost - (at_rest * 0.1 + (1.0 - at_rest) * 1.0625)).abs() < 1e-12);
}

#[test]
fn a_csv_file_with_frames_at_rest_has_a_gate() {
    let folder = Folder::new("gate-csv");
    let mut random = Random::new(5, Stream::Test, Purpose::Noise, 0, 0);
    let mut line = |force_n: f64| {
        let noise = |random: &mut Random| 1.0 + 0.005 * random.normal();
        let [a, b] = [60.0 * (1.0 - 0.1 * force_n), 30.0 * (1.0 + 0.2 * force_n)];
        format!("{},{},{force_n}\n", a * noise(&mut random), b * noise(&mut random))
    };
    // Half of the frames are at rest.
    let touched: String = (0..600).map(|i| line(f64::from(i % 10 - 4).max(0.0) / 5.0)).collect();
    let rest: String = (0..400).map(|_| line(0.0)).collect();
    folder.write("touched.csv", format!("ch1,ch2,f_n\n{touched}"));
    folder.write("rest.csv", format!("ch1,ch2,f_n\n{rest}"));
    let gate =
        ["gate", "touched.csv", "--inputs", "ch*", "--outputs", "f_n", "--no-refine", "--k", "3.5"];
    let missing = folder.fail(&[&gate[..], &["--rest", "none"]].concat(), 2);
    assert!(missing.contains("--baseline FILE"), "{missing}");
    // Lines at rest do as well.
    let own: serde_json::Value =
        serde_json::from_str(&folder.succeed(&[&gate[..], &["--json"]].concat())).unwrap();
    let noise = own["noise_level"].as_f64().unwrap();
    assert!((0.0045..0.0055).contains(&noise), "{noise}");
    let both = [&gate[..], &["--baseline", "rest.csv"]].concat();
    let result: serde_json::Value =
        serde_json::from_str(&folder.succeed(&[&both[..], &["--json"]].concat())).unwrap();
    let noise = result["noise_level"].as_f64().unwrap();
    assert!((0.0045..0.0055).contains(&noise), "{noise}");
    let line = &result["lines"][0];
    let of = |key: &str| line[key].as_f64().unwrap();
    // Five of ten frames are untouched.
    assert!((0.48..0.52).contains(&of("skipped")), "{line}");
    assert!(of("woken") < 0.01 && line["missed"].as_array().unwrap().is_empty(), "{line}");
    let page = folder.succeed(&both);
    assert!(page.contains("With k = 3.5 the gate skips 50 % of the rows"), "{page}");
    // A trade judges the same gate.
    let trade = ["trade", "touched.csv", "--inputs", "ch*", "--outputs", "f_n", "--no-refine"];
    let options = ["--baseline", "rest.csv", "--centres", "8", "--scan-ms", "1", "--json"];
    let traded: serde_json::Value =
        serde_json::from_str(&folder.succeed(&[&trade[..], &options].concat())).unwrap();
    let points = traded["points"].as_array().unwrap();
    let cycles = |gated: bool| {
        let of = points.iter().filter(|point| point["gate_k"].is_null() != gated);
        of.map(|point| point["cycles"].as_u64().unwrap()).min().unwrap()
    };
    assert!(cycles(true) < cycles(false), "{points:?}");
    let frames = folder.fail(&[&both[..], &["-n", "10"]].concat(), 2);
    assert!(frames.contains("--frames is for a scene"), "{frames}");
}

#[test]
fn frames_at_rest_that_make_no_gate_are_refused_before_training() {
    let folder = Folder::new("gate-rest");
    let mut random = Random::new(6, Stream::Test, Purpose::Noise, 0, 0);
    let mut lines = |middle: f64, count: usize| -> Vec<String> {
        let mut reading = || middle + 0.1 * random.normal();
        (0..count).map(|i| format!("{},{},{}", reading(), reading(), i % 5)).collect()
    };
    let table = |lines: &[String]| format!("ch1,ch2,f_n\n{}\n", lines.join("\n"));
    let subtracted = lines(0.01, 60);
    let mut holed = lines(50.0, 60);
    folder.write("whole.csv", table(&holed));
    for (i, line) in holed.iter_mut().enumerate().skip(20) {
        let fields: Vec<&str> = line.split(',').collect();
        *line = match i % 2 {
            0 => format!(",{},{}", fields[1], fields[2]),
            _ => format!("{},,{}", fields[0], fields[2]),
        };
    }
    folder.write("subtracted.csv", table(&subtracted));
    folder.write("holed.csv", table(&holed));
    folder.write("holes.csv", table(&holed[20..]));
    let gate = |data: &'static str, rest: &'static str, k: &'static str| {
        let columns = ["--inputs", "ch*", "--outputs", "f_n", "--no-refine", "--json"];
        [&["gate", data, "--baseline", rest, "--k", k], &columns[..]].concat()
    };
    for (arguments, says) in [
        (gate("subtracted.csv", "subtracted.csv", "3.5"), "readings are near zero at rest"),
        (gate("whole.csv", "holes.csv", "3.5"), "complete frames at rest = 0"),
        (gate("whole.csv", "whole.csv", "-1"), "--k -1"),
    ] {
        let stderr = folder.fail(&arguments, 2);
        assert!(stderr.contains(says) && !stderr.contains("train:"), "{stderr}");
    }
    // The first 20 frames at rest are complete.
    let result: serde_json::Value =
        serde_json::from_str(&folder.succeed(&gate("whole.csv", "holed.csv", "3.5"))).unwrap();
    assert_eq!(result["baseline_frames"], 10);
    assert_eq!(result["untouched_frames"], 10);
    let noise = result["noise_level"].as_f64().unwrap();
    assert!((0.0015..0.0025).contains(&noise), "{noise}");
}
