//! A gain that drifts: what it costs models of readings, and that it costs relative inputs nothing.

use crate::common::{Folder, small_scene, small_scene_with_table1, unrefined};
use host_sim::evaluate::trade::{self, Bounds, Device, Plan};
use host_sim::experiment::Experiment;
use host_sim::metrics::Errors;
use host_sim::subject::Subject;
use taxel_data::Silent;
use taxel_simulate::drift::Drift;

fn z(errors: &[Errors]) -> f64 {
    errors.iter().find(|errors| errors.group == "dz_mm").unwrap().rmse
}

#[test]
fn a_trade_sees_readings_and_baselines_of_the_same_session() {
    let mut scene = unrefined("press");
    scene.world.read_rows = vec![3, 4];
    (scene.training.frames, scene.training.test_frames) = (1000, 300);
    scene.training.relative_inputs = true;
    let plan = Plan {
        centres: vec![16],
        column_steps: vec![1],
        samples_averaged: vec![1],
        device: Device::default(),
        worst_case: false,
    };
    let trade = |scene: &Experiment| {
        let subject = Subject::Scene(Box::new(scene.clone()));
        trade::compute(&subject, &plan, "dz_mm", &Bounds::default(), &Silent).unwrap()
    };
    let still = trade(&scene);
    scene.world.drift = Some(Drift { gain: 0.02 });
    let drifting = trade(&scene);
    for (a, b) in still.points.iter().zip(&drifting.points) {
        assert_eq!((a.name(), a.frame), (b.name(), b.frame));
        assert!((b.rmse("dz_mm") / a.rmse("dz_mm") - 1.0).abs() < 0.01, "{}", a.name());
    }
}

#[test]
fn a_run_with_relative_inputs_says_so_and_shows_changes_from_rest() {
    let mut scene = Experiment::parse("small", &small_scene_with_table1()).unwrap();
    scene.training.relative_inputs = true;
    scene.world.drift = Some(Drift { gain: 0.02 });
    let (result, blob) =
        host_sim::run::run(&Subject::Scene(Box::new(scene.clone())), &scene.options(), &Silent)
            .unwrap();
    assert!(blob.parse().metadata().relative_inputs && result.model.relative_inputs);
    let summary = result.scene.as_ref().unwrap();
    assert_eq!(summary.gain_drift, 0.02);
    for (frame, ideal) in result.distribution.frames.iter().zip(&summary.ideal_changes) {
        // Relative noise of half a per cent on readings and baseline is all that differs.
        assert!(frame.change.iter().zip(ideal).all(|(noisy, ideal)| (noisy - ideal).abs() < 4.0));
    }
    let rmse = |decoder: usize| z(&result.decoders[decoder].errors);
    assert!(rmse(0) < rmse(1) && rmse(1) < 0.6 * rmse(2), "network, linear, mean");
    // Table 1 is computed on the same inputs: at little noise its best network is far below the mean.
    let column = &result.table1.as_ref().unwrap().columns[0];
    let best = column.decoders.iter().filter(|entry| entry.spread.is_some());
    let best = best.map(|entry| z(&entry.errors)).fold(f64::INFINITY, f64::min);
    assert!(best < 0.5 * z(column.errors("mean", None)), "{best}");
    let page = host_sim::report::html(&result, &host_sim::report::Made::default()).html;
    assert!(page.contains("18 relative readings") && page.contains("gain drift ±2"), "report");
}

#[test]
fn a_user_trains_on_a_csv_file_and_decodes_a_drifted_sensor_with_its_own_baseline() {
    let folder = Folder::new("drift-csv");
    folder.write("scene.toml", small_scene());
    let synth = |seed: &str, scale: &str, data: &str, rest: &str| {
        let of_seed = ["synth", "scene.toml", "--seed", seed, "--scale", scale];
        folder.succeed(&[&of_seed[..], &["-n", "1500", "-o", data]].concat());
        folder.succeed(&[&of_seed[..], &["-n", "100", "--untouched", "-o", rest]].concat());
    };
    synth("1", "1", "train.csv", "rest.csv");
    synth("2", "1.02", "drifted.csv", "drifted_rest.csv");
    let train = ["train", "train.csv", "--centres", "24", "--no-refine"];
    folder.succeed(&[&train[..], &["-o", "readings.bin"]].concat());
    let relative = ["--relative-inputs", "--baseline", "rest.csv", "-o", "relative.bin", "--json"];
    let trained = folder.succeed(&[&train[..], &relative[..]].concat());
    assert!(trained.contains("\"relative_inputs\": true"), "{trained}");
    let inspected = folder.succeed(&["inspect", "relative.bin"]);
    assert!(inspected.contains("relative to the baseline"), "{inspected}");
    assert!(!folder.succeed(&["inspect", "readings.bin"]).contains("relative to the baseline"));

    let rmse = |arguments: &[&str]| {
        let result = folder.succeed(&[&["eval", "--json"], arguments].concat());
        let result: serde_json::Value = serde_json::from_str(&result).unwrap();
        let groups = result["decoders"][0]["errors"].as_array().unwrap().clone();
        groups.iter().find(|group| group["group"] == "dz_mm").unwrap()["rmse"].as_f64().unwrap()
    };
    let of_relative = rmse(&["relative.bin", "drifted.csv", "--baseline", "drifted_rest.csv"]);
    let of_readings = rmse(&["readings.bin", "drifted.csv"]);
    let with_old_baseline = rmse(&["relative.bin", "drifted.csv", "--baseline", "rest.csv"]);
    println!("{of_relative} {of_readings} {with_old_baseline} mm");
    assert!(2.0 * of_relative < of_readings.min(with_old_baseline));
}
