//! A gain that drifts: what it costs models of readings, and that it costs relative inputs nothing.

use crate::common::{Folder, rmse, small_scene};

#[test]
fn a_user_decodes_a_drifted_sensor_with_its_own_baseline() {
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
    let relative = ["--relative-inputs", "--baseline", "rest.csv", "-o", "relative.bin"];
    assert_eq!(folder.json(&[&train[..], &relative[..]].concat())["relative_inputs"], true);
    let input = &folder.json(&["inspect", "relative.bin"])["inputs"][0];
    assert_eq!((&input["name"], &input["unit"]), (&"r4c1_ohm".into(), &"".into()));
    let inspected = folder.succeed(&["inspect", "relative.bin"]);
    assert!(inspected.contains("relative to the baseline: yes"), "{inspected}");
    assert!(
        !folder.succeed(&["inspect", "readings.bin"]).contains("relative to the baseline: yes")
    );

    let error = |arguments: &[&str]| {
        let result = folder.json(&[&["eval"], arguments].concat());
        rmse(&result["decoders"][0]["errors"], "dz_mm")
    };
    let of_relative = error(&["relative.bin", "drifted.csv", "--baseline", "drifted_rest.csv"]);
    let of_readings = error(&["readings.bin", "drifted.csv"]);
    let with_old_baseline = error(&["relative.bin", "drifted.csv", "--baseline", "rest.csv"]);
    println!("{of_relative} {of_readings} {with_old_baseline} mm");
    assert!(2.0 * of_relative < of_readings.min(with_old_baseline));
}
