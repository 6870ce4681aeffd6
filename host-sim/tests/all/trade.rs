//! The trade between speed and accuracy, on a small plan.

use std::sync::OnceLock;

use crate::common::{Folder, small_scene};
use host_sim::device::{Device, Readout};
use host_sim::experiment::Experiment;
use host_sim::subject::Subject;
use host_sim::sweep;
use host_sim::sweep::bounds::Bound::{self, Least, Most};
use host_sim::sweep::bounds::Bounds;
use host_sim::sweep::plan::Base;
use host_sim::trade::{self, Asked, Trade};
use taxel_data::Stream;
use taxel_learn::ModelBlob;
use taxel_simulate::Synthesis;

/// Scene `press` with few frames, which is not refined.
fn press() -> String {
    include_str!("../../../scenes/press.toml")
        .replace("frames = 20000", "frames = 1500\nrefine = false")
        .replace("test_frames = 8000", "test_frames = 40")
}

/// Settings of a trade, its plan and its points.
struct Planned {
    subject: Subject,
    asked: Asked,
    plan: sweep::Plan,
    points: Vec<sweep::Point>,
}

impl Planned {
    fn new(scene: &str, change: impl Fn(&mut Asked)) -> Self {
        let subject = Subject::Scene(Experiment::parse("press", scene).unwrap().into());
        let mut asked = Asked {
            centres: vec![16, 64],
            column_steps: vec![1],
            samples_averaged: vec![1, 16],
            device: Device { clock_mhz: 100.0, readout: Readout::Spi, scan_ms: None },
            group: "dz_mm".into(),
            worst_case: false,
            most_bytes: 200_000,
        };
        change(&mut asked);
        let base =
            Base { label: "press".into(), document: toml::from_str(scene).unwrap(), digest: 7 };
        let wanted = asked.wanted(&subject);
        let plan = sweep::Plan::new("press", (vec![base], None), wanted, "a test").unwrap();
        let points = plan.points().unwrap();
        Self { subject, asked, plan, points }
    }

    fn trade(&self) -> Trade {
        trade::compute(&self.subject, &self.asked, (&self.plan, &self.points)).unwrap()
    }
}

fn at_most(result: &str, most: f64) -> Bounds {
    [(result.to_owned(), Most(most))].into()
}

/// The plan's trade, which several tests look at.
fn traded() -> &'static (Planned, Trade) {
    static TRADE: OnceLock<(Planned, Trade)> = OnceLock::new();
    TRADE.get_or_init(|| {
        let planned = Planned::new(&press(), |_| {});
        let trade = planned.trade();
        (planned, trade)
    })
}

#[test]
fn every_knob_has_its_points_and_the_front_is_the_pareto_front() {
    let (_, trade) = traded();
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
        // What is beaten is not on the front, nor is what is better by no more than chance.
        assert!(!(point.on_front && beaten), "{}", point.name());
        // The board's scan of 9 × 18 samples, and zero wait at 100 MHz.
        let scan_ms = if point.samples_averaged == 1 { 5.573 } else { 82.817 };
        assert_eq!(point.times.scan_ms, Some(scan_ms));
        assert_eq!(point.times.decode_ms, point.cycles as f64 / 100_000.0);
        assert_eq!(point.times.frame_ms, scan_ms + point.times.decode_ms);
    }
    let front = trade.front();
    let (first, last) = (front[0], front[front.len() - 1]);
    let fastest = trade.points.iter().map(|p| p.times.frame_ms).fold(f64::MAX, f64::min);
    let least = trade.points.iter().map(|p| p.rmse("dz_mm")).fold(f64::MAX, f64::min);
    assert_eq!(trade.points[first].times.frame_ms, fastest);
    let [error, sure] = trade.points[last].estimate("rmse", "dz_mm").unwrap();
    assert!(error < least + 2.0 * sure, "{error} {least}");

    // Whatever else is averaged has its own limit and linear decoder.
    let readings = trade.readings();
    let [once, often] = readings.as_slice() else { panic!("{readings:?}") };
    assert_eq!([once, often].map(|it| trade.distinction(it)), ["1 sample", "16 samples"]);
    let (once, often) = (trade.references(once), trade.references(often));
    let errors: Vec<_> = once.iter().zip(&often).collect();
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
    for group in ["dx_mm", "dy_mm", "dz_mm"] {
        for (fixed, float) in [("fixed16", "f32"), ("fixed16 array", "f32 array")] {
            let [fixed, float] = [fixed, float].map(|way| find(way, 64, 1).rmse(group));
            assert!(fixed < 1.01 * float, "{group}: {fixed} against {float}");
        }
    }
    let (fixed, float) = (find("fixed16", 64, 1), find("f32", 64, 1));
    assert!(fixed.cycles < float.cycles / 3);
    assert!(fixed.blob_bytes < 6 * float.blob_bytes / 10);
    // One network for the array has less error, in fewer cycles.
    let array = find("fixed16 array", 64, 1);
    assert!(array.rmse("dz_mm") < 0.95 * fixed.rmse("dz_mm"), "{}", array.rmse("dz_mm"));
    assert!(array.cycles < fixed.cycles && array.blob_bytes < fixed.blob_bytes);
}

