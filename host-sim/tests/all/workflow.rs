//! Work of users, from end to end, with the binary.

use std::fmt::Write as _;

use crate::common::{Folder, small_scene, small_scene_with_table1, untimed};

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}

#[test]
fn a_csv_file_trains_decodes_and_evaluates() {
    let folder = Folder::new("csv-workflow");
    folder.write("scene.toml", small_scene());
    folder.succeed(&["synth", "scene.toml", "-n", "1500", "-o", "train.csv"]);
    folder.succeed(&["synth", "scene.toml", "-n", "500", "--seed", "2", "-o", "test.csv"]);
    folder.succeed(&["train", "train.csv", "--each-row", "--centres", "12", "-o", "m.bin"]);
    folder.succeed(&["decode", "m.bin", "test.csv", "-o", "estimate.csv"]);

    let estimate = std::fs::read_to_string(folder.path("estimate.csv")).unwrap();
    assert_eq!(estimate.lines().count(), 501);
    assert!(estimate.starts_with("r4e1_dx_mm,r4e1_dy_mm,r4e1_dz_mm,r4e2_dx_mm,"));

    let inspected = json(&folder.succeed(&["inspect", "m.bin", "--json"]));
    assert_eq!(inspected["rows"], 2); // the names tell the row-wires
    assert_eq!(inspected["networks"][1]["centres"], 12);
    assert_eq!(inspected["outputs"][0]["unit"], "mm");

    let command = ["eval", "m.bin", "test.csv", "--html", "page.html"];
    let evaluated = json(&folder.succeed(&[&command[..], &["--json"]].concat()));
    let page = std::fs::read_to_string(folder.path("page.html")).unwrap();
    for text in [
        "m.bin on test.csv",
        "host-sim eval m.bin test.csv --html page.html",
        "<title>row-wire 4, electrode 1: ",
        "relative to the median",
    ] {
        assert!(page.contains(text), "{text}");
    }
    let rmse = |decoder: usize| {
        let groups = evaluated["decoders"][decoder]["errors"].as_array().unwrap();
        let z = groups.iter().find(|g| g["group"] == "dz_mm").unwrap();
        z["rmse"].as_f64().unwrap()
    };
    assert!(rmse(0) < 0.4 * rmse(1), "{evaluated}");

    // The model tells what a linear decoder reached on frames that it was not fitted to: as on fresh frames.
    let run = ["run", "train.csv", "--test", "test.csv", "--centres", "12", "--no-refine"];
    let run = json(&folder.succeed(&[&run[..], &["--json"]].concat()));
    let fresh = run["decoders"].as_array().unwrap().iter().find(|it| it["decoder"] == "linear");
    let groups = evaluated["linear_at_training"].as_array().unwrap();
    assert_eq!(groups.len(), 3);
    for (group, fresh) in groups.iter().zip(fresh.unwrap()["errors"].as_array().unwrap()) {
        assert_eq!((&group["group"], &group["unit"]), (&fresh["group"], &fresh["unit"]));
        let ratio = group["rmse"].as_f64().unwrap() / fresh["rmse"].as_f64().unwrap();
        assert!((0.8..1.25).contains(&ratio), "{group} {fresh}");
    }
    assert!(page.contains("Linear in training"));
}

#[test]
fn moving_contacts_are_written_as_a_log_and_still_ones_as_a_model_is_trained_on() {
    let folder = Folder::new("moving");
    let motion = "[motion]\nspeed_mm_per_s = [10.0, 100.0]\npress_rate_hz = [1.0, 5.0]\nduration_s = 0.1\n[noise]";
    let scene = small_scene();
    folder.write("moving.toml", scene.replace("[noise]", motion));
    folder.write("still.toml", scene);
    let synth = |arguments: &str| {
        let of = ["synth"].into_iter().chain(arguments.split(' ')).chain(["-o", "f.csv"]);
        folder.succeed(&of.collect::<Vec<_>>());
        std::fs::read_to_string(folder.path("f.csv")).unwrap()
    };
    let fields = |text: &str, line: usize| {
        text.lines().nth(line).unwrap().split(',').take(3).map(String::from).collect::<Vec<_>>()
    };
    let log = synth("moving.toml -n 250 --frame-rate 1000 --scan-ms 0.9");
    assert_eq!(fields(&log, 0), ["time_s", "trajectory", "r4c1_ohm"]);
    assert_eq!(fields(&log, 100)[..2], ["0.099", "1"]);
    assert_eq!(fields(&log, 101)[..2], ["1.1", "2"]);
    assert_eq!(synth("moving.toml -n 20 --still"), synth("still.toml -n 20"));
    // The untouched sensor over time: the draws of one trajectory.
    let rest = synth("still.toml -n 30 --untouched --frame-rate 50 --scan-ms 5");
    assert_eq!(fields(&rest, 30)[..2], ["0.58", "1"]);
    assert_ne!(fields(&rest, 30)[2], fields(&rest, 29)[2]);
}

