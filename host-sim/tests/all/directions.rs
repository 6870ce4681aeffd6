//! Networks from deformations to readings, and what is refused for them.

use crate::common::{Folder, small_scene};

/// Small scene whose networks predict readings.
fn forward_scene() -> String {
    let scene = small_scene();
    let (scene, _) = scene.split_once("[table1]").unwrap();
    scene.replace("[training]", "[training]\ndirection = \"forward\"")
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
fn what_is_about_decoding_refuses_a_forward_scene_by_name() {
    let folder = Folder::new("forward-refused");
    folder.write("scene.toml", forward_scene());
    for command in ["gate", "trade", "drift", "confidence", "readout"] {
        let said = folder.fail(&[command, "scene.toml"], 2);
        let says = format!("training.direction = forward: {command} is about models that decode");
        assert!(said.contains(&says), "{said}");
    }
    let relative = ["train", "scene.toml", "--relative-inputs", "-o", "m.bin"];
    let said = folder.fail(&relative, 2);
    assert!(said.contains("relative_inputs = true: inputs are deformations"), "{said}");
    for (from, to, says) in [
        ("[\"x\", \"y\", \"z\"]", "[\"z\"]", "ask for outputs.quantity = \"deformation\""),
        ("\"forward\"", "\"sideways\"", "unknown variant `sideways`"),
    ] {
        folder.write("bad.toml", forward_scene().replace(from, to));
        let said = folder.fail(&["train", "bad.toml", "-o", "m.bin"], 2);
        assert!(said.contains(says), "{said}");
    }
}
