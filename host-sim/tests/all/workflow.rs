//! Work of users, from end to end, with the binary.

use crate::common::{Folder, rmse, small_scene, small_scene_with_table1, untimed};

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}

#[test]
fn a_csv_file_trains_decodes_and_evaluates() {
    let folder = Folder::new("csv-workflow");
    folder.write("scene.toml", small_scene());
    folder.succeed(&["synth", "scene.toml", "-n", "800", "-o", "train.csv"]);
    folder.succeed(&["synth", "scene.toml", "-n", "500", "--seed", "2", "-o", "test.csv"]);
    folder.succeed(&["train", "train.csv", "--each-row", "--centres", "12", "-o", "m.bin"]);
    folder.succeed(&["decode", "m.bin", "test.csv", "-o", "estimate.csv"]);

    let estimate = folder.read("estimate.csv");
    assert_eq!(estimate.lines().count(), 501);
    assert!(estimate.starts_with("r4e1_dx_mm,r4e1_dy_mm,r4e1_dz_mm,r4e2_dx_mm,"));

    let inspected = folder.json(&["inspect", "m.bin"]);
    assert_eq!(inspected["rows"], 2); // the names tell the row-wires
    assert_eq!(inspected["networks"][1]["centres"], 12);
    assert_eq!(inspected["outputs"][0]["unit"], "mm");

    let evaluated = folder.json(&["eval", "m.bin", "test.csv"]);
    let error = |decoder: usize| rmse(&evaluated["decoders"][decoder]["errors"], "dz_mm");
    assert!(error(0) < 0.4 * error(1), "{evaluated}");

    // The model tells what a linear decoder reached on frames that it was not fitted to: as on fresh frames.
    let run = ["run", "train.csv", "--test", "test.csv", "--centres", "12", "--no-refine"];
    let run = folder.json(&run);
    let fresh = run["decoders"].as_array().unwrap().iter().find(|it| it["decoder"] == "linear");
    let groups = evaluated["linear_at_training"].as_array().unwrap();
    assert_eq!(groups.len(), 3);
    for (group, fresh) in groups.iter().zip(fresh.unwrap()["errors"].as_array().unwrap()) {
        assert_eq!((&group["group"], &group["unit"]), (&fresh["group"], &fresh["unit"]));
        let ratio = group["rmse"].as_f64().unwrap() / fresh["rmse"].as_f64().unwrap();
        assert!((0.8..1.25).contains(&ratio), "{group} {fresh}");
    }
}

#[test]
fn same_seed_same_bytes_on_one_thread_and_on_two() {
    let folder = Folder::new("determinism");
    let scene = small_scene_with_table1().replace("frames = 1500", "frames = 400");
    folder.write("scene.toml", &scene);
    folder.write("span.toml", scene.replace("kind = \"relative\"", "kind = \"span\""));
    let all = |threads: usize| -> Vec<Vec<u8>> {
        let name = |what: &str| format!("{what}.{threads}");
        let (csv, scene_blob, csv_blob, out) = (name("d"), name("s"), name("m"), name("out"));
        let runs: [&[&str]; 4] = [
            &["synth", "span.toml", "-n", "1000", "-o", &csv],
            &["train", "span.toml", "--reading-model", "full", "-o", &scene_blob],
            &[
                "train",
                "d.2",
                "--each-row",
                "--select",
                "--no-refine",
                "--centres",
                "8,12",
                "--spread",
                "0.5,1",
                "-o",
                &csv_blob,
            ],
            &["run", "scene.toml", "-o", &out],
        ];
        for arguments in runs {
            let output = folder.run_with_threads(arguments, threads);
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        }
        let small = folder.path(&out).join("small");
        let in_folder = |path| std::fs::read_dir(path).unwrap().map(|e| e.unwrap().path());
        let mut written: Vec<_> =
            in_folder(small.clone()).chain(in_folder(small.join("figures"))).collect();
        written.retain(|path| path.is_file());
        written.sort();
        let files = [csv, scene_blob, csv_blob].into_iter().map(|f| folder.path(&f));
        files.chain(written).map(|f| std::fs::read(f).unwrap()).collect()
    };
    let two = all(2);
    let one = all(1);
    assert!(two.len() >= 7 && two.iter().all(|bytes| bytes.len() > 100));
    assert_eq!(one.len(), two.len());
    for (i, (one, two)) in one.iter().zip(&two).enumerate() {
        assert!(one == two, "file {i} differs");
    }
}

