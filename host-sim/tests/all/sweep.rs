//! Sweeps: what comes out does not depend on how a plan was cut, and nothing is mixed that does not belong together.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use host_sim::experiment::Experiment;
use host_sim::sweep::file::Wanted;
use host_sim::sweep::plan::Base;
use host_sim::sweep::{Plan, Point, work};
use serde_json::Value;
use taxel_data::Silent;

use crate::common::{Folder, small_scene, tiny_scene};

/// Plan of four points of `scene.toml`, two of which share their limit.
pub const PLAN: &str = "name = \"tiny\"\nscene = \"scene.toml\"\nlimit_frames = 4\nobjectives = [\"rmse_dz_mm\", \"frame_ms\"]\n\
                        [axes]\nnoise.level = [0.005, 0.02]\ntraining.centres = [4, 8]\n";

fn prepared(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("scene.toml", tiny_scene());
    folder.write("plan.toml", PLAN);
    folder
}

/// Files of points in a sweep's folder, by name.
fn points(folder: &Folder, of: &str) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder.path(of).join("points")).unwrap().map(Result::unwrap);
    entries
        .map(|it| (it.file_name().into_string().unwrap(), fs::read(it.path()).unwrap()))
        .collect()
}

#[test]
fn any_shards_give_what_one_process_gives() {
    let folder = prepared("sweep_shards");
    let said = folder.succeed(&["sweep", "plan.toml", "-o", "whole"]);
    assert!(said.contains("4 points, 4 settings"), "{said}");
    let whole = points(&folder, "whole");
    assert_eq!(whole.len(), 4);
    for count in [2, 3, 7] {
        let of = format!("of{count}");
        for index in 1..=count {
            // One thread here and two there: bits do not depend on it.
            let shard = format!("{index}/{count}");
            let out =
                folder.run_with_threads(&["sweep", "plan.toml", "--shard", &shard, "-o", &of], 1);
            assert!(out.status.success(), "{out:?}");
        }
        assert_eq!(points(&folder, &of), whole);
        folder.succeed(&["sweep", "plan.toml", "--merge", &of, "-o", "merged.csv"]);
        assert_eq!(folder.read("merged.csv"), folder.read("whole/results.csv"));
    }
    let table = folder.read("merged.csv");
    assert!(
        table.starts_with("id,noise.level,training.centres,rows,columns,area_cm2,scan_ms,"),
        "{table}"
    );
    assert_eq!(table.lines().count(), 5);
    for name in
        ["merged.json", "merged.html", "figures/merged-front.svg", "figures/merged-effects.svg"]
    {
        assert!(folder.read(name).len() > 400, "{name}");
    }
    let page = folder.read("merged.html");
    assert!(page.contains("Pareto front") && page.contains("href=\"merged.csv\""));
    assert!(page.contains("href=\"figures/merged-front.svg\">SVG</a>"));
    // The scene of a setting on the front is a scene.
    let merged: Value = serde_json::from_str(&folder.read("merged.json")).unwrap();
    let front =
        merged["settings"].as_array().unwrap().iter().find(|it| it["on_front"] == true).unwrap();
    folder.write("best.toml", front["scene_toml"].as_str().unwrap());
    folder.succeed(&["synth", "best.toml", "-n", "2", "-o", "best.csv"]);
}

#[test]
fn a_sweep_goes_on_where_it_was_stopped() {
    let folder = prepared("sweep_resumed");
    folder.succeed(&["sweep", "plan.toml", "--shard", "1/2"]);
    let first = points(&folder, "out/tiny");
    assert_eq!(first.len(), 2);
    let none = folder.fail(&["sweep", "plan.toml", "--merge", "elsewhere"], 1);
    assert!(none.contains("nothing is written") && !folder.path("elsewhere").exists(), "{none}");
    let missing = folder.fail(&["sweep", "plan.toml", "--merge", "out/tiny"], 1);
    assert!(missing.contains("2 of 4 points are missing"), "{missing}");
    let begun =
        first.keys().map(|name| fs::metadata(folder.path("out/tiny/points").join(name)).unwrap());
    let begun: Vec<_> = begun.map(|it| it.modified().unwrap()).collect();
    let text = folder.json(&["sweep", "plan.toml", "--shard", "1/1"]);
    assert_eq!((&text["computed"], &text["there_already"]), (&2.into(), &2.into()));
    let kept =
        first.keys().map(|name| fs::metadata(folder.path("out/tiny/points").join(name)).unwrap());
    assert_eq!(
        kept.map(|it| it.modified().unwrap()).collect::<Vec<_>>(),
        begun,
        "not written again"
    );
    folder.succeed(&["sweep", "plan.toml", "--merge", "out/tiny"]);
}

