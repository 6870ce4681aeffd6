//! Recordings as files of commands: the same numbers as in CSV files, and what a kill leaves.

use std::fs;

use taxel_recording::Reader;

use crate::common::{Folder, rmse};

/// Fields of a CSV file.
fn csv(folder: &Folder, name: &str) -> Vec<Vec<f64>> {
    let text = folder.read(name);
    let number = |field: &str| field.parse().unwrap_or(f64::NAN);
    text.lines().skip(1).map(|line| line.split(',').map(number).collect()).collect()
}

#[test]
fn frames_in_a_recording_are_those_of_a_csv_file() {
    let folder = Folder::new("recordings");
    let synth = ["synth", "press", "-n", "40", "--seed", "3"];
    folder.succeed(&[&synth[..], &["-o", "a.csv"]].concat());
    folder.succeed(&[&synth[..], &["-o", "a.mcap"]].concat());
    let mut reader = Reader::open(&folder.path("a.mcap")).unwrap();
    assert!(reader.extras().unwrap().scene.unwrap().contains("name = \"press\""));
    for (line, frame) in csv(&folder, "a.csv").iter().zip(&mut reader) {
        let frame = frame.unwrap();
        let values = frame.readings.into_iter().chain(frame.truth.unwrap());
        assert!(line.iter().map(|value| *value as f32).eq(values));
    }
    let train = ["train", "press", "-n", "400", "--centres", "8", "--no-refine", "-o", "m.bin"];
    folder.succeed(&train);
    for (from, to) in [("a.csv", "b.csv"), ("a.mcap", "c.csv"), ("a.mcap", "d.mcap")] {
        folder.succeed(&["decode", "m.bin", from, "-o", to]);
    }
    assert_eq!(fs::read(folder.path("b.csv")).unwrap(), fs::read(folder.path("c.csv")).unwrap());
    let mut decoded = Reader::open(&folder.path("d.mcap")).unwrap();
    let blob = fs::read(folder.path("m.bin")).unwrap();
    assert_eq!(decoded.extras().unwrap().blob, Some(blob));
    for (line, frame) in csv(&folder, "b.csv").iter().zip(&mut decoded) {
        let outputs = frame.unwrap().outputs.unwrap();
        assert!(line.iter().map(|value| *value as f32).take(144).eq(outputs));
    }
    let evaluated = ["a.csv", "a.mcap"].map(|file| folder.json(&["eval", "m.bin", file]));
    // A recording has readings as f32.
    for group in ["dx_mm", "dy_mm", "dz_mm"] {
        let [a, b] = evaluated.each_ref().map(|it| rmse(&it["decoders"][0]["errors"], group));
        assert!((a - b).abs() < 1e-6, "{a} mm, {b} mm");
    }
    folder.succeed(&["train", "a.mcap", "--centres", "2", "--no-refine", "-o", "t.bin"]);
    // Estimates are no truth.
    let said = folder.fail(&["eval", "m.bin", "d.mcap"], 2);
    assert!(said.contains("d.mcap"), "{said}");
    let keep = ["decode", "m.bin", "a.csv", "--keep", "r1c1_ohm", "-o", "e.mcap"];
    assert!(folder.fail(&keep, 2).contains("--keep"));
}

#[test]
fn a_recording_that_was_cut_is_mended_when_it_is_opened() {
    let folder = Folder::new("recordings_cut");
    folder.succeed(&["synth", "press", "-n", "900", "-o", "a.mcap"]);
    let bytes = fs::read(folder.path("a.mcap")).unwrap();
    folder.write("cut.mcap", &bytes[..bytes.len() * 2 / 3]);
    let train = ["train", "press", "-n", "400", "--centres", "8", "--no-refine", "-o", "m.bin"];
    folder.succeed(&train);
    let decode = |to: &str| {
        let output = folder.run(&["decode", "m.bin", "cut.mcap", "-o", to]);
        assert!(output.status.success());
        (csv(&folder, to).len(), String::from_utf8(output.stderr).unwrap())
    };
    // While somebody records it, it is read as it is.
    let recorded = fs::File::open(folder.path("cut.mcap")).unwrap();
    recorded.lock().unwrap();
    let (frames, said) = decode("a.csv");
    assert!(said.contains("cut.mcap has no end") && said.contains("is being recorded"), "{said}");
    assert!(frames > 100 && frames < 900, "{frames}");
    drop(recorded);
    let (mended, said) = decode("b.csv");
    assert!(said.contains("cut.mcap had no end"), "{said}");
    assert!(said.contains(&format!("repaired, with {frames} frames")), "{said}");
    let (again, said) = decode("c.csv");
    assert!([mended, again] == [frames; 2] && !said.contains("cut.mcap"), "{said}");
    folder.write("no.mcap", "not a recording");
    let said = folder.fail(&["decode", "m.bin", "no.mcap", "-o", "d.csv"], 2);
    assert!(said.contains("no.mcap"), "{said}");
}