#[test]
fn the_chosen_point_is_the_cheapest_and_its_blob_is_as_stated() {
    let (planned, trade) = traded();
    let mut trade = trade.clone();
    trade.choose(&at_most("rmse_dz_mm", 0.04)).unwrap();
    let chosen = &trade.points[trade.chosen.unwrap()];
    assert!(chosen.rmse("dz_mm") <= 0.04 && chosen.samples_averaged == 16);
    for other in &trade.points {
        let cheaper = other.times.frame_ms < chosen.times.frame_ms && other.rmse("dz_mm") <= 0.04;
        assert!(!cheaper, "{} is cheaper", other.name());
    }
    let shown = trade.shown(&planned.subject, &planned.plan, &planned.points).unwrap().unwrap();
    assert_eq!(Some(shown.point), trade.chosen);
    let model = ModelBlob::of_bytes(&shown.blob).unwrap();
    assert_eq!(model.bytes().len(), chosen.blob_bytes);
    let scene = planned.subject.scene().unwrap();
    let frames = Synthesis::new(&scene.world).noise_level(scene.world.noise.level / 4.0);
    let test = frames.frames(Stream::Test, scene.test_frames);
    let estimate = model.prepare().decode_table(&test.inputs);
    let errors = test.outputs.squared_errors(&estimate.values);
    let z = errors.iter().skip(2).step_by(3);
    let count = errors.len() / 3 * test.frames();
    let rmse = (z.sum::<f64>() / count as f64).sqrt();
    assert!((rmse - chosen.rmse("dz_mm")).abs() < 1e-12, "{rmse}");
}

#[test]
fn choice_and_knee_are_those_worked_out_by_hand() {
    let mut trade = traded().1.clone();
    trade.points.truncate(6);
    // Time, cycles, flash and error; the fifth is as good and as fast as the second, and has fewer cycles; the last two
    // are off the front.
    let rows = [
        (1.0, 50.0, 500.0, 0.4),
        (2.0, 40.0, 400.0, 0.11),
        (100.0, 30.0, 300.0, 0.1),
        (50.0, 35.0, 350.0, 0.105),
        (2.0, 30.0, 900.0, 0.11),
        (0.5, 90.0, 900.0, 0.3),
    ];
    for (i, (point, (ms, cycles, bytes, rmse))) in trade.points.iter_mut().zip(rows).enumerate() {
        (point.times.frame_ms, point.cycles, point.blob_bytes) =
            (ms, cycles as u64, bytes as usize);
        point.on_front = i < 4;
        point.blocks.clear();
        let results = [("frame_ms", ms), ("cycles", cycles), ("blob_bytes", bytes)];
        let results = results.into_iter().chain([("rmse_dz_mm", rmse), ("linear_rmse_dz_mm", 1.0)]);
        point.results = results.map(|(name, value)| (name.to_owned(), value)).collect();
    }
    assert_eq!((trade.front(), trade.most_accurate()), (vec![0, 1, 3, 2], Some(2)));
    // ln(4/1.1)/ln 4 of the gain in error for ln 2/ln 100 of the time, and ln(4/1.05)/ln 4 for ln 50/ln 100.
    assert_eq!(trade.knee(), Some(1));
    assert_eq!(
        [1.02, 1.06, 1.1001, 5.0].map(|it| trade.fastest_within(it)),
        [2, 3, 1, 0].map(Some)
    );
    let mut chosen = |bounds: &[(&str, Bound)]| {
        let bounds = bounds.iter().map(|(name, bound)| ((*name).to_owned(), *bound)).collect();
        trade.choose(&bounds).unwrap();
        trade.chosen.unwrap()
    };
    assert_eq!(chosen(&[("rmse_dz_mm", Most(0.11))]), 4);
    assert_eq!(chosen(&[("rmse_dz_mm", Most(0.109))]), 3);
    assert_eq!(chosen(&[("rmse_dz_mm", Most(0.11)), ("blob_bytes", Most(400.0))]), 1);
    assert_eq!(chosen(&[("frame_ms", Most(49.0))]), 4);
    assert_eq!(chosen(&[("frame_ms", Most(1.0)), ("cycles", Least { least: 60.0 })]), 5);
    // With the worst case, its bound alone is one on errors: of those within it the cheapest, however accurate others are.
    trade.worst_case = true;
    for (point, (.., rmse)) in trade.points.iter_mut().zip(rows) {
        point.results.insert("worst_rmse_dz_mm".into(), rmse);
    }
    trade.choose(&at_most("worst_rmse_dz_mm", 0.11)).unwrap();
    assert_eq!(trade.chosen, Some(4));
    trade.worst_case = false;
    // A blob fits a slot, unless another bound on it is given.
    trade.points[2].results.insert("blob_bytes".into(), 131_073.0);
    assert!(trade.choose(&at_most("rmse_dz_mm", 0.1)).is_err());
    let mut bounds = at_most("rmse_dz_mm", 0.1);
    bounds.insert("blob_bytes".into(), Most(131_073.0));
    assert_eq!(trade.choose(&bounds), Ok(()));
    assert_eq!(trade.refused, None);
}