#[test]
fn one_network_for_the_whole_array_needs_every_reading_and_has_less_error() {
    let folder = Folder::new("array");
    folder.write("scene.toml", small_scene());
    folder.succeed(&["train", "scene.toml", "-n", "2000", "-o", "rows.bin"]);
    let scene =
        small_scene().replace("each_row = true\n", "").replace("spread = 0.8", "spread = 0.4");
    folder.write("array.toml", scene);
    folder.succeed(&["train", "array.toml", "-n", "2000", "-o", "array.bin"]);
    let printed = folder.succeed(&["inspect", "array.bin"]);
    assert!(printed.contains("36 readings → 18 features for all rows"), "{printed}");
    assert!(printed.contains("\nnetwork 0 ") && !printed.contains("network 1"), "{printed}");
    let printed = folder.succeed(&["inspect", "rows.bin"]);
    assert!(printed.contains("\nnetworks 0–1 ") && !printed.contains("network 0"), "{printed}");
    folder.succeed(&["synth", "scene.toml", "-n", "1000", "--seed", "9", "-o", "d.csv"]);
    let rmse = |model: &str| {
        let result = json(&folder.succeed(&["eval", model, "d.csv", "--json"]));
        let groups = result["decoders"][0]["errors"].as_array().unwrap().iter();
        groups.map(|group| group["rmse"].as_f64().unwrap()).sum::<f64>()
    };
    let (of_array, of_rows) = (rmse("array.bin"), rmse("rows.bin"));
    assert!(of_array < of_rows, "{of_array} {of_rows}");

    // The spread of the array's network is half of that of a row's.
    folder.succeed(&["train", "array.toml", "-n", "2000", "--each-row", "-o", "rows2.bin"]);
    let networks =
        |model: &str| json(&folder.succeed(&["inspect", model, "--json"]))["networks"].clone();
    assert_eq!(networks("rows2.bin"), networks("rows.bin"));

    let data = std::fs::read_to_string(folder.path("d.csv")).unwrap();
    let mut lines: Vec<Vec<&str>> = data.lines().map(|l| l.split(',').collect()).collect();
    lines[2][0] = "";
    folder.write("holed.csv", lines.iter().map(|l| l.join(",") + "\n").collect::<String>());
    let printed = folder.succeed(&["decode", "array.bin", "holed.csv", "-o", "e.csv"]);
    assert!(printed.contains("1 of them miss a reading: all outputs are empty"), "{printed}");
    let estimate = std::fs::read_to_string(folder.path("e.csv")).unwrap();
    let empty: Vec<usize> = estimate
        .lines()
        .map(|line| line.split(',').filter(|cell| cell.is_empty()).count())
        .collect();
    assert_eq!(empty[..4], [0, 0, 36, 0]);
}