#[test]
fn a_file_that_is_no_result_is_refused_by_name_and_replaced() {
    let folder = prepared("sweep_damaged");
    folder.succeed(&["sweep", "plan.toml"]);
    let whole = points(&folder, "out/tiny");
    let names: Vec<&String> = whole.keys().collect();
    let path = |name: &str| folder.path("out/tiny/points").join(name);
    let mut flipped = whole[names[0]].clone();
    flipped[200] ^= 1;
    let cut = whole[names[1]][..300].to_vec();
    let foreign = whole[names[3]].clone();
    for (name, bytes, said) in [
        (names[0], flipped, "its CRC does not match its content"),
        (names[1], cut, "its CRC does not match its content"),
        (names[2], foreign, "the result of another point"),
        (names[2], vec![], "not a result of a sweep"),
        (names[2], vec![0xFF, 0xFE], "not text"),
    ] {
        fs::write(path(name), &bytes).unwrap();
        let message = folder.fail(&["sweep", "plan.toml", "--merge", "out/tiny", "-o", "x.csv"], 2);
        assert!(message.contains(name.as_str()) && message.contains(said), "{message}");
        assert!(!folder.path("x.csv").exists());
        let out = folder.run(&["sweep", "plan.toml"]);
        let remarks = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(out.status.success() && remarks.contains(said), "{remarks}");
        assert_eq!(points(&folder, "out/tiny"), whole);
    }
}

#[test]
fn old_results_have_the_fields_of_the_plan_that_takes_them() {
    let folder = prepared("sweep_new_axis");
    let of_noise = "[axes]\nnoise.level = [0.005, 0.02]\ntraining.centres = [4, 8]\n";
    folder.write("plan.toml", PLAN.replace(of_noise, "[axes]\ntraining.centres = [4, 8]\n"));
    folder.succeed(&["sweep", "plan.toml"]);
    // The scene's noise is a value of the new axis, so both points are taken.
    let level = tiny_scene();
    let level = level.lines().find_map(|line| line.strip_prefix("level = ")).unwrap();
    folder.write("plan.toml", PLAN.replace("[0.005, 0.02]", &format!("[{level}, 0.03]")));
    let shard = folder.json(&["sweep", "plan.toml", "--shard", "1/1"]);
    assert_eq!((&shard["computed"], &shard["there_already"]), (&2.into(), &2.into()));
    folder.succeed(&["sweep", "plan.toml"]);
    for line in folder.read("out/tiny/results.csv").lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        assert!([level, "0.03"].contains(&cells[1]) && ["4", "8"].contains(&cells[2]), "{line}");
    }
}

#[test]
fn another_plan_does_not_take_old_results() {
    let folder = prepared("sweep_changed");
    folder.succeed(&["sweep", "plan.toml"]);
    let old = folder.read("out/tiny/results.csv");
    // Half of the points stay the same, and are taken; the files of the others are left alone.
    folder.write("plan.toml", PLAN.replace("[4, 8]", "[4, 6]"));
    let out = folder.run(&["sweep", "plan.toml"]);
    let remarks = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(
        out.status.success()
            && remarks.contains("2 files in out/tiny/points, which belong to no point"),
        "{remarks}"
    );
    let new = folder.read("out/tiny/results.csv");
    let same = new.lines().filter(|line| old.lines().any(|known| known == *line)).count();
    assert_eq!((same, points(&folder, "out/tiny").len()), (3, 6), "head and two points");
    // Settings of all points change all of them, and so does a scene.
    folder.write("plan.toml", PLAN.replace("limit_frames = 4", "limit_frames = 5"));
    assert!(
        folder
            .fail(&["sweep", "plan.toml", "--merge", "out/tiny"], 1)
            .contains("no results of this plan")
    );
    folder.write("plan.toml", PLAN);
    folder.write("scene.toml", tiny_scene().replace("seed = 1", "seed = 2"));
    assert!(
        folder
            .fail(&["sweep", "plan.toml", "--merge", "out/tiny"], 1)
            .contains("no results of this plan")
    );
}

