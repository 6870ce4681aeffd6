//! The trade between speed and accuracy, on a small plan.

use std::collections::BTreeSet;
use std::sync::OnceLock;

use crate::common::{Folder, small_scene, unrefined};
use host_sim::Result;
use host_sim::evaluate::trade::{self, Bounds, Device, Plan, Trade};
use host_sim::experiment::Experiment;
use host_sim::subject::Subject;
use taxel_data::{Silent, Stream};
use taxel_learn::ModelBlob;
use taxel_simulate::Synthesis;

fn press() -> Experiment {
    let mut scene = unrefined("press");
    (scene.training.frames, scene.training.test_frames) = (1500, 80);
    scene
}

fn plan() -> Plan {
    Plan {
        centres: vec![16, 64],
        column_steps: vec![1],
        samples_averaged: vec![1, 16],
        device: Device { clock_mhz: 100.0, ..Device::default() },
        worst_case: false,
    }
}

fn compute(scene: &Experiment, bounds: Bounds) -> Result<Trade> {
    compute_plan(scene, &plan(), bounds)
}

fn compute_plan(scene: &Experiment, plan: &Plan, bounds: Bounds) -> Result<Trade> {
    bounds.check()?;
    let subject = Subject::Scene(Box::new(scene.clone()));
    let mut trade = trade::compute(&subject, plan, "dz_mm", &bounds, &Silent)?;
    trade.choose(&bounds)?;
    Ok(trade)
}

/// The plan's trade, which several tests look at.
fn traded() -> &'static Trade {
    static TRADE: OnceLock<Trade> = OnceLock::new();
    TRADE.get_or_init(|| compute(&press(), Bounds::default()).unwrap())
}

#[test]
fn every_knob_has_its_points_and_the_front_is_the_pareto_front() {
    let trade = traded();
    assert_eq!(trade.chosen, None);
    let count = |name: &str| trade.points.iter().filter(|p| p.format.name() == name).count();
    for format in ["fixed16", "f32"] {
        assert_eq!(count(format), 2 * 2 * 2, "{format}"); // rows or the array, K, samples
    }

    let rank = |p: &trade::Point| (p.times.frame_ms, p.rmse("dz_mm"));
    for point in &trade.points {
        let own = rank(point);
        let beaten = trade
            .points
            .iter()
            .map(rank)
            .any(|other| other != own && other.0 <= own.0 && other.1 <= own.1);
        assert_eq!(point.on_front, !beaten, "{}", point.name());
        // The board's scan of 9 × 18 samples, and zero wait at 100 MHz.
        let scan_ms = if point.samples_averaged == 1 { 5.573 } else { 82.817 };
        assert_eq!(point.times.scan_ms, Some(scan_ms));
        assert_eq!(point.times.decode_ms, point.frame.cycles as f64 / 100_000.0);
        assert_eq!(point.times.frame_ms, scan_ms + point.times.decode_ms);
        assert!(point.ratio_to_best.iter().all(|ratio| *ratio >= 1.0));
    }
    for group in 0..3 {
        let least = trade.points.iter().map(|p| p.ratio_to_best[group]).fold(f64::MAX, f64::min);
        assert_eq!(least, 1.0);
    }

    // Whatever else is averaged has its own limit and linear decoder.
    let [once, often] = trade.readings.as_slice() else { panic!("{:?}", trade.readings) };
    assert_eq!([once, often].map(|it| trade.distinction(it)), ["1 sample", "16 samples"]);
    let errors: Vec<_> = once.references("dz_mm").zip(often.references("dz_mm")).collect();
    assert!(errors.len() == 3 && errors[1..].iter().all(|(a, b)| b.1 < 0.9 * a.1), "{errors:?}");

    // More samples have less error, and 16 bits are as good as 32.
    let find = |kernel: &str, centres, samples| {
        let wanted = |p: &&trade::Point| {
            (p.way().as_str(), p.centres, p.samples_averaged) == (kernel, centres, samples)
        };
        trade.points.iter().find(wanted).unwrap()
    };
    let [once, often] = [1, 16].map(|samples| find("fixed16", 64, samples).rmse("dz_mm"));
    assert!(often < 0.8 * once, "{often} against {once}");
    let (fixed, float) = (find("fixed16", 64, 1), find("f32", 64, 1));
    assert!(fixed.rmse("dz_mm") < 1.01 * float.rmse("dz_mm"));
    assert!(fixed.frame.cycles < float.frame.cycles / 3);
    assert!(fixed.blob_bytes < 6 * float.blob_bytes / 10);
    // One network for the array has less error, in fewer cycles.
    let array = find("fixed16 array", 64, 1);
    assert!(array.rmse("dz_mm") < 0.95 * fixed.rmse("dz_mm"), "{}", array.rmse("dz_mm"));
    assert!(array.frame.cycles < fixed.frame.cycles && array.blob_bytes < fixed.blob_bytes);
}

