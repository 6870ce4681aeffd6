//! Results of every main command, held to two files: `testdata/json-keys.txt` has the keys of JSON, which programs rely on,
//! and their first values; `testdata/printed.txt` has what people read. Whoever changes a number there says why.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::common::{Folder, small_scene, small_scene_with_table1, tiny_moving_scene, tiny_scene};

/// Commands of a study from its scene to its plans, one after the other in one folder.
const COMMANDS: [&str; 99] = [
    "synth scene.toml -n 200 -o data.csv",
    "forward scene.toml data.csv -o ideal.csv",
    "train scene.toml --reading-model full -o m.bin",
    "train data.csv --select --no-refine --centres 4,8 --spread 0.5,1 -o d.bin",
    "train scene.toml --solver rls -o r.bin",
    "decode m.bin data.csv --confidence -o e.csv",
    "eval m.bin data.csv --without r4c5_ohm",
    "inspect m.bin",
    "export m.bin --c lib",
    "run data.csv --no-refine",
    "run scene.toml",
    "table1 scene.toml",
    "limit scene.toml -n 4 --model m.bin",
    "limit scene.toml tiny.toml -n 4",
    "trade scene.toml --centres 6 --max-error 1",
    "compare tiny.toml --centres 4,6 -o both",
    "sweep plan.toml --list",
    "sweep plan.toml --shard 1/2 -o out/tiny",
    "sweep plan.toml",
    // A row and a column broken at once.
    "train press -n 1440 --centres 6 --no-refine --reading-model full -o press.bin",
    "synth press -n 30 --seed 4 -o press.csv",
    "eval press.bin press.csv --without r4c*_ohm,r*c5_ohm --html eval.html",
    // Pages and pictures of measurements, one of which drifts, and is touched now and then.
    "run log.csv --inputs ch* --outputs f* --rest f* --no-refine --centres 6 -o log",
    "train log.csv --inputs ch* --outputs f* --relative-inputs --each-row --no-refine --centres 6 --first-share 0.7 -o l.bin",
    "eval l.bin log.csv --last-share 0.3 --html l.html",
    "decode l.bin log.csv --keep time_s --filter-ms 40 --lead-ms 5 -o l.csv",
    "run contact.toml -o places",
    "run drifts.toml --relative-inputs -o drifts",
    "run short.toml -o moves",
    "synth moving.toml -n 40 --frame-rate 200 --scan-ms 2 -o moves.csv",
    "synth drifts.toml -n 20 --scale 1.5 --seed 3 -o scaled.csv",
    "limit spans.toml --noise 0.01,0.03 -n 4 -o spans",
    "trade scene.toml --centres 4,6 --average 1,4 --column-step 1,3 --frame-rate 50 --all -o rates",
    "trade tiny.toml --centres 4 --readout onchip --average 1,4 --max-latency-ms 9 --clock-mhz 90 --worst-case -o slow",
    "trade moving.toml --centres 4 --max-error 1 --scan-ms 3 --limit-frames 2 -o moving-trade",
    "trade tiny.toml --centres 4,12 --max-flash 6000 --all -o small",
    "synth spans_drift.toml -n 20 -o spans.csv",
    "sweep all.toml",
    "sweep folds.toml",
    // Arrays that are not square, wires that are not read, contacts of several shapes, and every kind of noise at once.
    "synth odd.toml -n 300 -o odd.csv",
    "synth odd.toml -n 30 --untouched -o rest.csv",
    "train odd.toml -o odd.bin",
    "inspect odd.bin",
    "eval odd.bin odd.csv --baseline rest.csv --without r2c4_ohm,r5c1* --html odd.html",
    "decode odd.bin odd.csv --baseline rest.csv --limits 20,400 --confidence -o odd-e.csv",
    "run odd.toml -o odd",
    "limit still.toml -n 3 -o still",
    "run slow.toml -o slow",
    "trade slow.toml --centres 4 --average 20 --readout onchip --clock-mhz 90 --group all --max-error 5 -o slow",
    "synth slow.toml -n 60 --frame-rate 100 --scan-ms 6 -o slow.csv",
    "run alone.toml --reading-model full --relative-inputs -o alone",
    "limit alone.toml -n 4 --row 3 --noise 0.01,0.02 -o alone",
    "trade alone.toml --centres 4,8 --average 1,2 --column-step 1,2 --group all --all -o alone",
    "compare alone.toml wider.toml --centres 4,6 --average 1,4 --readout onchip --group dx_mm --max-latency-ms 2 -o both",
    "train flat.toml --format fixed16 --each-row --reading-model fill -o flat.bin",
    "limit flat.toml -n 3 --model flat.bin -o flat",
    "export flat.bin --rust flat.rs",
    "sweep scenes.toml",
    // A mat's log in another dialect, with gaps, lines that are cut, values far from all others, and folds.
    "run gaps.csv --inputs ch* --outputs x_mm,y_mm,fz_n --missing 4095 --grid 3x5 --time time_ms --centres 6 --no-refine --reading-model full -o gaps",
    "run gaps.csv --inputs ch*,!ch4 --outputs fz_n --relative-inputs --rest fz_n --time time_ms --centres 6 --solver rls --penalty 1e-5 -o rls",
    "train gaps.csv --inputs ch* --outputs *_mm,fz_n --missing 4095 --grid 3x5 --fold-column place --select --centres 3,6 --spread 0.5,1 --no-refine --reading-model full -o g.bin",
    "decode g.bin gaps.csv --missing 4095 --without r2c2_ch7,r3c2* --keep place,time_ms --confidence --filter-ms 60 --lead-ms 10 -o g.csv",
    "eval g.bin gaps.csv --missing 4095 --without r2c2_ch7,r3c2* --last-share 0.3 --time time_ms --html g.html",
    "trade gaps.csv --inputs ch* --outputs fz_n,x_mm --keep-outliers --fold-column place --centres 3,6 --spread 1 --no-refine --grid 3x5 --all -o gaps",
    // A recording, and what is read from it.
    "decode g.bin gaps.csv --missing 4095 --without r3c2* --confidence --no-fill --first-share 0.3 -o g.mcap",
    "decode g.bin g.mcap --filter-ms 60 --confidence -o h.csv",
    "synth slow.toml -n 40 -o slow.mcap",
    "train slow.toml -o slow.bin",
    "eval slow.bin slow.mcap",
    "decode slow.bin slow.mcap --filter-ms 20 -o slow-e.csv",
    // Options and files that meet.
    "synth odd.toml -n 60 --seed 9 -o more.csv",
    "run odd.csv --inputs r* --outputs contact_* --test more.csv --relative-inputs --baseline rest.csv --centres 6 --no-refine -o tested",
    "export odd.bin --c oddlib",
    "inspect flat.bin",
    "inspect g.bin",
    "synth flat.toml -n 60 -o flat.csv",
    "eval flat.bin flat.csv --without r1c2_ohm --html flat.html",
    "decode flat.bin flat.csv --without r1c2_ohm --no-fill -o flat-e.csv",
    "decode l.bin log.csv --limits 45,100 --filter-ms 40 -o limits.csv",
    "run glide.toml --relative-inputs -o glide",
    "run slow.toml --noise 0.1 --paper -o paper",
    "export flat.bin --c flatlib",
    "export g.bin --c glib",
    "export g.bin --rust g.rs",
    "synth slow.toml -n 20 --still --noise 0.2 -o still.csv",
    "run flat.csv --inputs r*_ohm --outputs r*_n --each-row --format fixed16 --no-refine --centres 5 --last-share 0.8 -o rows",
    "synth alone.toml -n 30 -o alone.csv",
    "forward alone.toml alone.csv -o forward.csv",
    "train flat.toml --paper -o paper.bin",
    "table1 book.toml --group dx_mm",
    "run book.toml -o book",
    "compare alone.toml wider.toml --limit-only -o limits",
    "run gaps.csv --inputs ch* --outputs *_mm,fz_n --fold-column place --keep-outliers --features 6 --features-kind plain --format f32 --spread 1 --centres 6 --no-refine -o folded",
    "run units.tsv --inputs ch1..ch4 --outputs F* --first-share 0.8 --folds 4 --keep-outliers --relative-inputs --centres 4 --no-refine --reading-model full -o units",
    "train units.tsv --inputs ch1..ch4 --outputs F* --first-share 0.7 --centres 4 --no-refine --reading-model full -o u.bin",
    "eval u.bin units.tsv --last-share 0.3 --without ch2 --html u.html",
    "train gaps.csv --inputs ch* --outputs fz_n,x_mm --relative-inputs --rest fz_n --first-share 0.6 --solver rls --centres 6 --grid none -o relative.bin",
    "eval relative.bin gaps.csv --last-share 0.4 --time time_ms --html relative.html",
    "decode relative.bin gaps.csv --keep place --no-fill --last-share 0.4 --filter-ms 60 --period-ms 20 -o relative.csv",
];