#[test]
fn points_that_cannot_be_are_named_and_the_others_computed() {
    let folder = prepared("sweep_failed");
    let deeper = "deformation.dent_depth_mm.1 = [1.0, 3.0]\nnoise.level";
    folder.write("plan.toml", PLAN.replace("noise.level", deeper).replace("[4, 8]", "[4]"));
    let out = folder.run(&["sweep", "plan.toml"]);
    let remarks = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(out.status.success() && remarks.contains("20 % of the thickness"), "{remarks}");
    let said = String::from_utf8_lossy(&out.stdout).into_owned();
    assert!(said.contains("Only 2 of 4 points have the result RMSE of Δz."), "{said}");
    let table = folder.read("out/tiny/results.csv");
    assert_eq!(
        table.lines().filter(|line| line.contains("20 % of the thickness")).count(),
        2,
        "{table}"
    );
}

#[test]
fn repeats_are_put_together_and_draws_are_the_same_everywhere() {
    let folder = prepared("sweep_drawn");
    let plan = "name = \"drawn\"\nscene = \"scene.toml\"\nlimit_frames = 2\nrepeats = 2\n\
                [prices]\nfixed_eur = 5.0\nrow_eur = 2.0\ncolumn_eur = 0.5\ncm2_eur = 0.25\n[set]\ntraining.centres = 4\n\
                [draw]\npoints = 3\n[draw.axes]\nsensor.pitch_mm = {from = 2.0, to = 4.0}\n";
    folder.write("plan.toml", plan);
    let all = folder.json(&["sweep", "plan.toml"]);
    let settings = all["settings"].as_array().unwrap();
    assert_eq!((all["points"].as_array().unwrap().len(), settings.len()), (6, 3));
    for setting in settings {
        assert_eq!(setting["repeats"], 2);
        assert!(setting["deviation_rmse_dz_mm"].as_f64().unwrap() > 0.0);
        let pitch_mm = setting["sensor.pitch_mm"].as_f64().unwrap();
        let result = |name: &str| setting[name].as_f64().unwrap();
        let error_of_limit = |of: &Value| of["limit_standard_error_dz_mm"].as_f64().unwrap();
        let points = all["points"].as_array().unwrap().iter();
        let own = points.filter(|it| it["sensor.pitch_mm"] == pitch_mm);
        let squares: f64 = own.map(|it| error_of_limit(it).powi(2)).sum();
        let expected = squares.sqrt() / setting["repeats"].as_f64().unwrap();
        assert!((error_of_limit(setting) / expected - 1.0).abs() < 1e-9);
        let expected = 8.0 * 18.0 * pitch_mm.powi(2) / 100.0;
        assert!((result("area_cm2") - expected).abs() < 1e-9);
        let parts = 5.0 + 2.0 * result("rows") + 0.5 * result("columns");
        assert!((result("cost_eur") - parts - 0.25 * expected).abs() < 1e-9);
    }
}

#[test]
fn points_share_what_is_found_for_the_same_settings() {
    // Only the axis leaves fewer centres than frames, so that each point has its own usual number.
    let wanted = Wanted {
        set: [("training.frames".into(), 20.into())].into_iter().collect(),
        axes: [("training.centres".into(), vec![8, 16].into())].into_iter().collect(),
        ..Wanted::default()
    };
    let base = Base::of_scene("press", "press").unwrap();
    let plan = Plan::new("few", (vec![base], None), wanted, "a test").unwrap();
    let [few, more] = &plan.points().unwrap()[..] else { panic!("two points") };
    assert_eq!((few.usual.centres, more.usual.centres), (8, 16));
    assert_ne!(few.keys[1], more.keys[1]);
}