#[test]
fn run_writes_a_whole_folder_with_the_same_blob_as_train() {
    let folder = Folder::new("run");
    folder.write("scene.toml", small_scene_with_table1());
    let printed = json(&untimed(&folder.succeed(&["run", "scene.toml", "--json"])));
    folder.succeed(&["train", "scene.toml", "-o", "m.bin"]);
    let out = folder.path("out/small");
    assert_eq!(
        std::fs::read(out.join("model.bin")).unwrap(),
        std::fs::read(folder.path("m.bin")).unwrap()
    );
    let metrics = json(&std::fs::read_to_string(out.join("metrics.json")).unwrap());
    assert_eq!(metrics, printed);
    let table = std::fs::read_to_string(out.join("table1.csv")).unwrap();
    // (2 baselines + 10 spreads × 2 networks) × 3 axes.
    assert_eq!(table.lines().count(), 1 + (2 + 20) * 3);
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("<code>taxel run scene.toml --seed ") && page.contains("table1.csv"));
    let links: Vec<&str> =
        page.split("href=\"").skip(1).map(|it| it.split('"').next().unwrap()).collect();
    assert!(links.contains(&"figures/errors-by-electrode.svg"), "{links:?}");
    for link in links.iter().filter(|link| !link.starts_with('#')) {
        assert!(out.join(link).is_file(), "{link}");
    }
    let figures = std::fs::read_dir(out.join("figures")).unwrap().count();
    assert_eq!(figures, links.iter().filter(|link| link.starts_with("figures/")).count());
    let before = folder.names();
    folder.succeed(&["run", "scene.toml"]); // again, over what is there
    assert_eq!(folder.names(), before);
}

#[test]
fn every_command_has_help_with_an_example() {
    let folder = Folder::new("help");
    for command in [
        "run", "synth", "forward", "train", "decode", "eval", "inspect", "table1", "emulate",
        "link", "view",
    ] {
        let help = folder.succeed(&[command, "--help"]);
        assert!(help.contains(&format!("taxel {command} ")), "{help}");
        assert!(help.contains("--json"), "{help}");
    }
    let help = folder.succeed(&["trade", "-h"]);
    let options = |section: &str| section.lines().filter(|line| line.contains("--")).count();
    let (_, help) = help.split_once("\nOptions:\n").unwrap();
    let (own, rest) = help.split_once("\nTraining:\n").unwrap();
    let (training, rest) = rest.split_once("\nData files (CSV, .mcap):\n").unwrap();
    let (of_files, _) = rest.split_once("\nExamples:").unwrap();
    assert!((15..=22).contains(&options(own)) && own.contains("--seed"), "{own}");
    assert!(options(training) >= 10 && training.contains("--centres"), "{training}");
    assert!(options(of_files) >= 10 && of_files.contains("--test"), "{of_files}");
    assert!(!of_files.contains("--max-error"), "{of_files}");
}

#[test]
fn table1_shows_the_papers_cells_beside_its_own() {
    let folder = Folder::new("printed");
    // The limit of electrodes that move by themselves is slow: few frames.
    let few = "frames = 60\ntest_frames = 3\ncentres = 6\nstandard_frames = 20\n";
    let scene = include_str!("../../../scenes/paper.toml");
    let (before, _) = scene.split_once("frames = 6000").unwrap();
    let table = before.replace("[outputs]", "[readout]\nrow_wires = [4]\n\n[outputs]") + few;
    folder.write("paper.toml", &table);
    let (_, settings) = table.split_once("[table1]").unwrap();
    folder.write("press.toml", format!("{}\n[table1]{settings}", small_scene()));
    // Noise as large as this lets electrodes be sampled in a moment.
    let ohm = table.replace("relative\"\nlevel", "absolute\"\nlevel_ohm");
    folder.write("ohm.toml", ohm.replace("[0.005, 0.01, 0.05, 0.1]", "[2.0]"));
    for scene in ["press.toml", "ohm.toml"] {
        let page = folder.succeed(&["table1", scene]);
        assert!(!page.contains("As printed in the paper"), "{scene}: {page}");
        assert_eq!(page.contains(" 2 Ω"), scene == "ohm.toml", "{page}");
    }
    let page = folder.succeed(&["table1", "paper.toml", "-o", "t.csv"]);
    assert!(page.contains(" / 10.23") && page.contains("a constant"), "{page}");
    let csv = folder.read("t.csv");
    let printed = csv.lines().find(|line| line.starts_with("0.1,network,1,dz_mm,"));
    assert!(printed.is_some_and(|line| line.ends_with(",11.39")), "{csv}");
}