/// Commands that are refused, whose reasons have figures.
const REFUSED: [&str; 8] = [
    "trade alone.toml --centres 4 --frame-rate 20000 --max-latency-ms 0.9",
    "trade alone.toml --centres 4 --column-step 1,2 --average 2 --max-latency-ms 0.05",
    "trade alone.toml --centres 4 --max-error 0.09 --max-cycles 2000",
    "trade alone.toml --centres 4 --max-cycles 20 --max-flash 90",
    "trade gaps.csv --inputs ch* --outputs fz_n --scan-ms 2 --frame-rate 900 --centres 3 --no-refine",
    "run gaps.csv --inputs ch* --outputs fz_n --last-share 0.6 --strict",
    "run gaps.csv --inputs ch* --outputs fz_n --last-share 0.8 --time place",
    "train gaps.csv --inputs ch* --outputs x_mm,fz_n --fold-column place --centres 900 -o x.bin",
];

/// Axes of all kinds, with prices, bounds and draws.
const ALL: &str = "name = \"all\"\nscene = \"tiny.toml\"\nlimit_frames = 4\nrepeats = 2\nalso = [\"baselines\", \"other_contacts\"]\n\
                   objectives = [\"rmse_dz_mm\", \"frame_ms\", \"cost_eur\"]\n\
                   [axes]\ndevice.samples = [1, 3]\ntraining.relative_inputs = [false, true]\n\
                   [draw]\npoints = 3\nseed = 5\n[draw.axes]\nnoise.level = { from = 0.002, to = 0.05, log = true }\n\
                   [prices]\nfixed_eur = 1.5\nrow_eur = 0.25\ncolumn_eur = 0.125\ncm2_eur = 3.0\n\
                   [bounds]\nframe_ms = 40\nframes_per_s = { least = 1 }\n";

