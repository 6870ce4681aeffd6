//! Notes on readings that a model is trained on, and that a device would take for missing.

use crate::common::{Folder, small_scene};

const NOTE: &str =
    "lie outside of 5 to 1000 Ω: a device, `decode` and `eval` treat them as missing";

#[test]
fn training_tells_of_readings_that_a_device_would_refuse() {
    let folder = Folder::new("refused-readings");
    let sound = small_scene();
    let shorted = sound.replacen("resistance_ohm_per_mm = 100.0", "resistance_ohm_per_mm = 1.0", 1);
    assert_ne!(shorted, sound);
    folder.write("sound.toml", sound);
    folder.write("shorted.toml", shorted);
    let train = |source: &'static str, more: &[&'static str]| {
        [&["train", source, "--centres", "8", "--no-refine", "-o", "m.bin"], more].concat()
    };
    let quiet = folder.notes(&train("sound.toml", &["-n", "300"]));
    assert!(!quiet.contains("outside"), "{quiet}");
    let noted = folder.notes(&train("shorted.toml", &["-n", "300"]));
    assert!(
        noted.contains(NOTE) && noted.contains("all readings shorted (or too small) in 100 %"),
        "{noted}"
    );

    folder.succeed(&["synth", "sound.toml", "-n", "300", "-o", "sound.csv"]);
    let text = folder.read("sound.csv");
    let column = text.split(',').position(|name| name == "r4c5_ohm").unwrap();
    let line = |(number, line): (usize, &str)| {
        let mut fields: Vec<&str> = line.split(',').collect();
        if number % 10 == 1 || number % 10 == 2 || number % 10 == 3 {
            fields[column] = "1000000";
        }
        fields.join(",") + "\n"
    };
    let broken: String = text.lines().enumerate().map(line).collect();
    folder.write("broken.csv", broken);
    let noted = folder.notes(&train("broken.csv", &[]));
    assert!(noted.contains(NOTE) && noted.contains("r4c5_ohm: open in 30 % of lines"), "{noted}");
    assert!(noted.contains("--open-above-ohm") && noted.contains("--limits"), "{noted}");
}
