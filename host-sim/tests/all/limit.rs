//! The limit from the command line, and beside the errors of decoders.

use serde_json::Value;

use crate::common::{Folder, small_scene, tiny_scene};

#[test]
fn models_are_judged_on_the_frames_of_the_limit() {
    let folder = Folder::new("limit-models");
    folder.write("scene.toml", small_scene());
    folder.succeed(&["train", "scene.toml", "-o", "m.bin"]);
    folder.succeed(&["train", "scene.toml", "--relative-inputs", "-o", "relative.bin"]);
    let models = ["limit", "scene.toml", "--model", "m.bin,relative.bin", "-n"];
    let result = folder.json(&[&models[..], &["60"]].concat());
    let limit = result["limits"][0]["limit_dz_mm"].as_f64().unwrap();
    let of_z = result["models"].as_array().unwrap().iter().filter(|it| it["group"] == "dz_mm");
    for (errors, file) in of_z.zip(["m.bin", "relative.bin"]) {
        assert_eq!(errors["model"], file);
        let number = |name: &str| errors[name].as_f64().unwrap();
        let (ratio, error) = (number("ratio_to_limit"), number("ratio_standard_error"));
        assert!(ratio > 1.0 + 2.0 * error, "{file}: {ratio} ± {error}");
        // The plain ratio of the two RMSE is the same, but for chance: these are 60 frames.
        let plain = number("rmse") / limit;
        assert!((plain / ratio - 1.0).abs() < 0.2, "{file}: {plain} and {ratio}");
    }
    let page = folder.succeed(&[&models[..], &["4", "-o", "out"]].concat());
    assert!(page.contains("\nm.bin ") && page.contains("\nrelative.bin "), "{page}");
    let page = folder.read("out/limit.html");
    assert!(page.contains("<td>m.bin</td>") && page.contains("<td>relative.bin</td>"));
}

#[test]
fn several_scenes_share_a_table_with_the_figures_of_each_alone() {
    let folder = Folder::new("limit-scenes");
    folder.write("one.toml", small_scene().replace("name = \"small\"", "name = \"one\""));
    folder.write("two.toml", tiny_scene());
    let both = ["limit", "one.toml", "two.toml", "-n", "8"];
    let results = folder.json(&[&both[..], &["-o", "out"]].concat());
    let table = folder.succeed(&both);
    let all = results["limits"].as_array().unwrap();
    for (scene, name) in [("one", "one"), ("two", "small")] {
        let file = format!("{scene}.toml");
        let alone = folder.json(&["limit", &file, "-n", "8"]);
        let own: Vec<_> = all.iter().filter(|line| line["scene"] == name).collect();
        let numbers =
            |line: &Value| [&line["limit_dz_mm"], &line["limit_dx_mm"]].map(Value::as_f64);
        let alone = alone["limits"].as_array().unwrap();
        let readings = ["all 2 rows", "row 4", "row 5"];
        assert!(own.iter().map(|it| &it["readings"]).eq(readings), "{own:?}");
        assert!(own.iter().map(|it| numbers(it)).eq(alone.iter().map(numbers)), "{own:?}");
        assert!(folder.path(&format!("out/{name}/limit.html")).exists());
        let z = own[0]["limit_dz_mm"].as_f64().unwrap();
        let line = table.lines().find(|line| line.starts_with(name));
        assert!(line.unwrap().contains(&format!("{z:.4} ± ")), "{table}");
    }
    // One that has no limit takes nothing from the others.
    let drifts = "[drift]\ngain = 0.02\n\n[noise]";
    folder.write("drifts.toml", small_scene().replace("[noise]", drifts));
    let table = folder.succeed(&["limit", "one.toml", "drifts.toml", "-n", "8"]);
    assert!(table.lines().any(|line| line.starts_with("one ")), "{table}");
    assert!(table.contains("not given"), "{table}");
    let twice = folder.fail(&["limit", "one.toml", "one.toml"], 2);
    assert!(twice.contains("two scenes have the same name"), "{twice}");
}

#[test]
fn a_row_by_itself_is_listed_once() {
    let folder = Folder::new("limit-row");
    folder.write("scene.toml", small_scene());
    for (row, count) in [(&["--row", "4"][..], 1), (&[], 3)] {
        let result = folder.json(&[&["limit", "scene.toml", "-n", "4"], row].concat());
        for list in ["limits", "directions"] {
            assert_eq!(result[list].as_array().unwrap().len(), count, "{row:?}: {list}");
        }
    }
}
