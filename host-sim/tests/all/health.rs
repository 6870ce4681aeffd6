//! Faulty readings in data files: judged as by a device, noted, flagged and filled.

use std::sync::OnceLock;

use crate::common::{Folder, rmse};

/// Folder with a model of the whole array that fills missing readings, one that does not, and frames; made once for all tests.
fn prepared(name: &str) -> Folder {
    const FILES: [&str; 3] = ["fills.bin", "plain.bin", "sound.csv"];
    static MADE: OnceLock<[Vec<u8>; 3]> = OnceLock::new();
    let made = MADE.get_or_init(|| {
        let folder = Folder::new("health-made");
        let train = |file: &'static str, fill: &[&'static str]| {
            let train = ["train", "press", "-n", "1500", "--centres", "16", "--no-refine"];
            folder.succeed(&[&train[..], &["-o", file], fill].concat());
        };
        train("fills.bin", &["--reading-model", "fill"]);
        train("plain.bin", &[]);
        folder.succeed(&["synth", "press", "-n", "200", "--seed", "5", "-o", "sound.csv"]);
        FILES.map(|file| std::fs::read(folder.path(file)).unwrap())
    });
    let folder = Folder::new(name);
    FILES.iter().zip(made).for_each(|(file, bytes)| drop(folder.write(file, bytes)));
    folder
}

/// Writes the sound frames with another value of the readings that `change` names.
fn changed(folder: &Folder, file: &str, change: impl Fn(&str, usize) -> Option<&'static str>) {
    let text = folder.read("sound.csv");
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut out = vec![header.join(",")];
    for (number, line) in lines.enumerate() {
        let fields = line.split(',').zip(&header);
        let fields: Vec<&str> =
            fields.map(|(value, name)| change(name, number).unwrap_or(value)).collect();
        out.push(fields.join(","));
    }
    folder.write(file, out.join("\n") + "\n");
}

/// Values of a column of a CSV file.
fn column(folder: &Folder, file: &str, name: &str) -> Vec<String> {
    let text = folder.read(file);
    let mut lines = text.lines();
    let at = lines.next().unwrap().split(',').position(|one| one == name).unwrap();
    lines.map(|line| line.split(',').nth(at).unwrap().to_owned()).collect()
}

#[test]
fn readings_that_a_device_refuses_are_noted_flagged_and_filled() {
    let folder = prepared("health");
    let error = |model: &str, data: &str, more: &[&str]| {
        let result = folder.json(&[&["eval", model, data], more].concat());
        rmse(&result["decoders"][0]["errors"], "dz_mm")
    };
    let sound = error("fills.bin", "sound.csv", &[]);
    assert_eq!(sound.to_bits(), error("plain.bin", "sound.csv", &[]).to_bits());
    for (value, kind) in [("0.02", "shorted (or too small)"), ("", "missing")] {
        changed(&folder, "faulty.csv", |name, _| (name == "r4c5_ohm").then_some(value));
        let said = folder.notes(&["decode", "fills.bin", "faulty.csv", "-o", "e.csv"]);
        assert!(said.contains(&format!("note: r4c5 {kind} in 100 % of lines")), "{said}");
        assert!(said.contains("missing readings of 100 % of lines were filled"), "{said}");
        assert!(column(&folder, "e.csv", "status").iter().all(|flags| flags == "2"));
        assert!(column(&folder, "e.csv", "r4e1_dz_mm").iter().all(|value| !value.is_empty()));
        // Believed, such a reading multiplies the error.
        assert!(error("fills.bin", "faulty.csv", &[]) < 1.1 * sound);
        if !value.is_empty() {
            assert!(error("fills.bin", "faulty.csv", &["--limits", "none"]) > 3.0 * sound);
        }
        let said = folder.notes(&["decode", "plain.bin", "faulty.csv", "-o", "e.csv"]);
        assert!(said.contains("r4c5") && !said.contains("filled"), "{said}");
        assert!(column(&folder, "e.csv", "r4e1_dz_mm").iter().all(String::is_empty));
        let refused = folder.fail(&["eval", "plain.bin", "faulty.csv"], 2);
        assert!(
            refused.contains("no line has") && refused.contains("--reading-model"),
            "{refused}"
        );
    }
    let whole = folder.notes(&["decode", "fills.bin", "sound.csv", "-o", "e.csv"]);
    assert_eq!(whole, "");
    assert!(column(&folder, "e.csv", "status").iter().all(|flags| flags == "0"));
}

#[test]
fn wires_are_named_and_columns_can_be_left_out() {
    let folder = prepared("health_wires");
    changed(&folder, "open.csv", |name, _| name.starts_with("r4c").then_some("1e9"));
    let said = folder.notes(&["decode", "fills.bin", "open.csv", "-o", "e.csv"]);
    assert!(said.contains("note: row-wire 4 open in 100 % of lines"), "{said}");
    assert!(!said.contains("r4c1_ohm"), "{said}");
    let eval = ["eval", "fills.bin", "sound.csv", "--without"];
    let result = folder.json(&[&eval[..], &["r4c*_ohm"]].concat());
    assert_eq!(result["health"]["readings_filled"], 18 * 200);
    assert_eq!(result["values_evaluated"], 144 * 200);
    let decode = ["decode", "fills.bin", "sound.csv", "-o", "e.csv", "--without"];
    let said = folder.notes(&[&decode[..], &["r1c*_ohm,r2c*_ohm,r3c1_ohm"]].concat());
    assert!(said.contains("100 % of lines were not filled: more than 1 in 4 of a frame"), "{said}");
    let said = folder.notes(&[&decode[..], &["r4c5_ohm", "--no-fill"]].concat());
    assert!(said.contains("100 % of lines were not filled: by --no-fill"), "{said}");
    // Also by the names that notes give them.
    let without = |names: &str| folder.json(&[&eval[..], &[names]].concat())["decoders"].clone();
    assert_eq!(without("r4c5,r2c1"), without("r4c5_ohm,r2c1_ohm"));
    let refused = folder.fail(&[&eval[..], &["r9c*_ohm"]].concat(), 2);
    assert!(refused.contains("--without r9c*_ohm"), "{refused}");
}

#[test]
fn a_recording_has_what_was_read_of_lines_filled_and_not() {
    let folder = prepared("health_recording");
    let is_many = |name: &str| name.ends_with("_ohm") && name < "r4";
    let is_faulty = |name: &str, line| name == "r4c5_ohm" || line % 4 == 0 && is_many(name);
    changed(&folder, "faulty.csv", |name, line| is_faulty(name, line).then_some("0.5"));
    let said = folder.notes(&["decode", "fills.bin", "faulty.csv", "-o", "d.mcap"]);
    assert!(said.contains("75 % of lines were filled"), "{said}");
    assert!(said.contains("25 % of lines were not filled"), "{said}");
    let reader = taxel_recording::Reader::open(&folder.path("d.mcap")).unwrap();
    let readings: Vec<f32> = reader.map(|frame| frame.unwrap().readings[3 * 18 + 4]).collect();
    assert_eq!(readings, [0.5; 200]);
}
