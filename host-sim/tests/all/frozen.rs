//! Figures that must not change while the code around them is rewritten: testdata/frozen holds what revision 07b091fb
//! gave. Every option is stated, so that new defaults change nothing here. `TAXEL_FREEZE=1` writes the files anew; the
//! change that does so names each figure that it replaces, and why.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::PathBuf;

use serde_json::Value;

use crate::common::Folder;

/// Compares `actual` with the frozen file `name`, line by line.
fn hold(name: &str, actual: &str) {
    let file = frozen(name);
    if std::env::var_os("TAXEL_FREEZE").is_some() {
        std::fs::write(&file, actual).unwrap();
    }
    let expected = std::fs::read_to_string(&file).unwrap();
    for (number, (actual, expected)) in actual.lines().zip(expected.lines()).enumerate() {
        assert_eq!(actual, expected, "{name}, line {}", number + 1);
    }
    assert_eq!(actual.lines().count(), expected.lines().count(), "{name}: number of lines");
}

fn frozen(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/frozen")).join(name)
}

/// Runs the program on a line of options.
fn run(folder: &Folder, line: &str) -> String {
    folder.succeed(&line.split_whitespace().collect::<Vec<_>>())
}

fn json(folder: &Folder, line: &str) -> Value {
    serde_json::from_str(&run(folder, &format!("{line} --json --quiet"))).unwrap()
}

/// Decodes the frames in `frames` by a model of each number format, and holds the estimates.
fn hold_estimates(folder: &Folder, name: &str, train: &str, frames: &str) {
    for format in ["f32", "fixed16"] {
        run(folder, &format!("train {train} --format {format} -o {format}.bin --quiet"));
        run(folder, &format!("decode {format}.bin {frames} -o {format}.csv --quiet"));
        let estimates = std::fs::read_to_string(folder.path(&format!("{format}.csv"))).unwrap();
        hold(&format!("{name}-{format}.csv"), &estimates);
    }
}

#[test]
fn frames_and_estimates_of_the_papers_shape_are_frozen() {
    let folder = Folder::new("frozen-press");
    run(&folder, "synth press --noise 0.005 --seed 11 -n 2 -o press.csv --quiet");
    hold("press.csv", &std::fs::read_to_string(folder.path("press.csv")).unwrap());
    let common =
        "press --noise 0.005 --seed 12 -n 3000 --centres 16 --penalty 1e-9 --solver qr --no-refine";
    let rows = format!("{common} --spread 0.8 --each-row");
    hold_estimates(&folder, "rows", &rows, "press.csv");
    let array = format!("{common} --spread 0.4 --features 18");
    hold_estimates(&folder, "array", &array, "press.csv");
}

#[test]
fn estimates_of_a_mat_are_the_frozen_ones() {
    let folder = Folder::new("frozen-mat");
    folder.write("mat.toml", std::fs::read_to_string(frozen("mat.toml")).unwrap());
    run(&folder, "synth mat.toml --noise 0.01 --seed 13 -n 1500 -o mat.csv --quiet");
    run(&folder, "synth mat.toml --noise 0.01 --seed 14 -n 80 -o test.csv --quiet");
    let train = "mat.csv --inputs r*c*_ohm --outputs contact_* --grid 8x8 --rest none --seed 15 --centres 24 --spread 0.4 \
                 --features 9 --penalty 1e-7 --solver qr --no-refine";
    hold_estimates(&folder, "mat", train, "test.csv");
}

#[test]
fn the_cells_of_table_1_are_the_frozen_ones() {
    let folder = Folder::new("frozen-table1");
    let table = json(&folder, "table1 paper-as-printed --seed 1");
    let networks = table["errors"].as_array().unwrap().iter();
    let networks: Vec<&Value> = networks.filter(|it| it["decoder"] == "network").collect();
    let spreads = networks.iter().map(|it| it["spread"].as_f64().unwrap().to_bits());
    let spreads: BTreeSet<u64> = spreads.collect();
    assert_eq!(spreads.len(), 10);
    let lines = spreads.into_iter().map(f64::from_bits).map(|spread| {
        let of_spread = networks.iter().filter(|it| it["spread"].as_f64() == Some(spread));
        let line: Vec<&Value> = of_spread.map(|it| &it["largest_positional_percent"]).collect();
        format!("{}\n", serde_json::json!(line))
    });
    hold("table1.txt", &lines.collect::<String>());
}

/// The limit is sampled: it may be off by two standard errors of both.
#[test]
fn the_limit_is_the_frozen_one_within_two_standard_errors() {
    let folder = Folder::new("frozen-limit");
    let result = json(&folder, "limit press --noise 0.005,0.05 -n 100 --seed 1");
    let mut figures = String::new();
    let of_all = |line: &&Value| line["readings"] == "all 8 rows";
    for line in result["limits"].as_array().unwrap().iter().filter(of_all) {
        for name in ["dx_mm", "dy_mm", "dz_mm"] {
            let (noise, limit) = (&line["noise_level"], &line[format!("limit_{name}")]);
            let error = &line[format!("limit_standard_error_{name}")];
            writeln!(figures, "{noise},{name},{limit},{error}").unwrap();
        }
    }
    let file = frozen("limit.csv");
    if std::env::var_os("TAXEL_FREEZE").is_some() {
        std::fs::write(&file, &figures).unwrap();
    }
    let expected = std::fs::read_to_string(&file).unwrap();
    assert_eq!(figures.lines().count(), 6);
    for (actual, expected) in figures.lines().zip(expected.lines()) {
        let [actual, expected] = [actual, expected].map(|line| line.split(',').collect::<Vec<_>>());
        assert_eq!(actual[..2], expected[..2]);
        let [[rmse, error], [rmse_before, error_before]] = [actual, expected]
            .map(|line| [line[2], line[3]].map(|text| text.parse::<f64>().unwrap()));
        let allowed = 2.0 * error.hypot(error_before);
        assert!(
            (rmse - rmse_before).abs() <= allowed,
            "{rmse} mm, and was {rmse_before} ± {allowed} mm"
        );
    }
}

/// What `cargo xtask cycles` accepts. A frame may take fewer instructions than it did, and none more.
#[test]
fn no_shape_takes_more_instructions_than_the_frozen_ones() {
    let accepted = concat!(env!("CARGO_MANIFEST_DIR"), "/../firmware/cycles.csv");
    let accepted = std::fs::read_to_string(accepted).unwrap();
    let expected = std::fs::read_to_string(frozen("instructions.csv")).unwrap();
    assert_eq!(expected.lines().count(), 11);
    for line in expected.lines().skip(1) {
        let (model, before) = line.rsplit_once(',').unwrap();
        let frame = format!(",{model},frame,");
        let (_, rest) =
            accepted.split_once(&frame).unwrap_or_else(|| panic!("{model} is not counted"));
        let now: u64 = rest.split(',').next().unwrap().parse().unwrap();
        assert!(now <= before.parse().unwrap(), "{model}: {now} instructions, and took {before}");
    }
}