/// Folds of measurements, with results that repeat over them.
const FOLDS: &str = "name = \"folds\"\n[data]\nfile = \"log.csv\"\ninputs = \"ch*\"\noutputs = \"f*\"\nfold_blocks = 3\n\
                     [set]\ntraining.refine = false\n[axes]\ndata.fold = [0, 1, 2]\ntraining.centres = [3, 5]\n";

/// Two scenes, with seeds and a bound.
const SCENES: &str = "name = \"scenes\"\nscene = [\"alone.toml\", \"wider.toml\"]\nlimit_frames = 3\nrepeats = 3\n\
                      objectives = [\"rmse_dz_mm\", \"cost_eur\"]\n\
                      [axes]\ntraining.format = [\"f32\", \"fixed16\"]\ndevice.column_step = [1, 2]\n[bounds]\ncycles = 3000\n[prices]\nfixed_eur = 0.5\nrow_eur = 0.25\ncolumn_eur = 0.125\ncm2_eur = 2.0\n";

/// Presses on a mat of 3 × 5 cells, with semicolons and decimal commas. Some readings and outputs are missing or far off, and
/// two lines are cut.
fn gaps() -> String {
    let line = |i: usize| {
        let (t, press) = (i as f64, (i % 90) as f64);
        let press =
            if press < 60.0 { (press * std::f64::consts::PI / 60.0).sin().max(0.0) } else { 0.0 };
        let place = i / 90;
        let x = 3.0 * (place * 7 % 5) as f64 + (0.2 * t).sin();
        let y = 2.0 * (place * 3 % 4) as f64 + 0.5 * (0.3 * t).cos();
        let force = 4.0 * press * (1.0 + 0.1 * place as f64);
        let mut cells: Vec<String> = (0..15)
            .map(|cell| {
                let [row, column] = [cell / 5, cell % 5].map(|it| it as f64);
                let d = ((3.0 * column - x) / 3.5).powi(2) + ((4.0 * row - y) / 4.0).powi(2);
                let rough = ((i * 7919 + cell / 5 * 31 + cell % 5 * 17) % 101) as f64 / 40.0;
                format!("{:.3}", 500.0 + 0.05 * t - 60.0 * force * (-d).exp() + rough)
            })
            .collect();
        match i {
            333 | 700 => cells[5] = "99999".into(),
            _ if i % 53 == 7 => cells[i % 15].clear(),
            _ if i % 61 == 5 => cells[i / 61 % 15] = "nan".into(),
            _ if i % 97 == 11 => cells[3] = "4095".into(),
            _ => {}
        }
        let touched = |value: f64| if press > 0.0 { format!("{value:.3}") } else { String::new() };
        let force = if i % 101 == 50 { String::new() } else { format!("{force:.3}") };
        let cut = if [120, 450].contains(&i) { "cut;" } else { "" };
        let line = [format!("{cut}{:.1}", 20.0 * t), touched(x), touched(y), force].join(";");
        format!("{line};{};{}\n", place % 5, cells.join(";")).replace('.', ",")
    };
    let channels: Vec<String> = (1..=15).map(|channel| format!("ch{channel}")).collect();
    let channels = channels.join(";");
    let heads = format!("# A mat.\ntime_ms;x_mm;y_mm;fz_n;place;{channels}\n");
    heads + &(0..900).map(line).collect::<String>()
}