#[test]
fn a_point_that_loses_to_a_baseline_is_never_chosen() {
    let mut trade = traded().1.clone();
    let bounds = at_most("rmse_dz_mm", 0.055);
    trade.choose(&bounds).unwrap();
    let first = trade.chosen.unwrap();
    // A baseline that beats this point, then one that beats all.
    for least in [0.999 * trade.points[first].rmse("dz_mm"), 0.001] {
        for point in &mut trade.points {
            point.results.insert("linear_rmse_dz_mm".into(), least);
        }
        let refused = trade.choose(&bounds);
        let chosen = trade.chosen.map(|point| trade.points[point].rmse("dz_mm"));
        assert!(chosen.is_none_or(|rmse| rmse < least), "{chosen:?}");
        let beaten = "the baseline linear has an error of 0.0010 mm (dz_mm)";
        assert_eq!(refused.is_err_and(|cause| cause.contains(beaten)), least == 0.001);
        assert_eq!(trade.chosen.is_none(), least == 0.001);
    }
    // Nor does a card say how to choose one.
    let with = host_sim::report::TradeWith { shown: None, all: false, command: "taxel trade" };
    let text = host_sim::report::of_trade(&trade, with).text();
    assert!(!text.contains("taxel trade"), "{text}");
}

#[test]
fn the_worst_case_counts_other_contacts_in_front_and_choice() {
    let one_row = press().replace("[outputs]", "[readout]\nrow_wires = [4]\n\n[outputs]");
    let bounds = at_most("frame_ms", 1000.0);
    let [own, worst] = [false, true].map(|worst_case| {
        let planned = Planned::new(&one_row, |asked| {
            (asked.samples_averaged, asked.centres) = (vec![1], vec![8, 64]);
            asked.worst_case = worst_case;
        });
        let mut trade = planned.trade();
        trade.choose(&bounds).unwrap();
        let shown = trade.shown(&planned.subject, &planned.plan, &planned.points);
        (trade, shown.unwrap().unwrap())
    });
    for (a, b) in own.0.points.iter().zip(&worst.0.points) {
        assert_eq!(a.results, b.results);
        assert!(a.result("worst_rmse_dz_mm").unwrap() >= a.rmse("dz_mm"));
    }
    for (trade, shown) in [&own, &worst] {
        let point = &trade.points[shown.point];
        assert_eq!(shown.others.len(), 8);
        let largest =
            shown.others.iter().map(|(_, rmse)| *rmse).fold(point.rmse("dz_mm"), f64::max);
        assert!((largest - point.result("worst_rmse_dz_mm").unwrap()).abs() < 1e-12);
        // No faster point of the front is as good in what counts.
        let errors: Vec<f64> = trade.front().iter().map(|i| trade.counted_rmse(*i)).collect();
        assert!(errors.windows(2).all(|pair| pair[1] < pair[0]), "{errors:?}");
    }
    // The option that the page names makes a choice.
    let with = host_sim::report::TradeWith { shown: None, all: false, command: "taxel trade" };
    let text = host_sim::report::of_trade(&worst.0, with).text();
    let most = text.split("--max-error ").nth(1).and_then(|it| it.split_whitespace().next());
    let bounds = at_most("worst_rmse_dz_mm", most.unwrap().parse().unwrap());
    assert_eq!(worst.0.clone().choose(&bounds), Ok(()));
    let counted = |(trade, _): &(Trade, _)| trade.counted_rmse(trade.chosen.unwrap());
    assert!(counted(&worst) > counted(&own));
}