/// The paper's method refines nothing, whatever else a plan says. Measurements are refined on in a moment.
#[test]
fn points_of_both_methods_have_the_results_that_each_has_alone() {
    let folder = Folder::new("sweep_methods");
    folder.write("log.csv", crate::json_keys::log());
    let points = |methods: &str| {
        let data = "file = \"log.csv\"\ninputs = \"ch*\"\noutputs = \"f*\"";
        let axes = format!("training.centres = [3]\ntraining.method = [{methods}]");
        folder.write("plan.toml", format!("name = \"log\"\n[data]\n{data}\n[axes]\n{axes}\n"));
        let result = folder.json(&["sweep", "plan.toml", "-o", &methods.replace('"', "")]);
        result["points"].as_array().unwrap().clone()
    };
    let [both, best, paper] = ["\"best\", \"paper\"", "\"best\"", "\"paper\""].map(points);
    assert_eq!(both, [best, paper].concat());
    assert_ne!(both[0]["rmse_fz_n"], both[1]["rmse_fz_n"]);
}

#[test]
fn a_plan_trains_as_the_same_options_of_a_command_do() {
    let small = small_scene();
    let with_solver = small.replace("each_row = true", "solver = \"qr\"");
    let contact = Experiment::text("contact").unwrap().into_owned();
    for (scene, given) in [
        (&small, "features = 9"),
        (&small.replace("each_row = true", ""), "method = \"paper\""),
        (&with_solver.replace("\"f32\"", "\"fixed16\""), "method = \"paper\""),
        (&with_solver, "method = \"paper\"\nsolver = \"qr\"\nspread = 0.3"),
        (&contact, "method = \"paper\""),
        (
            &contact.replace("[training]", "[training]\nrefine = true\nfeatures_kind = \"plain\""),
            "method = \"paper\"",
        ),
        (&contact, "each_row = true"),
    ] {
        let own = Experiment::parse("scene", scene).unwrap();
        let own = own.trained_with(&toml::from_str(given).unwrap()).unwrap();
        let base = Base { label: "scene".into(), document: scene.parse().unwrap(), digest: 0 };
        let wanted: Wanted = toml::from_str(&format!("[set.training]\n{given}")).unwrap();
        let plan = Plan::new("options", (vec![base], None), wanted, "a test").unwrap();
        let point = Experiment::parse("point", &plan.points().unwrap()[0].scene).unwrap();
        assert_eq!(point.training, own.training, "{given}");
    }
    // A plan's method replaces that of the scene.
    let wanted: Wanted = toml::from_str("[set.training]\nmethod = \"best\"").unwrap();
    let document = small.replace("each_row = true", "method = \"paper\"").parse().unwrap();
    let base = Base { label: "scene".into(), document, digest: 0 };
    let plan = Plan::new("best", (vec![base], None), wanted, "a test").unwrap();
    let point = Experiment::parse("point", &plan.points().unwrap()[0].scene).unwrap();
    assert!(point.training.options.affine_tail && !point.training.options.each_row);
}

/// Centres do not depend on the spread, and unless they are refined neither on the penalty.
#[test]
fn points_that_share_work_have_the_results_of_each_alone() {
    let folder = prepared("sweep_shared");
    let wanted = "limit_frames = 0\n[set]\ntraining.frames = 60\ntraining.test_frames = 20\n[axes]\n\
                  training.refine = [false, true]\ntraining.spread = [0.5, 0.8]\ntraining.penalty = [1e-7, 1e-3]\n";
    let base = Base::of_scene("scene", &folder.path("scene.toml").display().to_string()).unwrap();
    let wanted: Wanted = toml::from_str(wanted).unwrap();
    let plan = Plan::new("shared", (vec![base], None), wanted, "a test").unwrap();
    let points = plan.points().unwrap();
    let with = |refined: bool| {
        let is_it =
            |point: &&Point| point.values.contains(&("training.refine".into(), refined.into()));
        points.iter().filter(is_it).cloned().collect::<Vec<Point>>()
    };
    let stages = |points: &[Point], stage: usize| {
        points.iter().map(|point| point.keys[stage]).collect::<BTreeSet<u64>>().len()
    };
    assert_eq!([0, 1, 2, 3, 4, 5].map(|stage| stages(&with(false), stage)), [1, 1, 1, 2, 2, 4]);
    assert_eq!(stages(&with(true), 3), 4);
    let computed = |points: &[Point]| work::in_memory(&plan, points, &Silent).unwrap();
    let mut errors = BTreeSet::new();
    for (point, record) in with(false).iter().zip(computed(&with(false))) {
        assert_eq!(record, computed(std::slice::from_ref(point))[0]);
        errors.insert(record.unwrap().results["rmse_dz_mm"].to_bits());
    }
    assert_eq!(errors.len(), 4, "each setting has its own error");
}

