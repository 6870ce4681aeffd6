//! Training by recursion, as by a user: its estimates beside those of QR, streams, and the learning curve.

use std::io::Write as _;
use std::process::Stdio;

use crate::common::{Folder, program, small_scene};

/// Largest difference of two files of estimates.
fn largest_difference(folder: &Folder, files: [&str; 2]) -> f64 {
    let numbers = files.map(|file| {
        let text = std::fs::read_to_string(folder.path(file)).unwrap();
        let fields = text.lines().skip(1).flat_map(|line| line.split(','));
        fields.map(|field| field.parse::<f64>().unwrap()).collect::<Vec<_>>()
    });
    assert_eq!(numbers[0].len(), numbers[1].len());
    numbers[0].iter().zip(&numbers[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn decode(folder: &Folder, models: [&str; 2]) -> f64 {
    for model in models {
        folder.succeed(&[
            "decode",
            &format!("{model}.bin"),
            "test.csv",
            "-o",
            &format!("{model}.csv"),
        ]);
    }
    largest_difference(
        folder,
        models.map(|model| format!("{model}.csv")).each_ref().map(String::as_str),
    )
}

#[test]
fn both_solvers_give_the_same_estimates() {
    let folder = Folder::new("solvers");
    folder.write("scene.toml", small_scene());
    folder.succeed(&["synth", "scene.toml", "-n", "300", "--seed", "99", "-o", "test.csv"]);
    for format in ["f32", "fixed16"] {
        let train = ["train", "scene.toml", "--format", format];
        folder.succeed(&[&train[..], &["-o", "qr.bin"]].concat());
        folder.succeed(&[&train[..], &["--solver", "rls", "-o", "rls.bin"]].concat());
        let difference = decode(&folder, ["qr", "rls"]);
        assert!(difference <= 1e-5, "{format}: {difference:e} mm");
    }
}

#[test]
fn standard_input_trains_as_the_file_does_on_any_number_of_threads() {
    let folder = Folder::new("stdin");
    folder.write("scene.toml", small_scene());
    folder.succeed(&["synth", "scene.toml", "-n", "700", "-o", "data.csv"]);
    folder.succeed(&["synth", "scene.toml", "-n", "100", "--seed", "99", "-o", "test.csv"]);
    let options = ["--solver", "rls", "--centres", "12", "--first-frames", "300", "--no-refine"];
    let mut train = vec!["train", "data.csv", "-o", "file.bin"];
    train.extend(options);
    assert!(folder.run_with_threads(&train, 1).status.success());
    let mut child = program()
        .args([&["train", "-", "--json", "-o", "stdin.bin"], &options[..]].concat())
        .current_dir(folder.path(""))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let text = std::fs::read(folder.path("data.csv")).unwrap();
    child.stdin.take().unwrap().write_all(&text).unwrap();
    let output = child.wait_with_output().unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&summary["training_frames"], &summary["solver"]), (&700.into(), &"rls".into()));
    assert_eq!(summary["learning_curve"]["judged_on"], "next_frames");
    assert_eq!(decode(&folder, ["file", "stdin"]), 0.0);
    // Ranges and centres of all lines, as QR takes them; and a penalty, since QR's usual one has regard to few frames.
    let train = ["train", "data.csv", "--centres", "12", "--no-refine", "--penalty", "1e-9"];
    folder.succeed(&[&train[..], &["-o", "qr.bin"]].concat());
    folder.succeed(&[&train[..], &["--solver", "rls", "-o", "rls.bin"]].concat());
    let difference = decode(&folder, ["qr", "rls"]);
    assert!(difference <= 1e-5, "{difference:e} mm");
}

#[test]
fn a_scene_trains_by_recursion_in_pieces_and_draws_its_learning_curve() {
    let folder = Folder::new("stream");
    folder.write("scene.toml", small_scene().replacen("frames = 3000", "frames = 4500", 1));
    let train =
        ["train", "scene.toml", "--solver", "rls", "--first-frames", "200", "--curve", "c.svg"];
    let page = folder.succeed(&[&train[..], &["-o", "m.bin"]].concat());
    assert!(page.contains("4500 frames, weights by recursion") && page.contains("learning curve"));
    let curve = std::fs::read_to_string(folder.path("c.svg")).unwrap();
    assert!(
        curve.starts_with("<svg xmlns")
            && curve.contains("frames taken in")
            && curve.contains("Δz")
    );
    assert!(folder.succeed(&["inspect", "m.bin"]).contains("4500"));
}

#[test]
fn too_few_frames_for_a_learning_curve_are_told() {
    let folder = Folder::new("short-curve");
    folder.write("scene.toml", small_scene());
    folder.succeed(&["synth", "scene.toml", "-n", "10", "-o", "data.csv"]);
    let train =
        ["train", "data.csv", "--solver", "rls", "--no-refine", "--centres", "2", "-o", "m.bin"];
    let page = folder.succeed(&train);
    assert!(page.contains("no learning curve: its first error is measured on"), "{page}");
    std::fs::remove_file(folder.path("m.bin")).unwrap();
    let said = folder.fail(&[&train[..], &["--curve", "c.svg"]].concat(), 2);
    assert!(said.contains("after the tenth, and there are 10: leave it out"), "{said}");
    assert_eq!(folder.names(), ["data.csv", "scene.toml"]);
}