/// Presses of different strengths on four channels that drift apart, with rest between them.
pub fn log() -> String {
    let line = |i: i32| {
        let t = 0.01 * f64::from(i);
        let press = (0.7 * t).sin().max(0.0) * (1.0 + (0.31 * t).cos());
        let [x, z] = [press * (2.3 * t).sin(), 5.0 * press];
        let drift = 1.0 + 0.002 * t;
        let rough = f64::from((i * 7919) % 101) / 500.0;
        let [a, b] = [90.0 * drift - 4.0 * z + x, 70.0 / drift + 2.0 * z * z + rough];
        let [c, d] = [80.0 + 9.0 * x - rough, 60.0 - 2.0 * z - 3.0 * x * z - 2.0 * rough];
        format!("{t},{a},{b},{c},{d},{x},{z}\n")
    };
    let heads = "time_s,ch1_ohm,ch2_ohm,ch3_ohm,ch4_ohm,fx_n,fz_n\n".to_owned();
    heads + &(0..1500).map(line).collect::<String>()
}

/// Scenes, plans and measurements of all commands.
fn prepared() -> Folder {
    let folder = Folder::new("json_keys");
    let scene = small_scene_with_table1();
    folder.write("scene.toml", scene.replace("frames = 3000", "frames = 600"));
    let tiny = tiny_scene().replace("name = \"small\"", "name = \"tiny\"");
    folder.write("plan.toml", crate::sweep::PLAN.replace("scene.toml", "tiny.toml"));
    let contact = include_str!("../../../scenes/contact.toml");
    folder.write(
        "contact.toml",
        contact
            .replace("frames = 20000", "frames = 400")
            .replace("frames = 8000", "frames = 60")
            .replace("centres = 64", "centres = 8")
            .replace("[training]", "[training]\nrefine = false"),
    );
    let moving = tiny_moving_scene();
    folder.write("short.toml", moving.replace("duration_s = 0.6", "duration_s = 0.1"));
    folder.write("moving.toml", moving);
    let level = "kind = \"relative\"\nlevel = 0.005";
    let drifts = "kind = \"absolute\"\nlevel_ohm = 0.4\ncorrelated_level_ohm = 0.3\ntime_constant_ms = 20.0\n\n[drift]\ngain = 0.03";
    folder.write(
        "drifts.toml",
        small_scene().replace("frames = 3000", "frames = 300").replace(level, drifts),
    );
    folder.write(
        "spans.toml",
        tiny.replace("\"relative\"", "\"span\"").replace("\"tiny\"", "\"spans\""),
    );
    let drifts = format!("{}\n[drift]\ngain = 0.2\n", tiny.replace("\"relative\"", "\"span\""));
    folder.write("spans_drift.toml", drifts);
    folder.write("tiny.toml", tiny);
    let odd = include_str!("scenes/odd.toml");
    let slow = include_str!("scenes/slow.toml");
    let glide = slow.replace("seed = 5", "seed = 5\nothers = []");
    let of_contact = "contact = [\"centre\"]";
    let glide = glide.replace("quantity = \"force\"\naxes = [\"x\", \"z\"]", of_contact);
    folder.write("glide.toml", glide);
    let still = odd.replace("[drift]\ngain = 0.05", "").replace("relative_inputs = true", "");
    let alone = include_str!("scenes/alone.toml");
    let flat = alone.replace("\"deformation\"\naxes", "\"force\"\naxes");
    let wider = alone.replace("15.0, 9.0, 4.0", "18.0, 12.0, 5.0").replace("[1, 3]", "[1, 2]");
    for (name, scene) in [("odd", odd), ("still", &still), ("slow", slow)] {
        folder.write(&format!("{name}.toml"), scene);
    }
    for (name, scene) in [("alone", alone), ("flat", &flat), ("wider", &wider)] {
        folder.write(&format!("{name}.toml"), scene);
    }
    folder.write("all.toml", ALL);
    folder.write("scenes.toml", SCENES);
    folder.write("gaps.csv", gaps());
    let book = "\n[table1]\nspreads = [0.5, 1.0]\nnoise_levels = [0.01, 0.03]\nframes = 300\ntest_frames = 40\n\
                centres = 6\nstandard_frames = 30\ntextbook_covariance = 1e6\n";
    folder.write("book.toml", alone.to_owned() + book);
    let units = "time\tch1\tch2\tch3\tch4\tFx\tFz\ns\tkOhm\tkOhm\tkOhm\tkOhm\tmN\tmN\n";
    let lines = log().lines().skip(1).take(600).collect::<Vec<_>>().join("\n");
    folder.write("units.tsv", units.to_owned() + &lines.replace(',', "\t"));
    folder.write("folds.toml", FOLDS);
    folder.write("log.csv", log());
    folder
}