#[test]
fn measurements_are_swept_by_the_settings_of_training() {
    let folder = prepared("sweep_measured");
    folder.succeed(&["synth", "scene.toml", "-n", "300", "-o", "data.csv"]);
    folder.write(
        "plan.toml",
        "name = \"log\"\n[data]\nfile = \"data.csv\"\ninputs = \"r4c*_ohm\"\noutputs = \"r4e*_dz_mm\"\nfolds = 4\n[set]\ntraining.refine = false\n[axes]\ntraining.centres = [4, 8]\ntraining.format = [\"f32\", \"fixed16\"]\n",
    );
    let all = folder.json(&["sweep", "plan.toml"]);
    assert_eq!(all["objectives"][0], "rmse_dz_mm");
    let points = all["points"].as_array().unwrap();
    assert_eq!(points.len(), 4);
    assert!(
        points.iter().all(|it| it["rmse_dz_mm"].as_f64().unwrap() > 0.0 && it["failed"].is_null())
    );
    let plan = folder.read("plan.toml");
    // Whatever decides a result is in a point's identity, and what a file is called is not.
    folder.succeed(&["synth", "scene.toml", "-n", "100", "--seed", "9", "-o", "test.csv"]);
    folder.succeed(&["synth", "scene.toml", "-n", "100", "--seed", "8", "-o", "other.csv"]);
    fs::copy(folder.path("data.csv"), folder.path("a-longer-name.csv")).unwrap();
    let mut seen = Vec::new();
    for (from, to) in [
        ("", ""),
        ("folds = 4", "folds = 5"),
        ("folds = 4", "test = \"test.csv\""),
        ("folds = 4", "test = \"other.csv\""),
        ("\"data.csv\"", "\"a-longer-name.csv\""),
    ] {
        folder.write("plan.toml", plan.replace(from, to));
        let listed = folder.json(&["sweep", "plan.toml", "--list"]);
        seen.push(listed["points"][0]["id"].as_str().unwrap().to_owned());
    }
    assert_eq!(seen[0], seen[4]);
    assert_eq!(seen.iter().collect::<BTreeSet<_>>().len(), 4, "{seen:?}");
    for (from, to, says) in [
        ("training.centres", "sensor.row_wires", "unknown field `sensor`"),
        ("training.centres", "training.frames", "training.frames = 4: it sets a scene's frames"),
        ("training.centres = [4, 8]", "training.relative_inputs = [true]", "give it in [set]"),
        ("inputs = ", "input = ", "data: field = input: it is unknown; the nearest are `inputs`"),
        ("folds = 4", "folds = \"four\"", "data: invalid type: string \"four\""),
        ("file = \"data.csv\"", "", "data: missing field `file`"),
        (
            "folds = 4",
            "folds = 4\nfold_blocks = 4",
            "data: fold_blocks and folds: give one of them",
        ),
        ("training.centres", "data.fold", "data.fold = 4: give a fold, 0 to 3"),
        (
            "training.centres",
            "data.folds",
            "data.folds = 4: points of the same data may differ only in data.fold",
        ),
    ] {
        folder.write("plan.toml", plan.replace(from, to));
        let message = folder.fail(&["sweep", "plan.toml"], 2);
        assert!(message.contains(says), "{message}");
    }
    folder
        .write("plan.toml", "name = \"folds\"\nscene = \"scene.toml\"\n[axes]\ndata.fold = [0]\n");
    let message = folder.fail(&["sweep", "plan.toml"], 2);
    assert!(message.contains("data.fold = 0: a scene is evaluated on new frames"), "{message}");
}