#[test]
fn forward_follows_the_equations() {
    let folder = Folder::new("forward");
    let names: Vec<String> = (1..=8)
        .flat_map(|m| {
            (1..=6).flat_map(move |i| ["x", "y", "z"].map(|a| format!("r{m}e{i}_d{a}_mm")))
        })
        .collect();
    let moved: Vec<String> =
        (0..144).map(|i| format!("{}", f64::from(i % 7) * 0.125 - 0.375)).collect();
    // The last line is of another piece than the 99 lines at rest before it.
    let at_rest = format!("{}\n", ["0"; 144].join(",")).repeat(99);
    folder.write("d.csv", format!("{}\n{at_rest}{}\n", names.join(","), moved.join(",")));
    folder.succeed(&["forward", "paper", "d.csv", "-o", "r.csv"]);
    let written = std::fs::read_to_string(folder.path("r.csv")).unwrap();
    let (header, values) = written.split_once('\n').unwrap();
    let values = values.lines().nth(99).unwrap();
    assert!(header.starts_with("r1c1_ohm,r1c2_ohm,") && header.ends_with(",r8c18_ohm"));
    // By hand, node after node, straight from equations 1 to 7.
    for (place, value) in values.trim().split(',').enumerate() {
        let (m, k) = (place / 18, place % 18);
        let mut conductance = 0.0;
        for i in 0..6 {
            let delta =
                |axis: usize| f64::from(((m * 6 + i) * 3 + axis) as u32 % 7) * 0.125 - 0.375;
            let u = [(i as f64 + 0.5) * 20.0 / 6.0, (m as f64 + 0.5) * 2.25, 5.0];
            for j in 0..3 {
                let l = [(k as f64 + 0.5) * 20.0 / 18.0, (f64::from(j) + 0.5) * 6.0, 0.0];
                let squared: f64 = (0..3).map(|a| (u[a] - delta(a) - l[a]).powi(2)).sum();
                conductance += 1.0 / (100.0 * squared.sqrt());
            }
        }
        let relative = value.parse::<f64>().unwrap() * conductance - 1.0;
        assert!(relative.abs() <= 1e-12, "r{}c{}: {relative:e}", m + 1, k + 1);
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
            &["train", "span.toml", "-o", &scene_blob],
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
fn run_writes_a_whole_folder_and_its_blob_is_the_one_that_train_writes() {
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
    // (2 baselines + 10 spreads × 2 networks) × 3 axes × 7 definitions.
    assert_eq!(table.lines().count(), 1 + (2 + 20) * 3 * 7);
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("<code>host-sim run scene.toml --seed ") && page.contains("table1.csv"));
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
        assert!(help.contains(&format!("host-sim {command} ")), "{help}");
        assert!(help.contains("--json"), "{help}");
    }
    let help = folder.succeed(&["trade", "-h"]);
    let options = |section: &str| section.lines().filter(|line| line.contains("--")).count();
    let (_, help) = help.split_once("\nOptions:\n").unwrap();
    let (own, rest) = help.split_once("\nData files (CSV, .mcap):\n").unwrap();
    let (of_files, _) = rest.split_once("\nExamples:").unwrap();
    assert!((20..=31).contains(&options(own)) && own.contains("--seed"), "{own}");
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
    folder.write("other.toml", table.replace("0.05, 0.1]", "0.06, 0.1]"));
    folder.write("wider.toml", table.replace("[20.0, 18.0, 5.0]", "[21.0, 18.0, 5.0]"));
    let (_, settings) = table.split_once("[table1]").unwrap();
    folder.write("press.toml", format!("{}\n[table1]{settings}", small_scene()));
    folder.write("ohm.toml", table.replace("relative\"\nlevel", "absolute\"\nlevel_ohm"));
    for scene in ["other.toml", "wider.toml", "press.toml", "ohm.toml"] {
        assert!(folder.fail(&["table1", scene, "--svg", "t.svg"], 2).contains("--svg"));
    }
    let page = folder.succeed(&["table1", "ohm.toml"]);
    assert!(page.contains("0.05 Ω") && !page.contains("As the paper prints it"), "{page}");
    let same = folder.fail(&["table1", "paper.toml", "-o", "t.svg", "--svg", "t.svg"], 2);
    assert!(same.contains("a file of its own"), "{same}");
    let page = folder.succeed(&["table1", "paper.toml", "-o", "t.csv", "--svg", "t.svg"]);
    assert!(page.contains(" / 10.23") && page.contains("a constant"), "{page}");
    let csv = std::fs::read_to_string(folder.path("t.csv")).unwrap();
    assert!(csv.ends_with("\n0.1,paper,1,dz_mm,as_printed,11.39\n"));
    let picture = std::fs::read_to_string(folder.path("t.svg")).unwrap();
    assert!(
        picture.contains("printed") && picture.contains("computed") && !picture.contains("NaN")
    );
    // Networks in f64 that are judged on their own samples: as many centres as frames leave no error.
    let open = "[table1.open]\ninputs_scaled = \"range\"\nspread_is = \"sigma\"\nbias = false\n\
                initial_covariance = 1e9\njudged_on = \"training\"\n";
    folder.write("open.toml", table.replace("centres = 6", "centres = 59") + open);
    let result = json(&folder.succeed(&["table1", "open.toml", "--json"]));
    let cells = &result["comparison"][4]["cells"][0];
    assert!(cells[3].as_f64().unwrap() < 1.0, "{cells}");
    assert_eq!(result["test_frames"], 60);
    assert_eq!(result["solver"], "qr");
}

#[test]
fn inspect_says_what_image_a_model_needs() {
    let folder = Folder::new("needs");
    // One row of so many readings, whose sum is the output.
    let csv = |readings: usize| {
        let names: Vec<String> = (1..=readings).map(|i| format!("ch{i}")).collect();
        let mut csv = format!("{},f_n\n", names.join(","));
        for line in 0..60 {
            let values: Vec<usize> = (0..readings).map(|i| 50 + (line * (i + 3)) % 101).collect();
            let sum: usize = values.iter().sum();
            let values: Vec<String> = values.iter().map(usize::to_string).collect();
            let _ = writeln!(csv, "{},{sum}", values.join(","));
        }
        csv
    };
    for (readings, says) in [
        (18, None),
        (20, Some("TAXEL_CAPACITY=8x20x18")),
        (40, Some("TAXEL_CAPACITY=8x8x18")),
        (37, Some("37 readings without names of wires fill no rows of 32 or fewer")),
    ] {
        folder.write("data.csv", csv(readings));
        let train = ["train", "data.csv", "--inputs", "ch*", "--outputs", "f_n", "--centres", "8"];
        folder.succeed(&[&train[..], &["--no-refine", "-o", "m.bin"]].concat());
        let printed = folder.succeed(&["inspect", "m.bin"]);
        assert!(printed.contains("a frame ") && printed.contains(" cycles ("), "{printed}");
        match says {
            Some(says) => assert!(printed.contains(says), "{printed}"),
            None => assert!(!printed.contains("TAXEL_CAPACITY"), "{printed}"),
        }
    }
}