/// Values in JSON by their keys, each key with those that it stands in.
type Values = BTreeMap<String, Vec<String>>;

fn add_values(value: &Value, path: &str, values: &mut Values) {
    match value {
        Value::Object(members) => {
            for (key, member) in members {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                values.entry(path.clone()).or_default();
                // What differs from run to run, and from build to build.
                if !["seconds", "version", "build", "id", "points_per_s"].contains(&key.as_str()) {
                    add_values(member, &path, values);
                }
            }
        }
        Value::Array(items) => items.iter().for_each(|item| add_values(item, path, values)),
        Value::String(text) => values.entry(path.into()).or_default().push(text.replace('\n', " ")),
        value => values.entry(path.into()).or_default().push(value.to_string()),
    }
}

/// Text of a value: four digits of a number that is not whole.
fn short(text: &str) -> String {
    match text.parse::<f64>() {
        Ok(number) if number.fract() != 0.0 => format!("{number:.3e}"),
        _ => text.chars().take(60).collect(),
    }
}

/// All of up to three values; of more the first, the last, and their weighted mean, which tells an order from another.
fn few(values: &[String]) -> String {
    if let [first, _, _, .., last] = values {
        let numbers = values.iter().map(|it| it.parse::<f64>().unwrap_or(0.0)).zip(1..);
        let count = values.len() as f64;
        let mean =
            numbers.map(|(value, place)| value * f64::from(place)).sum::<f64>() / count / count;
        return format!("{} … {} ({count}, {mean:.3e})", short(first), short(last));
    }
    values.iter().map(|value| short(value)).collect::<Vec<_>>().join(" | ")
}

