//! Data files as sensors and scripts leave them: other dialects, no header, codes for missing values, fields kept as they are.

use std::fmt::Write as _;

use taxel_data::columns;

use crate::common::Folder;

/// Log without a header: a time in ns of more digits than f64 holds, two readings, and a force that is −1 where it is missing.
fn log() -> String {
    let mut text = String::new();
    for line in 0..200 {
        let time = 1_743_486_221_590_758_123_i64 + 30_000_000 * line;
        let x = (0.1 * line as f64).sin();
        let force = if line % 10 == 3 { -1.0 } else { 50.0 + 40.0 * x };
        let _ = writeln!(text, "{time},0{:.4},{},{force}", 2.0 + x, 100.0 * x * x);
    }
    text
}

#[test]
fn a_log_in_another_dialect_trains_the_same_model() {
    let folder = Folder::new("data-files");
    folder.write("log.csv", log());
    let names = "t (ns);a;b;f\n;V;V;N\n";
    folder.write("german.csv", names.to_owned() + &log().replace(',', ";").replace('.', ","));
    folder.write("numbered.csv", "1,2,3,4\n".to_owned() + &log());
    let train = |file: &'static str, more: &[&'static str]| {
        let train = ["train", file, "--missing", "-1", "--no-refine", "--centres", "8"];
        folder.notes(&[&train[..], &["-o", "m.bin"], more].concat())
    };
    let said = train("log.csv", &["--inputs", "c2..c3", "--outputs", "c4"]);
    assert!(said.contains("log.csv has no column names: columns are called c1 to c4 "), "{said}");
    assert!(said.contains("20 values of log.csv are -1, and count as missing"), "{said}");
    folder.succeed(&["decode", "m.bin", "log.csv", "--keep", "c1,c2", "-o", "e.csv"]);
    let estimates = folder.read("e.csv");
    let lines = || estimates.lines().map(|line| line.split(',').collect::<Vec<_>>());
    assert_eq!(lines().next().unwrap(), ["c1", "c2", "c4", "status"]);
    for (line, of_log) in lines().skip(1).zip(log().lines()) {
        assert_eq!(line[..2], of_log.split(',').collect::<Vec<_>>()[..2]);
        assert_eq!(line[2].parse::<f32>().unwrap().to_string(), line[2]);
    }

    let said = train("german.csv", &["--inputs", "a,b", "--outputs", "f"]);
    assert!(said.contains("german.csv: semicolons, decimal commas, units in line 2"), "{said}");
    assert!(folder.succeed(&["inspect", "m.bin"]).contains("f (N)"));
    folder.succeed(&["decode", "m.bin", "german.csv", "--keep", "t", "-o", "german-e.csv"]);
    let without = |text: &str| -> Vec<String> {
        text.lines().skip(1).map(|line| line.rsplit_once(',').unwrap().0.to_owned()).collect()
    };
    let of_log = without(&estimates).into_iter().map(|line| {
        let fields: Vec<&str> = line.split(',').collect();
        format!("{},{}", fields[0], fields[2])
    });
    assert_eq!(without(&folder.read("german-e.csv")), of_log.collect::<Vec<_>>());

    // A header of numbers is taken as one if that is said.
    train("numbered.csv", &["--inputs", "2,3", "--outputs", "4", "--header"]);
    folder.succeed(&["decode", "m.bin", "numbered.csv", "--header", "-o", "e.csv"]);
    assert!(folder.read("e.csv").starts_with("4,status\n"));
}

#[test]
fn every_unit_of_the_docs_is_known_by_its_spellings() {
    let docs = include_str!("../../../docs/data-files.md");
    let table = docs.split_once("| unit | spelled |\n|---|---|\n").unwrap().1;
    let mut count = 0;
    for row in table.lines().take_while(|line| line.starts_with('|')) {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let (units, spelled) = (cells[0].split(", "), cells[1].split(", "));
        if cells[1].starts_with("in brackets") {
            for unit in units {
                assert_eq!(
                    (columns::unit(unit), columns::unit_of(&format!("x_{unit}"))),
                    (Some(unit), "")
                );
            }
            continue;
        }
        for (unit, spelled) in units.zip(spelled) {
            for spelling in spelled.split(' ').map(|spelling| spelling.trim_matches('`')) {
                assert_eq!(columns::unit_of(&format!("x_{spelling}")), unit, "{spelling}");
            }
            count += 1;
        }
    }
    assert_eq!(count, columns::UNITS.len(), "each unit has its place in the table");
}