#[test]
fn a_point_whose_scene_lacks_what_its_device_needs_fails_alone() {
    let folder = prepared("sweep_devices");
    folder.write(
        "plan.toml",
        "name = \"devices\"\nscene = \"scene.toml\"\nlimit_frames = 0\n\
         [axes]\nsensor.column_wires = [6, 18]\ndevice.column_step = [2, 9]\n",
    );
    let all = folder.json(&["sweep", "plan.toml"]);
    let points = all["points"].as_array().unwrap().iter();
    let reasons: Vec<_> = points.map(|point| point["failed"].as_str().unwrap_or("")).collect();
    let why = "device.column_step = 9: give steps from 1 to 6, the columns of the scene";
    assert_eq!(reasons.iter().filter(|it| **it == why).count(), 1, "{reasons:?}");
    assert_eq!(reasons.iter().filter(|it| it.is_empty()).count(), 3, "{reasons:?}");
}

#[test]
fn folds_of_a_plan_are_those_that_train_selects_by() {
    let folder = prepared("sweep_folds");
    folder.succeed(&["synth", "scene.toml", "-n", "300", "-o", "data.csv"]);
    folder.succeed(&["synth", "scene.toml", "-n", "20", "--seed", "9", "-o", "test.csv"]);
    folder.write(
        "plan.toml",
        "name = \"log\"\n[data]\nfile = \"data.csv\"\ntest = \"test.csv\"\nfolds = 4\n\
         [set]\ntraining = { refine = false, each_row = true, centres = 6, spread = 0.7 }\n\
         [axes]\ndata.fold = { from = 0, to = 3, count = 4 }\n",
    );
    let of_plan = folder.json(&["sweep", "plan.toml"]);
    // No fold is a choice.
    let [setting] = of_plan["settings"].as_array().unwrap().as_slice() else { panic!("{of_plan}") };
    assert_eq!(setting["repeats"], 4);
    assert!(setting["deviation_rmse_dz_mm"].as_f64().unwrap() > 0.0 && setting["on_front"] == true);
    let words = "train data.csv --folds 4 --select --no-refine --each-row --centres 6 --spread 0.7 -o m.bin";
    let selected = folder.json(&words.split(' ').collect::<Vec<_>>());
    let scored = &selected["selection"]["scored"][0];
    assert!(scored["penalty"].is_null());
    let rms = |values: Vec<f64>| {
        (values.iter().map(|it| it * it).sum::<f64>() / values.len() as f64).sqrt()
    };
    let outputs = selected["outputs"].as_array().unwrap().iter();
    let of_outputs = outputs.zip(scored["rmse"].as_array().unwrap());
    let is_z = |name: &Value| name.as_str().unwrap().ends_with("dz_mm");
    let of_outputs = of_outputs.filter(|(output, _)| is_z(&output["name"]));
    let points = of_plan["points"].as_array().unwrap().iter();
    let [folds, outputs] = [
        rms(points.map(|it| it["rmse_dz_mm"].as_f64().unwrap()).collect()),
        rms(of_outputs.map(|(_, rmse)| rmse.as_f64().unwrap()).collect()),
    ];
    assert!(outputs > 0.0 && (folds / outputs - 1.0).abs() < 1e-9, "{folds} {outputs}");
}

