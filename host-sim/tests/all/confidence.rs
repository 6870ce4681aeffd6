//! Full reading models from the command line: training, evaluation, and what is refused.

use crate::common::{Folder, small_scene};

#[test]
fn a_full_reading_model_is_evaluated_and_adds_output_columns() {
    let folder = Folder::new("confidence");
    folder.write("scene.toml", small_scene());
    folder.succeed(&["train", "scene.toml", "--reading-model", "full", "-o", "model.bin"]);
    folder.succeed(&["train", "scene.toml", "-o", "without.bin"]);
    // A scene may ask for it.
    folder.write(
        "asks.toml",
        small_scene().replace("[training]", "[training]\nreading_model = \"full\""),
    );
    folder.succeed(&["train", "asks.toml", "-n", "600", "-o", "asked.bin"]);
    let inspected = folder.succeed(&["inspect", "asked.bin"]);
    assert!(inspected.contains("novelty and deviations by"), "{inspected}");
    folder.succeed(&["synth", "scene.toml", "-n", "300", "--seed", "9", "-o", "test.csv"]);
    let evaluated = folder.json(&["eval", "model.bin", "test.csv"]);
    let coverage = evaluated["coverage"].as_array().unwrap();
    assert_eq!(coverage.len(), 9, "three parts of three groups");
    let rmse_of_z = [7, 8].map(|row: usize| coverage[row]["rmse"].as_f64());
    assert!(rmse_of_z[0] < rmse_of_z[1], "surest and least sure quarter: {rmse_of_z:?}");
    assert!(evaluated["percent_novel"].as_f64().unwrap() < 4.0);
    let page = folder.succeed(&["eval", "model.bin", "test.csv"]);
    assert!(page.contains("surest quarter") && page.contains("are novel: unlike"));
    let without = folder.json(&["eval", "without.bin", "test.csv"]);
    assert!(
        without["coverage"].as_array().unwrap().is_empty() && without["percent_novel"].is_null()
    );
    assert_eq!(without["decoders"], evaluated["decoders"]);

    // Deviations and novelty stand beside the outputs.
    let plain = ["decode", "model.bin", "test.csv", "-o", "plain.csv"];
    folder.succeed(&plain);
    folder.succeed(&["decode", "model.bin", "test.csv", "--confidence", "-o", "with.csv"]);
    let (plain, with) = (folder.read("plain.csv"), folder.read("with.csv"));
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