#[test]
fn the_chosen_point_is_the_cheapest_and_its_blob_is_what_the_table_says() {
    let (scene, mut trade) = (press(), traded().clone());
    trade.choose(&Bounds { error: Some(0.055), ..Bounds::default() }).unwrap();
    let chosen = &trade.points[trade.chosen.unwrap()];
    assert!(chosen.rmse("dz_mm") <= 0.055);
    for other in &trade.points {
        let cheaper = other.times.frame_ms < chosen.times.frame_ms && other.rmse("dz_mm") <= 0.055;
        assert!(!cheaper, "{} is cheaper", other.name());
    }
    let often = |point: &trade::Point| point.samples_averaged == 16;
    let place = trade.points.iter().position(often).unwrap();
    let point = &trade.points[place];
    let model = ModelBlob::of_bytes(trade.blob(place)).unwrap();
    assert_eq!(model.bytes().len(), point.blob_bytes);
    let frames = Synthesis::new(&scene.world).noise_level(scene.world.noise.level / 4.0);
    let test = frames.frames(Stream::Test, scene.training.test_frames);
    let estimate = model.prepare().decode_table(&test.inputs);
    let errors = test.outputs.squared_errors(&estimate.values);
    let z = errors.iter().skip(2).step_by(3);
    let count = errors.len() / 3 * test.frames();
    let rmse = (z.sum::<f64>() / count as f64).sqrt();
    assert!((rmse - point.rmse("dz_mm")).abs() < 1e-12, "{rmse}");
}

/// The scene `press` with two rows and few frames.
fn few_frames_of_two_rows() -> String {
    include_str!("../../../scenes/press.toml")
        .replace("name = \"press\"", "name = \"few\"")
        .replace("[outputs]", "[readout]\nrow_wires = [4, 5]\n\n[outputs]")
        .replace("frames = 20000", "frames = 400")
        .replace("test_frames = 8000", "test_frames = 100")
}