/// Compares the cells of a CSV file of points with those that JSON has by the same keys. Ids tell the build, which another
/// step of CI may make anew between the two.
fn compare_points(name: &str, csv: &str, printed: &Value) {
    let mut lines = csv.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let heads = lines.next().unwrap();
    let points = printed["points"].as_array().unwrap();
    assert_eq!(lines.clone().count(), points.len(), "{name}");
    for cells in lines {
        let Some(point) = points.iter().find(|point| point["id"] == cells[0]) else { continue };
        for (head, cell) in heads.iter().zip(cells) {
            // Only CSV has notes, which are sentences.
            let Some(value) = point.get(head) else { continue };
            let same = match value {
                Value::Null => cell.is_empty(),
                Value::Bool(value) => value.to_string() == cell,
                Value::String(text) => text == cell,
                value => value.as_f64() == cell.parse().ok(),
            };
            assert!(same, "{name}, {head}: {cell}, and in JSON {value}");
        }
    }
}

/// Number of a content, by which a change is seen (FNV-1a).
fn digest(content: &[u8]) -> u64 {
    content.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3)
    })
}

/// All files below a folder, but for points of sweeps, whose names tell the build, and recordings, which tell when they were made.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut all = vec![];
    for entry in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.is_dir() {
            all.extend(
                files(&entry)
                    .into_iter()
                    .filter(|it| !it.components().any(|part| part.as_os_str() == "points")),
            );
        } else if entry.extension().is_none_or(|end| end != "mcap") {
            all.push(entry);
        }
    }
    all.sort();
    all
}

/// A text without the version and what depends on the build: its number, and ids of points, of sixteen digits.
fn without_build(text: &str) -> String {
    let text = text.replace(env!("CARGO_PKG_VERSION"), "");
    let words = text.split_inclusive(|c: char| !c.is_ascii_alphanumeric());
    let kept = words.map(|word| match word.split_at_checked(16) {
        Some((number, end)) if end.len() <= 1 && number.chars().all(|c| c.is_ascii_hexdigit()) => {
            end
        }
        _ => word,
    });
    kept.collect()
}

/// A digest of a file; points are those of the command's `result`, which is a file itself.
fn read(path: &Path, content: &[u8], result: &Value) -> String {
    let name = path.to_string_lossy();
    let text = without_build(&String::from_utf8_lossy(content));
    let content = match path.extension().and_then(|end| end.to_str()) {
        Some("json") => return String::new(),
        Some("csv") if text.starts_with("id,") => {
            compare_points(&name, &String::from_utf8_lossy(content), result);
            return String::new();
        }
        Some("csv") => text.split([',', '\n']).map(short).collect::<Vec<_>>().join(","),
        Some("html") => text.split_once("</style>").unwrap().1.into(),
        _ => text,
    };
    format!("  {name} {:016x}\n", digest(content.as_bytes()))
}

/// Compares with a file in `testdata`, which `TAXEL_ACCEPT` writes anew.
fn hold(name: &str, found: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../testdata").join(name);
    if std::env::var_os("TAXEL_ACCEPT").is_some() {
        fs::write(&path, found).unwrap();
    }
    let accepted = fs::read_to_string(&path).unwrap();
    let mut command = "";
    for (found, accepted) in found.lines().zip(accepted.lines()) {
        command = if COMMANDS.contains(&found) { found } else { command };
        assert_eq!(
            found, accepted,
            "{name}, {command}: TAXEL_ACCEPT=1 accepts it; docs/json.md and CHANGELOG.md name changed keys"
        );
    }
    assert_eq!(found.lines().count(), accepted.lines().count(), "{name}");
}

