//! Scenes that ask for the contact alone: one small network for the whole array.

use serde_json::Value;

use crate::common::{Folder, rmse};

/// The scene `contact` with few frames, which is quick to train.
fn small_contact() -> String {
    include_str!("../../../scenes/contact.toml")
        .replace("frames = 20000", "frames = 3000")
        .replace("test_frames = 8000", "test_frames = 80")
        .replace("centres = 64", "centres = 24\nrefine = false")
}

#[test]
fn features_are_chosen_alike_whichever_way_weights_are_computed() {
    let folder = Folder::new("contact-solvers");
    let [by_qr, by_rls] = ["qr", "rls"].map(|solver| {
        let options = ["-n", "600", "--centres", "12", "--no-refine", "-o", "m.bin"];
        folder.json(&[&["train", "contact", "--solver", solver][..], &options].concat())
    });
    assert_eq!(by_qr["features"], by_rls["features"]);
    assert_ne!(by_qr["model_crc"], by_rls["model_crc"]);
}

#[test]
fn the_contact_is_trained_evaluated_inspected_and_run() {
    let folder = Folder::new("contact");
    folder.write("scene.toml", small_contact());
    folder.succeed(&["synth", "scene.toml", "-n", "500", "--seed", "9", "-o", "test.csv"]);
    let header = folder.read("test.csv");
    let header = header.lines().next().unwrap();
    let columns = "r8c18_ohm,contact_x_mm,contact_y_mm,contact_depth_mm,contact_force_n";
    assert!(header.ends_with(columns), "{header}");

    let train = ["train", "scene.toml", "--format", "fixed16", "-o", "m.bin"];
    folder.succeed(&train);
    let evaluated = folder.json(&["eval", "m.bin", "test.csv"]);
    for (group, most) in [
        ("contact_x_mm", 3.5),
        ("contact_y_mm", 3.0),
        ("contact_depth_mm", 0.16),
        ("contact_force_n", 1.2),
    ] {
        let found = rmse(&evaluated["decoders"][0]["errors"], group);
        assert!(
            found < most && found < 0.7 * rmse(&evaluated["decoders"][1]["errors"], group),
            "{group}: {found}"
        );
    }
    let ranges = evaluated["by_load"].as_array().unwrap();
    let x = |range: &Value| range["rmse_contact_x_mm"].as_f64().unwrap();
    let (shallow, deep) = (&ranges[0], &ranges[ranges.len() - 2]);
    assert!(x(shallow) > 2.0 * x(deep), "where a shallow contact is can hardly be known");

    let model = folder.json(&["inspect", "m.bin"]);
    let shape = ["rows", "inputs_per_row", "outputs_per_row", "projected_features"];
    assert_eq!(shape.map(|field| model[field].as_u64().unwrap()), [1, 144, 4, 10]);
    assert!(model["blob_bytes"].as_u64().unwrap() < 10_000);
    assert_eq!(model["needs"].as_array().unwrap().len(), 0, "the images take it");

    let printed = folder.succeed(&["run", "scene.toml"]);
    assert!(printed.contains("RMSE by the true contact depth") && !printed.contains("row-wire"));
    assert!(printed.contains("144 readings → 10 features → K = 24 → 4 outputs"), "{printed}");
    let page = folder.read("out/contact/report.html");
    assert!(!page.contains("NaN"));
}
