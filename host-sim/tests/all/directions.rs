//! Networks from deformations to readings, and equations solved for deformations.

use crate::common::{Folder, small_scene};

/// Small scene whose networks predict readings.
fn forward_scene() -> String {
    small_scene().replace("[training]", "[training]\ndirection = \"forward\"")
}

#[test]
fn a_forward_scene_trains_and_its_blob_predicts_readings_from_deformations() {
    let folder = Folder::new("forward-scene");
    folder.write("scene.toml", forward_scene());
    let trained = folder.succeed(&["train", "scene.toml", "-o", "m.bin"]);
    assert!(trained.contains("reading_ohm to"), "{trained}");
    folder.succeed(&["synth", "scene.toml", "-n", "300", "--seed", "2", "-o", "test.csv"]);
    folder.succeed(&["decode", "m.bin", "test.csv", "-o", "readings.csv"]);
    let readings = std::fs::read_to_string(folder.path("readings.csv")).unwrap();
    assert!(readings.starts_with("r4c1_ohm,r4c2_ohm,") && readings.lines().count() == 301);
    let evaluated = folder.succeed(&["eval", "m.bin", "test.csv", "--json"]);
    let evaluated: serde_json::Value = serde_json::from_str(&evaluated).unwrap();
    let rmse = |decoder: usize| {
        let errors = &evaluated["decoders"][decoder]["errors"];
        assert_eq!((errors.as_array().unwrap().len(), &errors[0]["unit"]), (1, &"Ω".into()));
        errors[0]["rmse"].as_f64().unwrap()
    };
    assert!(rmse(0) < 0.8 * rmse(1), "{evaluated}");

    let run = folder.succeed(&["run", "scene.toml"]);
    assert!(run.contains("0.253 Ω RMS") && run.contains("18 deformations -> K"), "{run}");
    assert!(folder.path("out/small/report.html").exists());
}