#[test]
fn layouts_are_compared_and_the_best_decoder_is_chosen() {
    let folder = Folder::new("sweep_compared");
    let scene = tiny_scene().replace("row_wires = [4, 5]", "row_wires = [4]");
    folder.write("scene.toml", &scene);
    let lists = scene.replace("row_wires = 8", "pitch_mm = [1.5, 3]\nrow_wires = 8");
    folder.write("lists.toml", lists);
    let said =
        folder.succeed(&["compare", "lists.toml", "scene.toml", "--centres", "4,8", "-o", "out"]);
    let table_of = |said: &str| -> Vec<String> {
        let lines = said.lines().skip_while(|line| !line.starts_with("layout "));
        lines.skip(1).take(3).map(str::to_owned).collect()
    };
    let names = ["lists.toml pitch_mm=1.5", "lists.toml pitch_mm=3", "scene.toml"];
    for (line, layout) in table_of(&said).iter().zip(names) {
        let centres = line.strip_prefix(layout).and_then(|rest| rest.split_whitespace().next());
        assert!(centres.is_some_and(|k| ["4", "8"].contains(&k)), "{said}");
    }
    assert!(said.lines().all(|line| line.chars().count() <= 120), "{said}");
    let table = folder.read("out/compare.csv");
    assert_eq!(table.lines().count(), 7, "{table}");
    // Page and JSON have the table as well, and JSON its numbers as they are.
    let page = folder.read("out/compare.html");
    assert!(names.iter().all(|name| page.contains(&format!("<td>{name}</td>"))), "{page}");
    let json: Value = serde_json::from_str(&folder.read("out/compare.json")).unwrap();
    for (layout, name) in json["layouts"].as_array().unwrap().iter().zip(names) {
        assert_eq!(layout["layout"], name);
        assert!(layout["training.centres"].is_u64(), "{layout}");
        let rmse = layout["rmse_dz_mm"].as_f64().unwrap().to_string();
        assert!(table.lines().any(|line| line.contains(name) && line.contains(&rmse)), "{rmse}");
    }
    folder.write("drifts.toml", scene.replace("[noise]", "[drift]\ngain = 0.02\n\n[noise]"));
    let limits = folder.run(&["compare", "scene.toml", "drifts.toml", "--limit-only"]);
    let said = String::from_utf8(limits.stdout).unwrap();
    assert!(limits.status.success() && said.contains("1 point with no limit: "), "{said}");
    let stages = String::from_utf8(limits.stderr).unwrap();
    assert!(stages.contains("measure …\n") && !stages.contains("train"), "{stages}");
    let limit = folder.json(&["compare", "lists.toml", "--limit-only"]);
    assert_eq!(limit["objectives"][0], "limit_dz_mm");
    assert!(folder.fail(&["compare", "scene.toml", "scene.toml"], 2).contains("twice"));
    let none = folder.run(&["compare", "scene.toml", "--max-latency-ms", "0.001"]);
    assert_eq!(none.status.code(), Some(2));
    let none = String::from_utf8(none.stdout).unwrap();
    assert!(none.contains("has no decoder within the bound"), "{none}");
    assert!(none.contains("scene.toml") && !none.contains("the scene"), "{none}");
    // Two scenes may be the same, and one may be impossible.
    fs::copy(folder.path("scene.toml"), folder.path("same.toml")).unwrap();
    folder.write("bad.toml", scene.replace("row_wires = 8", "thickness_mm = 0.5\nrow_wires = 8"));
    let said = folder.succeed(&["compare", "bad.toml", "scene.toml", "same.toml"]);
    let lines = table_of(&said);
    assert!(lines[0].starts_with("scene.toml") && lines[1].starts_with("same.toml"), "{said}");
    assert!(said.contains(" RMSE of Δz (mm)") && said.contains("Failed: bad.toml: "), "{said}");
    let unknown = folder.fail(&["compare", "scene.toml", "--group", "dy"], 2);
    assert!(unknown.contains("--group dy: ") && unknown.contains("`dz_mm`"), "{unknown}");
}

#[test]
fn a_sweep_with_nothing_within_its_bounds_says_what_refuses_all() {
    let folder = prepared("sweep_bounded");
    let bounds = "[bounds]\nframe_ms = 0.001\ncycles = 1e9\n[axes]";
    folder.write("plan.toml", PLAN.replace("[axes]", bounds));
    let none = "no setting is within frame_ms at most 0.001; the nearest is noise.level = ";
    for arguments in [&["sweep", "plan.toml"][..], &["sweep", "plan.toml", "--merge", "out/tiny"]] {
        let output = folder.run(arguments);
        let [page, error] =
            [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
        assert_eq!(output.status.code(), Some(2), "{error}");
        assert!(error.contains(none) && page.contains(none), "{error}{page}");
        assert!(!page.contains("The Pareto front."), "{page}");
    }
    // What was measured is written all the same.
    assert_eq!(folder.read("out/tiny/results.csv").lines().count(), 5);
}

/// The project's own plans are read as they stand.
#[test]
fn the_plans_of_the_project_name_fields_that_exist() {
    let folder = Folder::new("sweep_own_plans");
    let plans = ["plans/layouts.toml", "plans/shear.toml", "plans/small.toml", "test/plan64.toml"];
    for plan in plans {
        let plan = format!("{}/../cluster/{plan}", env!("CARGO_MANIFEST_DIR"));
        let listed = folder.succeed(&["sweep", &plan, "--list"]);
        assert!(listed.lines().count() > 10, "{listed}");
    }
}