#[test]
fn the_plan_of_a_trade_is_one_for_sweep() {
    let folder = Folder::new("trade-plan");
    folder.write("few.toml", few_frames_of_two_rows());
    let few = ["trade", "few.toml", "--no-refine", "--centres", "8,16"];
    folder.succeed(&few);
    // In shards on other machines, by its plan.
    folder.write("plan.toml", folder.succeed(&[&few[..], &["--plan"]].concat()));
    for shard in ["1/2", "2/2"] {
        folder.succeed(&["sweep", "plan.toml", "--shard", shard, "-o", "parts"]);
    }
    folder.succeed(&["sweep", "plan.toml", "--merge", "parts", "-o", "merged.csv"]);
    assert_eq!(folder.read("merged.csv"), folder.read("out/few/trade.csv"));
    let bounded = [&few[..], &["--max-cycles", "9000", "--max-error", "0.1", "--plan"]].concat();
    let plan: toml::Table = folder.succeed(&bounded).parse().unwrap();
    let bounds = plan["bounds"].as_table().unwrap();
    assert_eq!(bounds["cycles"].as_float(), Some(9000.0));
    assert_eq!(bounds["rmse_dz_mm"].as_float(), Some(0.1));
}

#[test]
fn options_of_training_mean_what_they_do_in_train() {
    let folder = Folder::new("trade-options");
    let absolute = few_frames_of_two_rows()
        .replace("kind = \"relative\"\nlevel = 0.005", "kind = \"absolute\"\nlevel_ohm = 0.5")
        .replace("[training]", "[training]\nmethod = \"paper\"");
    assert!(absolute.contains("level_ohm") && absolute.contains("paper"));
    folder.write("absolute.toml", absolute);
    folder.write("few.toml", few_frames_of_two_rows());
    // The scenes' own K is more than these frames allow, and nothing is trained with it.
    let few = "-n 40 --no-refine --centres 8 --format f32 --seed 1";
    for (options, train, each_row) in [
        ("absolute.toml --noise 0.3", "", true),
        ("few.toml --paper", "", true),
        ("few.toml --spread 0.5", "--each-row", true),
        ("few.toml --spread 0.5", "", false),
    ] {
        let words = |command: &str, more: &str| -> serde_json::Value {
            let line = format!("{command} {options} {few} {more}");
            folder.json(&line.split_whitespace().collect::<Vec<_>>())
        };
        let trained = words("train -o m.bin", train);
        let rmse = crate::common::rmse(&trained["decoders"][0]["errors"], "dz_mm");
        let traded = words("trade", "");
        let mut points = traded["points"].as_array().unwrap().iter();
        let point = points.find(|it| it["training.each_row"] == each_row).unwrap();
        assert_eq!(point["rmse_dz_mm"].as_f64(), Some(rmse), "{options}: {point} {trained}");
        assert_eq!(point["spread"], trained["spread"], "{options}");
    }
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
    // Numbers of the table of points that end where this heading ends.
    let times_of = |page: &str| -> Vec<f64> {
        let heading = "frame (ms)";
        let is_of_times =
            |block: &&str| block.lines().next().is_some_and(|line| line.contains(heading));
        let table = page.split("\n\n").find(is_of_times);
        let table = table.unwrap().trim_start_matches('\n');
        let head = table.lines().next().unwrap();
        let end = head[..head.find(heading).unwrap()].chars().count() + heading.len();
        let time = |line: &str| {
            let before: String = line.chars().take(end).collect();
            before.split_whitespace().next_back().unwrap().parse().unwrap()
        };
        table.lines().skip(1).map(time).collect()
    };
    let front = folder.succeed(&few);
    let all = folder.succeed(&[&few[..], &["--all"]].concat());
    let (shown, every) = (times_of(&front), times_of(&all));
    assert!(shown.len() > 1 && shown.is_sorted(), "{front}");
    let more = format!("{} more points with --all", every.len() - shown.len());
    assert!(front.replace('\n', " ").contains(&more), "{front}");
    assert!(front.lines().chain(all.lines()).all(|line| line.chars().count() <= 120), "{all}");
    assert!(front.ends_with("\nopen out/few/trade.html\n"), "{front}");
    assert!(!all.contains("--all"), "{all}");
    let page = folder.succeed(&[&few[..], &["--max-cycles", "9000"]].concat());
    let csv = folder.read("out/few/trade.csv");
    let mut lines = csv.lines();
    let fields = "id,device.column_step,device.samples,training.centres,training.each_row,training.format,rows,";
    assert!(lines.next().unwrap().starts_with(fields));
    assert_eq!(lines.count(), every.len());
    let json: serde_json::Value = serde_json::from_str(&folder.read("out/few/trade.json")).unwrap();
    // One set of names, and nothing is explained that is not there.
    let first = json["points"][0].as_object().unwrap();
    assert!(
        csv.lines()
            .next()
            .unwrap()
            .split(',')
            .all(|name| { ["notes", "failed"].contains(&name) || first.contains_key(name) })
    );
    assert_eq!(page.contains("Knee: "), !json["knee"].is_null(), "{page}");
    let html = folder.read("out/few/trade.html");
    // The picture has each point of the front.
    let front = json["points"].as_array().unwrap().iter().filter(|p| p["on_front"] == true).count();
    let picture = folder.read("out/few/figures/error-by-time.csv");
    assert_eq!(picture.lines().filter(|line| line.starts_with("Pareto front,")).count(), front);
    assert!(html.contains("<td>chosen</td><td>fixed16") && html.contains(">chosen: K"));
    assert!(html.contains("taxel trade few.toml --no-refine --centres 16"), "the command");
    assert!(html.contains("at most 9\u{202f}000\u{a0}cycles"), "the bound");

    assert!(folder.path("out/few/chosen.bin").exists());
    // Measurements are kept where no point is chosen, and another run's choice is not left beside them.
    let output = folder.run(&[&few[..], &["--max-error", "0.05"]].concat());
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && stderr.contains("--max-error 0.05"), "{stderr}");
    assert!(stderr.contains("train and measure …\n"), "a log shows what runs: {stderr}");
    let page = String::from_utf8(output.stdout).unwrap();
    assert!(page.contains("\nfixed16 ") && page.contains("Nothing is chosen"), "{page}");
    assert!(!folder.path("out/few/chosen.bin").exists());
    let removed = "out/few/chosen.bin of an earlier trade is removed";
    assert!(stderr.contains(removed), "{stderr}");
    // What is three standard errors below the limit is refused before anything is trained.
    let of_limit = |name: &str| first[&format!("limit_{name}dz_mm")].as_f64().unwrap();
    for (below, says) in [(2.0, "no point is within"), (4.0, "no point can be within")] {
        let most = of_limit("") - below * of_limit("standard_error_");
        let output = folder.run(&[&few[..], &["--max-error", &most.to_string()]].concat());
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && stderr.contains(says), "{most} {stderr}");
    }
    assert!(!folder.notes(&few).contains(removed));
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
    assert!(page.contains("0.058 ms to scan") && page.contains("2 × 18 wires"), "{page}");
    assert!(folder.path("out/data/chosen.bin").exists());
    // What to type for a point of the front keeps the bound that the front was made with.
    let html = folder.read("out/data/trade.html");
    assert!(html.contains("<span>--max-flash</span> <span>40000</span>"), "{html}");

    // All that is said of the data stands in a plan for it.
    folder.succeed(&["synth", "small.toml", "-n", "9", "--untouched", "-o", "rest.csv"]);
    let relative = ["data.csv", "--relative-inputs", "--baseline", "rest.csv", "-o", "relative"];
    let relative = [&["--seed", "7", "trade"][..], &relative, &few].concat();
    folder.succeed(&relative);
    folder.write("plan.toml", folder.succeed(&[&relative[..7], &few, &["--plan"]].concat()));
    let points = folder.succeed(&["sweep", "plan.toml", "--list"]);
    let is_there = |id: &str| folder.path(&format!("relative/data/points/{id}.json")).exists();
    assert!(points.lines().all(|line| is_there(&line[..16])), "{points}");

    let csv = folder.read("data.csv");
    // An output without a value in the last fifth is not judged.
    let blank = |(i, line): (usize, &str)| match line.rsplit_once(',') {
        Some((line, _)) if i > 320 => format!("{line},\n"),
        _ => format!("{line}\n"),
    };
    folder.write("blank.csv", csv.lines().enumerate().map(blank).collect::<String>());
    folder.succeed(&[&["trade", "blank.csv"], &few[..]].concat());
    folder.write("other.csv", csv.replace("r4c", "a").replace("r5c", "b"));
    let columns = ["--inputs", "a*_ohm,b*_ohm", "--outputs", "r4e*_dz_mm"];
    let other = [&["trade", "other.csv"], &few[..], &columns].concat();
    let page = folder.succeed(&other).replace('\n', " ");
    assert!(page.contains("scan is unknown (--scan-ms)") && page.contains("besides its scan"));
    let page = folder.succeed(&[&other[..], &["--scan-ms", "2", "--frame-rate", "400"]].concat());
    assert!(page.contains("(2.000 ms to scan"), "{page}");
}
