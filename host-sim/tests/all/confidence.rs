//! Confidence from the command line: training, evaluation, and what is refused.

use crate::common::{Folder, small_scene};

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}

#[test]
fn a_model_with_a_confidence_is_judged_by_it_and_writes_it_beside_the_outputs() {
    let folder = Folder::new("confidence");
    folder.write("scene.toml", small_scene());
    folder.succeed(&["train", "scene.toml", "--confidence", "-o", "model.bin"]);
    folder.succeed(&["train", "scene.toml", "-o", "without.bin"]);
    // A scene may ask for it.
    folder.write("asks.toml", small_scene().replace("[training]", "[training]\nconfidence = true"));
    folder.succeed(&["train", "asks.toml", "-n", "600", "-o", "asked.bin"]);
    let inspected = folder.succeed(&["inspect", "asked.bin"]);
    assert!(inspected.contains("confidence"), "{inspected}");
    folder.succeed(&["synth", "scene.toml", "-n", "300", "--seed", "9", "-o", "test.csv"]);
    let evaluated = json(&folder.succeed(&["eval", "model.bin", "test.csv", "--json"]));
    assert_eq!(evaluated["coverage"].as_array().unwrap().len(), 3);
    assert!(evaluated["percent_novel"].as_f64().unwrap() < 4.0);
    let page = folder.succeed(&["eval", "model.bin", "test.csv"]);
    assert!(page.contains("surest quarter") && page.contains("are novel: unlike"));
    let without = json(&folder.succeed(&["eval", "without.bin", "test.csv", "--json"]));
    assert!(
        without["coverage"].as_array().unwrap().is_empty() && without["percent_novel"].is_null()
    );
    assert_eq!(without["decoders"], evaluated["decoders"]);
    assert!(folder.succeed(&["inspect", "model.bin"]).contains("confidence"));

    // Deviations and novelty stand beside the outputs.
    let plain = ["decode", "model.bin", "test.csv", "-o", "plain.csv"];
    folder.succeed(&plain);
    folder.succeed(&["decode", "model.bin", "test.csv", "--confidence", "-o", "with.csv"]);
    let read = |name: &str| std::fs::read_to_string(folder.path(name)).unwrap();
    let (plain, with) = (read("plain.csv"), read("with.csv"));
    let header: Vec<&str> = with.lines().next().unwrap().split(',').collect();
    assert_eq!(header.len(), 36 + 36 + 1 + 1);
    assert_eq!(
        (header[36], header[72], header[73]),
        ("r4e1_dx_mm_deviation", "novelty_nats", "status")
    );
    let novel = 128_u8;
    for (plain, with) in plain.lines().zip(with.lines()).skip(1) {
        let (outputs, status) = plain.rsplit_once(',').unwrap();
        let (_, with_novelty) = with.rsplit_once(',').unwrap();
        let flags: u8 = with_novelty.parse().unwrap();
        assert!(with.starts_with(&format!("{outputs},")) && (flags & !novel).to_string() == status);
        assert!(with.split(',').skip(36).all(|value| value.parse::<f64>().is_ok()));
    }
}

#[test]
fn measured_data_is_held_out_fold_by_fold() {
    let folder = Folder::new("confidence-measured");
    let line = |i: i32| {
        let (a, b) = (f64::from(i % 20), f64::from((i * 7) % 23));
        let noise = f64::from((i * 7919) % 101) / 101.0 - 0.5;
        format!("{a},{b},{},{},1\n", (0.2 * a).sin() + 0.1 * b + 0.3 * noise, i % 5)
    };
    let lines: String = (0..400).map(line).collect();
    folder.write("measured.csv", format!("a,b,y,place,one\n{lines}"));
    let train = |more: &[&str]| {
        let columns = ["train", "measured.csv", "--inputs", "a,b", "--outputs", "y", "-o", "m.bin"];
        folder.run(&[&columns[..], &["--centres", "8", "--no-refine"], more].concat())
    };
    assert!(train(&["--confidence", "--fold-column", "place"]).status.success());
    let evaluated = json(&folder.succeed(&["eval", "m.bin", "measured.csv", "--json"]));
    // The noise is uniform: one deviation holds 68 % of it, and so do held-out folds.
    let covered = &evaluated["coverage"][0]["all"];
    assert!((covered["percent_within_68"].as_f64().unwrap() - 68.3).abs() < 6.0, "{covered}");
    assert!(covered["percent_within_95"].as_f64().unwrap() > 92.0, "{covered}");

    assert!(evaluated["percent_novel"].as_f64().unwrap() < 2.0, "{evaluated}");

    let alone = train(&["--confidence", "--fold-column", "one"]);
    assert_eq!(alone.status.code(), Some(2));
    assert!(
        String::from_utf8_lossy(&alone.stderr)
            .contains("holds out one fold after the other; give at least 2")
    );
}

#[test]
fn too_few_frames_for_a_confidence_are_refused_and_few_are_warned_of() {
    let folder = Folder::new("confidence-few");
    folder.write("scene.toml", small_scene());
    let train = |frames| ["train", "scene.toml", "--confidence", "-n", frames, "-o", "m.bin"];
    let refused = folder.fail(&train("40"), 2);
    assert!(refused.contains("frames = 40") && refused.contains("at least 110"), "{refused}");
    assert_eq!(folder.names(), ["scene.toml"]);
    assert!(folder.succeed(&train("200")).contains("(few-frames-for-confidence)"));
}
