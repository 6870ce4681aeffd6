//! The limit from the command line, and beside the errors of decoders.

use host_sim::experiment::Experiment;
use host_sim::metrics;
use taxel_data::{Silent, Stream};
use taxel_learn::decoders::BASELINES;
use taxel_limit::Limit;
use taxel_simulate::Synthesis;

use crate::common::{Folder, small_scene, untimed};

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}

#[test]
fn the_command_prints_the_same_bytes_on_any_number_of_threads_and_writes_its_files() {
    let folder = Folder::new("limit");
    folder.write("scene.toml", small_scene());
    let arguments =
        ["limit", "scene.toml", "-n", "20", "--noise", "0.01,0.1", "--json", "-o", "out"];
    let printed = folder.succeed(&arguments);
    let alone = String::from_utf8(folder.run_with_threads(&arguments, 1).stdout).unwrap();
    assert_eq!(untimed(&printed), untimed(&alone));
    let result = json(&printed);
    let levels = result["levels"].as_array().unwrap();
    for level in levels {
        // Both rows together, and each by itself.
        let limits = level["limits"].as_array().unwrap();
        assert_eq!(limits.len(), 3);
        let z = |of: usize| limits[of]["groups"][2]["limit"].as_f64().unwrap();
        let apart = (0.5 * (z(1).powi(2) + z(2).powi(2))).sqrt();
        assert!(z(0) < apart, "two rows tell more than one: {limits:?}");
        assert!(limits[0]["effective_samples"]["least"].as_f64().unwrap() > 30.0);
        assert_eq!(level["by_row"].as_array().unwrap().len(), 2);
    }
    let z = |level: usize| levels[level]["limits"][0]["groups"][2]["limit"].as_f64().unwrap();
    assert!(z(0) < z(1), "less noise, less error");
    let page = std::fs::read_to_string(folder.path("out/limit.html")).unwrap();
    assert!(page.contains("observable, above the dashed line") && !page.contains("NaN"));
    assert!(page.find("<svg") < page.find("<table"), "the picture stands before the table");
    assert!(page.contains("<p class=\"note\">Made by <code>host-sim limit "));
    for figure in ["limit-by-noise", "directions-at-1-percent", "known-at-10-percent"] {
        let picture = folder.path(&format!("out/figures/{figure}.svg"));
        let picture = std::fs::read_to_string(picture).unwrap();
        assert!(picture.starts_with("<svg xmlns=") && picture.ends_with("</svg>\n"));
        assert_eq!(picture.matches("<svg").count(), 1);
    }
}

#[test]
fn models_are_judged_on_the_frames_of_the_limit() {
    let folder = Folder::new("limit-models");
    folder.write("scene.toml", small_scene());
    folder.succeed(&["train", "scene.toml", "-o", "m.bin"]);
    folder.succeed(&["train", "scene.toml", "--relative-inputs", "-o", "relative.bin"]);
    let models = ["limit", "scene.toml", "-n", "60", "--model", "m.bin,relative.bin"];
    let result = json(&folder.succeed(&[&models[..], &["--json"]].concat()));
    let level = &result["levels"][0];
    let limit = level["limits"][0]["groups"][2]["limit"].as_f64().unwrap();
    for (model, file) in level["decoders"].as_array().unwrap().iter().zip(["m.bin", "relative.bin"])
    {
        assert_eq!(model["decoder"], file);
        let errors = &model["errors"][2];
        let number = |name: &str| errors[name].as_f64().unwrap();
        let (ratio, error) = (number("ratio_to_limit"), number("ratio_standard_error"));
        assert!(ratio > 1.0 + 2.0 * error, "{file}: {ratio} ± {error}");
        // The plain ratio of the two RMSE is the same, but for chance: these are 60 frames.
        let plain = number("rmse") / limit;
        assert!((plain / ratio - 1.0).abs() < 0.2, "{file}: {plain} and {ratio}");
    }
    let page = folder.succeed(&[&models[..], &["-o", "out"]].concat());
    assert!(page.contains(" ×   m.bin") && page.contains(" ×   relative.bin"), "{page}");
    let page = std::fs::read_to_string(folder.path("out/limit.html")).unwrap();
    assert!(page.contains("model m.bin") && page.contains("model relative.bin"));
}

#[test]
fn errors_are_given_beside_the_limit_and_its_own_ratio_is_one() {
    let mut experiment = Experiment::load("press").unwrap();
    experiment.world.read_rows = vec![3, 4];
    let world = &experiment.world;
    let (measure, summary) = experiment.measure_beside_limit(world.noise, 60, &Silent);
    assert_eq!((summary.frames, summary.refused.as_ref()), (60, None));
    let test = Synthesis::new(world).frames(Stream::Test, 60);
    let training = Synthesis::new(world).frames(Stream::Training, 2000);
    let own = metrics::judge(&Limit::new(world).unwrap(), &test, &measure);
    for (errors, limit) in own.errors.iter().zip(&summary.groups) {
        assert_eq!(errors.ratio_to_limit, Some(1.0));
        let off = (errors.rmse - limit.rmse).abs();
        assert!(off < 0.02 * limit.rmse, "{errors:?} {limit:?}");
    }
    for baseline in BASELINES {
        let errors = metrics::judge(baseline.fit(&training).as_ref(), &test, &measure).errors;
        for (errors, limit) in errors.iter().zip(&summary.groups) {
            let (ratio, error) =
                (errors.ratio_to_limit.unwrap(), errors.ratio_standard_error.unwrap());
            assert!(ratio > 1.0 && error < 0.3 * ratio, "{errors:?}");
            // The plain ratio of the two RMSE has a larger error, but is the same.
            let plain = errors.rmse / limit.limit;
            assert!((plain / ratio - 1.0).abs() < 0.35, "{} {plain} {ratio}", errors.group);
        }
    }
}

#[test]
fn a_drifting_scene_is_run_without_a_limit_and_says_why() {
    let folder = Folder::new("limit-drift");
    let scene = small_scene() + "\n[drift]\ngain = 0.02\n";
    folder.write("scene.toml", scene);
    let page = folder.succeed(&["run", "scene.toml"]);
    assert!(page.contains("No ratio to the least possible error: a drift"), "{page}");
    let metrics = std::fs::read_to_string(folder.path("out/small/metrics.json")).unwrap();
    assert!(json(&metrics)["decoders"][0]["errors"][0]["ratio_to_limit"].is_null());
}