#[test]
fn the_files_and_the_table_tell_every_point() {
    let folder = Folder::new("trade-files");
    folder.write("few.toml", few_frames_of_two_rows());
    let few = ["trade", "few.toml", "--no-refine", "--centres", "16", "--average", "1"];
    let times_of = |page: &str| -> Vec<f64> {
        let points =
            page.lines().filter(|line| line.contains(" fixed16 ") || line.contains(" f32"));
        let points = points.filter(|line| line.starts_with(['*', ' ']));
        let times = points.map(|line| line.split_whitespace().rev().nth(5).unwrap());
        times.map(|ms| ms.parse().unwrap()).collect()
    };
    let front = folder.succeed(&few);
    let all = folder.succeed(&[&few[..], &["--all"]].concat());
    let (shown, every) = (times_of(&front), times_of(&all));
    assert!(shown.len() > 1 && shown.is_sorted(), "{front}");
    assert!(front.contains(&format!("\n{} more points with --all", every.len() - shown.len())));
    assert!(front.lines().chain(all.lines()).all(|line| line.chars().count() <= 120), "{all}");
    let words = front.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("The most accurate: ") && words.contains("always predicting the mean"));
    assert!(front.ends_with("\nopen out/few/trade.html\n"), "{front}");
    assert!(!all.contains("--all"), "{all}");
    folder.succeed(&[&few[..], &["--max-cycles", "9000"]].concat());
    let read = |name: &str| std::fs::read_to_string(folder.path(name)).unwrap();
    let csv = read("out/few/trade.csv");
    let mut lines = csv.lines();
    assert!(
        lines
            .next()
            .unwrap()
            .starts_with("format,each_row,centres,spread,columns,samples_averaged,filter_ms,")
    );
    assert_eq!(lines.count(), every.len());
    let json: serde_json::Value = serde_json::from_str(&read("out/few/trade.json")).unwrap();
    let html = read("out/few/trade.html");
    assert!(html.contains("cycles</th>") && !html.contains("<script"));
    assert!(html.contains(">time of a frame, scan to estimate (ms)</text>"), "{html}");
    // The legend has every kind of mark, and no column has dashes alone.
    let (legend, plot) = html.split_once("frames a second</text>").unwrap();
    let plot = plot.split_once("</svg>").unwrap().0;
    let marks = |part: &str| -> BTreeSet<String> {
        let paths = part.split("<path ").skip(1);
        let classes = paths.filter_map(|path| path.split("class=\"").nth(1)?.split('"').next());
        classes.filter(|class| class.ends_with(" mark")).map(str::to_owned).collect()
    };
    let mut in_plot = marks(plot);
    assert!(in_plot.len() > 2 && plot.contains("<g class=\"dominated\">"), "{in_plot:?}");
    in_plot.insert("muted dominated mark".into());
    assert_eq!(marks(legend), in_plot);
    let cells = html.split("data-name=\"").skip(1);
    let columns: BTreeSet<&str> =
        cells.clone().map(|cell| cell.split('"').next().unwrap()).collect();
    for column in columns {
        let told = |cell: &str| cell.starts_with(&format!("{column}\">")) && !cell.contains(">–<");
        assert!(cells.clone().any(told), "{column}");
    }
    // Each point of the front tells its settings, in the wide picture and in the narrow one.
    let front = json["points"].as_array().unwrap().iter().filter(|p| p["on_front"] == true).count();
    assert_eq!(
        html.matches("<title>fixed16").count() + html.matches("<title>f32").count(),
        2 * front
    );
    assert!(html.matches("<tr class=\"chosen-row\">").count() == 1 && html.contains(">chosen: K"));
    assert!(html.contains("host-sim trade few.toml --no-refine --centres 16"), "the command");
    assert!(html.contains("at most 9\u{202f}000\u{a0}cycles at zero wait"), "the bound");

    assert!(folder.path("out/few/chosen.bin").exists());
    // Measurements are kept where no point is chosen, and another run's choice is not left beside them.
    let output = folder.run(&[&few[..], &["--max-error", "0.05"]].concat());
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && stderr.contains("--max-error 0.05"), "{stderr}");
    assert!(stderr.contains("train and measure …\n"), "a log shows what runs: {stderr}");
    let page = String::from_utf8(output.stdout).unwrap();
    assert!(page.contains("\n* fixed16 ") && !page.contains("Chosen:"), "{page}");
    assert!(!folder.path("out/few/chosen.bin").exists());
}

#[test]
fn what_nothing_can_meet_is_refused_before_training() {
    let (scene, all) = (press(), traded());
    let cycles = all.points.iter().map(|point| point.frame.cycles).min().unwrap();
    // Costs, and errors below the limit.
    let refused = |scene: &Experiment, bounds: Bounds| {
        let message = compute(scene, bounds).unwrap_err().to_string();
        assert!(message.ends_with("; nothing was trained"), "{message}");
        message
    };
    let rate = refused(&scene, Bounds { frame_rate_hz: Some(1000.0), ..Bounds::default() });
    let most = all.points.iter().map(|p| p.times.frames_per_s).fold(0.0, f64::max);
    assert!(rate.contains(&format!("is {:.1} frames", (most * 10.0).floor() / 10.0)), "{rate}");
    let fewest = refused(&scene, Bounds { cycles: Some(100), ..Bounds::default() });
    assert!(fewest.contains(&format!("the fewest cycles are {cycles}")), "{fewest}");
    let mut few = scene.clone();
    few.training.test_frames = 60;
    let error = refused(&few, Bounds { error: Some(1e-6), ..Bounds::default() });
    assert!(error.contains("the smallest error is at least 0.0"), "{error}");
    for error in [0.0, -1.0, f64::NAN] {
        let bounds = Bounds { error: Some(error), ..Bounds::default() };
        let message = compute(&scene, bounds).unwrap_err().to_string();
        assert!(message.contains("max-error"), "{message}");
    }
}

