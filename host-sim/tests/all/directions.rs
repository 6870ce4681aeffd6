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

#[test]
fn the_study_of_equations_solves_undisturbed_frames_and_draws_a_picture() {
    let folder = Folder::new("study-equations");
    folder.write("scene.toml", small_scene());
    let study = ["study", "equations", "scene.toml", "-n", "4", "-o", "e.svg"];
    let page = folder.succeed(&study);
    let solved = page.lines().find(|line| line.starts_with("solved exactly")).unwrap();
    let shares: Vec<&str> = solved.split_whitespace().skip(3).collect();
    assert_eq!(shares, ["100.0", "0.0", "0.0", "0.0", "0.0", "0.0", "0.0", "0.0"], "{page}");
    let picture = std::fs::read_to_string(folder.path("e.svg")).unwrap();
    assert!(picture.starts_with("<svg") && picture.contains("equations, damped"));
}