/// A result without the time that it took.
fn untimed(mut result: Value) -> Value {
    result.as_object_mut().unwrap().remove("seconds");
    result
}

/// The JSON file that a command wrote of its result; `None` if there is none, or one for each scene.
fn file_of_result(command: &str, written: &[(PathBuf, Vec<u8>)]) -> Option<Value> {
    let files = written.iter().filter(|(path, _)| path.extension().is_some_and(|it| it == "json"));
    let values = files.map(|(_, content)| serde_json::from_slice::<Value>(content).unwrap());
    let mut results = values.filter(|value| value["command"] == command);
    let result = results.next()?;
    results.next().is_none().then_some(result)
}

#[test]
fn results_stay_as_they_are() {
    let folder = prepared();
    let mut known: BTreeSet<(PathBuf, Vec<u8>)> = BTreeSet::new();
    let mut new_files = || {
        let root = folder.path("");
        let all = files(&root)
            .into_iter()
            .map(|path| (path.strip_prefix(&root).unwrap().to_owned(), fs::read(&path).unwrap()));
        all.filter(|file| known.insert(file.clone())).collect::<Vec<_>>()
    };
    new_files();
    let first = "# TAXEL_ACCEPT=1 cargo test -p host-sim --test all json_keys writes this anew.\n";
    let [mut keys, mut printed] = [
        "# Keys of each command's JSON, and some of their values.\n",
        "# What commands print, and the files that they write.\n",
    ]
    .map(|what| what.to_owned() + first);
    // Commands whose file was seen to be what they print.
    let mut compared = BTreeSet::new();
    for command in COMMANDS {
        let arguments: Vec<&str> = command.split(' ').collect();
        let output = folder.run(&arguments);
        assert!(output.status.success(), "{command}");
        let written = new_files();
        let result = match file_of_result(arguments[0], &written) {
            Some(file) => {
                if compared.insert(arguments[0]) {
                    assert_eq!(untimed(folder.json(&arguments)), file, "{command}");
                }
                file
            }
            None => folder.json(&arguments),
        };
        assert_eq!(result["command"], arguments[0]);
        let [mut text, said] =
            [output.stdout, output.stderr].map(|it| String::from_utf8(it).unwrap());
        let is_note =
            |line: &&str| ["note: ", "warning: ", "  "].iter().any(|it| line.starts_with(it));
        text.extend(said.lines().filter(is_note).map(|line| format!("{line}\n")));
        let mut values = Values::new();
        add_values(&result, "", &mut values);
        keys.extend(["\n", command, "\n"]);
        keys.extend(values.iter().map(|(key, values)| {
            format!("    {key}  {}", few(values)).trim_end().to_owned() + "\n"
        }));
        printed.extend(["\n", command, "\n", &without_build(&text)]);
        printed.extend(written.iter().map(|(path, content)| read(path, content, &result)));
    }
    for command in REFUSED {
        let said = folder.fail(&command.split(' ').collect::<Vec<_>>(), 2);
        let why = said.lines().find(|line| line.starts_with("error: "));
        printed.extend(["\n", command, "\n", why.unwrap(), "\n"]);
    }
    hold("json-keys.txt", &keys);
    hold("printed.txt", &printed);
}

#[test]
fn keys_that_the_docs_explain_exist() {
    let known: BTreeSet<&str> = include_str!("../../../testdata/json-keys.txt")
        .split(|it: char| it != '_' && !it.is_alphanumeric())
        .collect();
    let page = include_str!("../../../docs/json.md");
    // The first cell of a table's lines.
    let cells = page.lines().filter_map(|line| line.strip_prefix("| `")?.split(" | ").next());
    let keys: Vec<&str> =
        cells.flat_map(|cell| cell.split('`').step_by(2)).map(str::trim).collect();
    assert!(keys.len() > 50, "{keys:?}");
    let missing: Vec<_> = keys.iter().filter(|key| !known.contains(**key)).collect();
    assert!(missing.is_empty(), "docs/json.md explains {missing:?}, which no command prints");
}