#[test]
fn scenes_of_any_shape_are_traded_and_what_a_format_cannot_hold_is_named() {
    let mut scene = press();
    scene.world.read_rows = vec![3];
    let plan = Plan {
        centres: vec![20],
        column_steps: vec![1],
        samples_averaged: vec![1],
        device: Device::default(),
        worst_case: false,
    };
    let one_row = compute_plan(&scene, &plan, Bounds::default()).unwrap();
    assert!(one_row.points.len() == 2 && one_row.left_out.is_empty());
    assert!(one_row.points.iter().all(|point| point.each_row && point.centres == 20));

    // One network for the array has half of the spread, which 16 bits cannot hold.
    scene.world.read_rows = vec![3, 4];
    scene.training.spread = 0.500_123;
    let narrow = compute_plan(&scene, &plan, Bounds::default()).unwrap();
    assert!(
        narrow
            .left_out
            .iter()
            .all(|note| note.starts_with("fixed16 array, K = 20, 18 columns: spread = 0.2501: "))
    );
    let of_array = |trade: &Trade, name: &str| {
        trade.points.iter().filter(|p| !p.each_row && p.format.name() == name).count()
    };
    assert!(!narrow.left_out.is_empty() && of_array(&narrow, "fixed16") == 0);
    assert!(
        narrow.left_out[0].ends_with("spread (in a scene's [training], or by `train --spread`)")
    );
    assert!(of_array(&narrow, "f32") == 1);
}

#[test]
fn chosen_columns_are_judged_beside_what_can_be_told_from_these_alone() {
    let mut scene = press();
    scene.world.read_rows = vec![3];
    scene.training.frames = 600;
    let chosen = |column_steps: &[usize]| Plan {
        centres: vec![16],
        column_steps: column_steps.to_vec(),
        samples_averaged: vec![1],
        device: Device::default(),
        worst_case: false,
    };
    let trade = compute_plan(&scene, &chosen(&[1, 3]), Bounds::default()).unwrap();
    let columns = [2, 5, 8, 11, 14, 17];
    scene.world.sensor = scene.world.sensor.with_columns(&columns.map(|column| column - 1));
    let alone = compute_plan(&scene, &chosen(&[1]), Bounds::default()).unwrap();
    let [all, few] = trade.readings.as_slice() else { panic!("{:?}", trade.readings) };
    assert_eq!(
        (all.column_wires.as_deref(), few.column_wires.as_deref()),
        (None, Some(&columns[..]))
    );
    assert_eq!(few, &alone.readings[0]);
    assert_eq!([trade.distinction(few), alone.distinction(few)], ["6 columns", ""]);
    let errors =
        |of: &trade::Readings| -> Vec<f64> { of.references("dz_mm").map(|it| it.1).collect() };
    let ([mean, linear, least], few) = (<[f64; 3]>::try_from(errors(all)).unwrap(), errors(few));
    assert!(few[0] == mean && few[1] > linear && few[2] > 1.1 * least, "{few:?}");
    // Each point is judged as in a scene that reads these columns.
    let places = (0..trade.points.len()).filter(|i| trade.points[*i].columns == Some(6));
    for (place, of_scene) in places.zip(0..) {
        assert_eq!(trade.points[place].name(), alone.points[of_scene].name());
        assert_eq!(trade.verdict_on(place), alone.verdict_on(of_scene));
    }
}

#[test]
fn a_choice_of_columns_tells_how_to_use_it_and_what_the_line_carries() {
    let folder = Folder::new("trade-columns");
    folder.write("few.toml", few_frames_of_two_rows());
    let few = ["trade", "few.toml", "--no-refine", "--centres", "16"];
    let ask = |hz, steps| [&few[..], &["--frame-rate", hz, "--column-step", steps]].concat();
    let page = folder.succeed(&ask("1300", "1,3"));
    assert!(page.lines().all(|line| line.chars().count() <= 120), "{page}");
    for words in [
        "for 2 × `cols` wires)",
        "\ncols: ",
        "\nin a scene, below [readout]: column_wires = [2, 5, 8, 11, 14, 17]\n",
        "\non a device: host-sim link PORT configure --period-us 769\n",
        "With 6 columns: Least possible RMSE",
    ] {
        assert!(page.contains(words), "{words}: {page}");
    }
    // 36 outputs of 4 bytes, and some 25 bytes around them.
    let words = page.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("carries at most 545 estimates a second: 169 bytes each"), "{words}");
    assert!(words.contains("For 1300 a second decode fewer outputs (axes of a scene"), "{words}");
    let html = std::fs::read_to_string(folder.path("out/few/trade.html")).unwrap();
    assert!(html.contains("columns</th>") && html.contains(">K 16, 6 columns<"), "{html}");
    assert!(html.contains("With 18 columns: best linear decoder "), "{html}");

    // Files of an earlier run stay where nothing was trained.
    let refused = folder.fail(&ask("3000", "1,3"), 2);
    assert!(refused.contains("fewer columns are faster: try --column-step 9"), "{refused}");
    assert!(folder.path("out/few/chosen.bin").exists());
    let refused = folder.fail(&ask("1e6", "1,3"), 2);
    assert!(refused.contains("lower the bound") && !refused.contains("--column-step"), "{refused}");
    let page = folder.succeed(&ask("100", "18"));
    assert!(page.contains(", 1 column.") && !page.contains("decode fewer outputs"), "{page}");

    // Six columns of two rows have 12 readings, and so fewer features than the scene asks for.
    let whole = "[training]\nfeatures = 20";
    folder.write("whole.toml", few_frames_of_two_rows().replacen("[training]", whole, 1));
    let steps = ["trade", "whole.toml", "--no-refine", "--centres", "16", "--column-step", "1,3"];
    let page = folder.succeed(&steps);
    let is_narrow = |line: &str| line.contains("fixed16 array ") && line.contains("  6   1 ");
    assert!(page.lines().any(is_narrow), "{page}");
}

#[test]
fn a_pad_for_pressure_alone_and_a_contact_are_traded() {
    let plan = Plan {
        centres: vec![16],
        column_steps: vec![1],
        samples_averaged: vec![1],
        device: Device::default(),
        worst_case: false,
    };
    let small = |scene: &str| -> Experiment {
        let mut scene = Experiment::parse("small", scene).unwrap();
        scene.training.refine = false;
        (scene.training.frames, scene.training.test_frames) = (400, 100);
        scene
    };
    let pad = include_str!("../../../scenes/press.toml")
        .replace("row_wires = 8", "row_wires = 4")
        .replace("electrodes_per_row_wire = 6", "electrodes_per_row_wire = 4")
        .replace("column_wires = 18", "column_wires = 4")
        .replace("axes = [\"x\", \"y\", \"z\"]", "axes = [\"z\"]");
    let pad = compute_plan(&small(&pad), &plan, Bounds::default()).unwrap();
    // The board samples its other columns now and then.
    assert!(pad.points.iter().all(|point| point.times.scan_ms == Some(0.804)));
    assert!(pad.points.iter().any(|point| !point.each_row));

    let contact = Subject::Scene(Box::new(small(include_str!("../../../scenes/contact.toml"))));
    let bounds = Bounds { frame_rate_hz: Some(100.0), ..Bounds::default() };
    let mut contact =
        trade::compute(&contact, &plan, "contact_depth_mm", &bounds, &Silent).unwrap();
    contact.choose(&bounds).unwrap();
    assert!(contact.points.iter().all(|point| !point.each_row));
    assert!(contact.points[contact.chosen.unwrap()].times.frames_per_s > 140.0);
}

#[test]
fn measurements_are_traded_as_they_are() {
    let folder = Folder::new("trade-measured");
    folder.write("small.toml", small_scene());
    folder.succeed(&["synth", "small.toml", "-n", "400", "-o", "data.csv"]);
    let few = ["--no-refine", "--centres", "16"];
    // Readings that are named after wires: three rows, one of them idle.
    let page = folder.succeed(&[&["trade", "data.csv", "--max-flash", "40000"], &few[..]].concat());
    assert!(page.contains("80 measured test frames (the last fifth)"), "{page}");
    assert!(page.contains("1.425 ms to scan") && page.contains("2 × 18 wires"), "{page}");
    assert!(folder.path("out/data/chosen.bin").exists());

    let csv = std::fs::read_to_string(folder.path("data.csv")).unwrap();
    folder.write("other.csv", csv.replace("r4c", "a").replace("r5c", "b"));
    let columns = ["--inputs", "a*_ohm,b*_ohm", "--outputs", "r4e*_dz_mm"];
    let other = [&["trade", "other.csv"], &few[..], &columns].concat();
    let page = folder.succeed(&other);
    assert!(
        page.contains("the scan's is unknown (--scan-ms)") && page.contains("besides its scan")
    );
    let page = folder.succeed(&[&other[..], &["--scan-ms", "2", "--frame-rate", "400"]].concat());
    assert!(page.contains("(2.000 ms to scan"), "{page}");
    let bad =
        [("--average", "4"), ("--column-step", "3"), ("--scan-ms", "0"), ("--frame-rate", "0")];
    for (option, value) in bad {
        let output = folder.run(&[&other[..], &[option, value]].concat());
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert!(stderr.contains(&format!("{option} {value}: ")), "{stderr}");
        assert_eq!(stderr.contains("choose --inputs"), option == "--column-step", "{stderr}");
    }
}

#[test]
fn few_frames_are_traded_with_the_usual_centres_that_they_allow() {
    let folder = Folder::new("trade-few");
    let line = |i: u32| {
        let x = f64::from(i * i % 37) / 37.0;
        format!("{},{},{x}\n", 60.0 - 9.0 * x * x, 30.0 + x)
    };
    let lines: Vec<String> = (0..45).map(line).collect();
    folder.write("few.csv", format!("ch1,ch2,f_n\n{}", lines.concat()));
    let columns = ["--inputs", "ch*", "--outputs", "f_n", "--no-refine", "--scan-ms", "1"];
    let output = folder.run(&[&["trade", "few.csv", "--json"], &columns[..]].concat());
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{stderr}");
    assert!(stderr.contains("K = 64, 128, 256 is not tried") && stderr.contains("36"), "{stderr}");
    let trade: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    // x² modulo 37 has 19 values, which are all that the training frames hold.
    let points = trade["points"].as_array().unwrap();
    let of = |point: &serde_json::Value, field: &str| point[field].as_u64().unwrap();
    let centres: BTreeSet<u64> = points.iter().map(|point| of(point, "centres")).collect();
    assert_eq!(centres, BTreeSet::from([16, 19]));
    // A bound that the network can meet, whose K is lower than asked for, is not refused early.
    let all = points.iter().filter(|point| of(point, "centres") == 19);
    let bound = all.map(|point| of(point, "cycles")).min().unwrap().to_string();
    let ask = ["trade", "few.csv", "--centres", "32", "--max-cycles", &bound];
    folder.succeed(&[&ask, &columns[..]].concat());
    let few = folder.fail(&[&ask[..3], &["99"], &columns[..]].concat(), 2);
    assert!(few.contains("--centres 99") && few.contains("36 training frames"), "{few}");
    folder.write("one.csv", format!("ch1,ch2,f_n\n{}", lines[..12].concat()));
    let one = folder.fail(&[&["trade", "one.csv"], &columns[..]].concat(), 2);
    assert!(one.contains("give --centres"), "{one}");
}
