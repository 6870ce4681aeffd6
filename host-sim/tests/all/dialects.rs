//! One log as twenty-odd programs write it: all train to the same estimates, to the bit.

use std::io::Write as _;

use flate2::Compression;
use flate2::write::GzEncoder;
use taxel_data::columns;

use crate::common::Folder;

/// Lines of the log: time in s, two readings and a force; the second reading of line 7 is missing.
fn lines() -> Vec<[Option<f64>; 4]> {
    let line = |i: i32| {
        let x = f64::from(i) / 60.0;
        let round = |value: f64| Some((value * 10_000.0).round() / 10_000.0);
        let reading = round((5.0 * x).sin()).filter(|_| i != 7);
        [round(x), round(1234.5 * x + 0.25), reading, round(2.0 * x * x - 1.0)]
    };
    (0..60).map(line).collect()
}

/// The log as text: `missing` stands for the missing value, and `number` writes others.
fn text(
    names: &str,
    separator: &str,
    end: &str,
    missing: &str,
    number: impl Fn(f64) -> String,
) -> String {
    let line = |values: &[Option<f64>; 4]| {
        let fields = values.iter().map(|value| value.map_or(missing.to_owned(), &number));
        fields.collect::<Vec<_>>().join(separator) + end
    };
    names.to_owned() + &lines().iter().map(line).collect::<String>()
}

fn point(value: f64) -> String {
    value.to_string()
}

fn comma(value: f64) -> String {
    value.to_string().replace('.', ",")
}

/// `%.18e` of C, as numpy writes it.
fn exponent(value: f64) -> String {
    let text = format!("{value:.18e}");
    let (digits, exponent) = text.split_once('e').unwrap();
    let exponent: i32 = exponent.parse().unwrap();
    format!("{digits}e{exponent:+03}")
}

fn latin_1(text: &str) -> Vec<u8> {
    text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect()
}

fn packed(text: &str) -> Vec<u8> {
    let mut packed = GzEncoder::new(vec![], Compression::fast());
    packed.write_all(text.as_bytes()).unwrap();
    packed.finish().unwrap()
}

/// Name of a file, its bytes, and what is said of it; "" if it is plain.
type File = (&'static str, Vec<u8>, &'static str);

/// Files whose columns are called t, a, b and f.
fn named() -> Vec<File> {
    let plain = text("t,a,b,f\n", ",", "\n", "", point);
    let pandas = |separator: &str, number: fn(f64) -> String| -> String {
        let all = text("t,a,b,f\n", ",", "\n", "", point);
        let lines = all.lines().enumerate().map(|(line, text)| {
            let index = if line == 0 { String::new() } else { (line - 1).to_string() };
            let fields =
                text.split(',').map(|field| field.parse().map_or(field.to_owned(), number));
            let fields = std::iter::once(index).chain(fields).collect::<Vec<_>>();
            fields.join(separator) + "\n"
        });
        lines.collect()
    };
    let semicolons = text("t;a;b;f\r\n", ";", "\r\n", "", comma);
    let utf_16 = semicolons.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<_>>();
    let iso = {
        let line = |(line, values): (usize, &[Option<f64>; 4])| {
            let field = |value: &Option<f64>| value.map_or(String::new(), point);
            let fields = values[1..].iter().map(field).collect::<Vec<_>>().join(",");
            format!("2026-11-01T07:30:{line:02}.5Z,{fields}\n")
        };
        "t,a,b,f\n".to_owned() + &lines().iter().enumerate().map(line).collect::<String>()
    };
    let aligned = {
        let all = text("t,a,b,f\n", ",", "\n", "NaN", point);
        let line = |line: &str| {
            line.split(',').map(|it| format!("{it:>12}")).collect::<Vec<_>>().concat() + "\n"
        };
        all.lines().map(line).collect::<String>()
    };
    let quoted = plain.replace(',', "\",\"").replace('\n', "\"\n\"");
    let remark = |text: &str| text.replacen("\n0.5", "\n# somebody bumped the table\n0.5", 1);
    vec![
        ("plain.csv", plain.clone().into(), ""),
        ("crlf.csv", plain.replace('\n', "\r\n").into(), ""),
        ("mac.csv", plain.replace('\n', "\r").into(), ""),
        ("bom.csv", ("\u{feff}".to_owned() + &plain).into(), ""),
        ("blank-lines.csv", plain.replacen("\n0.5", "\n\n0.5", 1).into(), ""),
        ("quoted.csv", format!("\"{}", quoted.trim_end_matches('"')).into(), ""),
        ("na.csv", text("t,a,b,f\n", ",", "\n", "#N/A", point).into(), ""),
        ("pandas.csv", pandas(",", point).into(), "columns without a name are called c1"),
        ("iso.csv", iso.into(), ""),
        ("excel-german.csv", semicolons.clone().into(), "semicolons, decimal commas"),
        (
            "excel-sep.csv",
            ("sep=;\r\n".to_owned() + &semicolons).into(),
            "semicolons, decimal commas",
        ),
        (
            "excel-unicode.txt",
            [vec![0xff, 0xfe], utf_16].concat(),
            "UTF-16, semicolons, decimal commas",
        ),
        (
            "pandas-german.csv",
            pandas(";", comma).into(),
            "semicolons, decimal commas, columns without a name are called c1",
        ),
        (
            "pandas.csv.gz",
            packed(&pandas(",", point)),
            "gzip, columns without a name are called c1",
        ),
        (
            "decimal-quoted.csv",
            text("t,a,b,f\n", ",", "\n", "\"\"", |it| format!("\"{}\"", comma(it))).into(),
            "decimal commas",
        ),
        ("writetable.txt", text("t,a,b,f\n", ",", "\n", "NaN", |it| format!("{it}")).into(), ""),
        ("writetable-tabs.txt", text("t\ta\tb\tf\n", "\t", "\n", "NaN", point).into(), "tabs"),
        (
            "savetxt.txt",
            text("# t a b f\n", " ", "\n", "nan", exponent).into(),
            "spaces, names in line 1, comments",
        ),
        (
            "savetxt.csv",
            text("# t,a,b,f\n", ",", "\n", "nan", exponent).into(),
            "names in line 1, comments",
        ),
        ("aligned.txt", aligned.into(), "spaces"),
        (
            "trailing.csv",
            text("t,a,b,f,\n", ",", ",\n", "", point).into(),
            "a separator at the end of each line",
        ),
        ("pipes.txt", text("t | a | b | f\n", " | ", "\n", "-", point).into(), "separator '|'"),
        ("comments.csv", remark(&format!("% logger 2.1\n{plain}")).into(), "comments"),
        ("latin-1.csv", latin_1(&format!("# at 21 °C, µ-scale\n{plain}")), "latin-1, comments"),
        ("gap.csv", text("t,a,b,f\n", ",", "\n", "N/A", |it| format!(" {it} ")).into(), ""),
    ]
}

/// Files with a line of units.
fn with_units() -> Vec<File> {
    let units = |separator: &str, units: &str, number: fn(f64) -> String| {
        let names = ["t", "a", "b", "f"].join(separator);
        text(&format!("{names}\n{units}\n"), separator, "\n", "", number).into_bytes()
    };
    vec![
        ("units.csv", units(",", "s,V,V,N", point), "units in line 2"),
        (
            "units-german.csv",
            units(";", "[s];[V];[V];[N]", comma),
            "semicolons, decimal commas, units in line 2",
        ),
        ("units-in-names.csv", text("t (s),a (V),b [V],f [N]\n", ",", "\n", "", point).into(), ""),
    ]
}

/// Files without names.
fn nameless() -> Vec<File> {
    vec![
        ("writematrix.csv", text("", ",", "\n", "NaN", point).into(), ""),
        ("savetxt-bare.txt", text("", " ", "\n", "nan", exponent).into(), "spaces"),
        ("tabs.tsv", text("", "\t", "\r\n", "", point).into(), "tabs"),
        ("german.csv", text("", ";", "\n", "", comma).into(), "semicolons, decimal commas"),
    ]
}

/// Estimates for the file's own lines, and the digest of a model that is trained on it.
fn trained(
    folder: &Folder,
    (name, bytes, says): &File,
    [inputs, outputs]: [&str; 2],
) -> (String, String) {
    folder.write(name, bytes);
    let how = ["--no-refine", "--centres", "5", "-o", "m.bin"];
    let output = folder
        .run(&[&["train", name, "--inputs", inputs, "--outputs", outputs], &how[..]].concat());
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{name}: {stderr}");
    let said = stderr.lines().find_map(|line| line.strip_prefix(&format!("note: {name}: ")));
    assert_eq!(said.unwrap_or(""), *says, "{name}");
    folder.succeed(&["decode", "m.bin", name, "-o", "e.csv"]);
    let estimates = std::fs::read_to_string(folder.path("e.csv")).unwrap();
    let summary = folder.succeed(&["inspect", "m.bin", "--json"]);
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let digest = summary["scene_digest"].as_str().unwrap().to_owned();
    (estimates.split_once('\n').unwrap().1.to_owned(), digest)
}

#[test]
fn one_log_in_any_dialect_trains_to_the_same_estimates() {
    let folder = Folder::new("dialects");
    let [by_name, by_place] = [["a,b", "f"], ["c2..c3", "c4"]];
    let groups = [(named(), by_name), (with_units(), by_name), (nameless(), by_place)];
    let mut all = vec![];
    for (files, columns) in groups {
        let of_group: Vec<_> =
            files.iter().map(|file| (file.0, trained(&folder, file, columns))).collect();
        for (name, (_, digest)) in &of_group {
            // The same numbers by the same names.
            let is_named = !name.starts_with("units");
            assert!(!is_named || *digest == of_group[0].1.1, "{name}");
        }
        all.extend(of_group);
    }
    assert!(all.len() >= 30, "{}", all.len());
    for (name, (estimates, _)) in &all {
        assert_eq!(*estimates, all[0].1.0, "{name}");
    }
}

#[test]
fn a_unit_of_a_units_line_is_kept_in_the_model_and_its_columns_go_by_their_bare_names() {
    let folder = Folder::new("units");
    let [file, ..] = &with_units()[..] else { unreachable!() };
    trained(&folder, file, ["a,b", "f"]);
    let summary = folder.succeed(&["inspect", "m.bin"]);
    assert!(summary.contains("f (N)"), "{summary}");
    let summary = folder.succeed(&["eval", "m.bin", "units.csv", "--json"]);
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let errors = &summary["decoders"][0]["errors"][0];
    assert_eq!((&errors["group"], &errors["unit"]), (&"f (N)".into(), &"N".into()));
    assert!(summary["verdict"].to_string().contains("trained on"), "{}", summary["verdict"]);
    // A log without units, and with fewer lines, is another file of the same columns.
    let log = text("t,a,b,f\n", ",", "\n", "", point);
    folder.write("bare.csv", log.lines().take(30).collect::<Vec<_>>().join("\n"));
    let bare = folder.succeed(&["eval", "m.bin", "bare.csv", "--json"]);
    let bare: serde_json::Value = serde_json::from_str(&bare).unwrap();
    assert_eq!(bare["frames"], 29);
}

#[test]
fn the_same_numbers_in_another_dialect_are_known_as_those_that_were_trained_on() {
    let folder = Folder::new("same-numbers");
    let files = named();
    let of = |name: &str| files.iter().find(|file| file.0 == name).unwrap();
    trained(&folder, of("plain.csv"), ["a,b", "f"]);
    let german = of("excel-german.csv");
    folder.write(german.0, &german.1);
    let summary = folder.succeed(&["eval", "m.bin", german.0, "--json"]);
    assert!(summary.contains("trained on"), "{summary}");
    let run =
        ["run", "plain.csv", "--inputs", "a,b", "--outputs", "f", "--test", german.0, "-o", "out"];
    let refused = folder.fail(&run, 2);
    assert!(refused.contains("the file that is trained on"), "{refused}");
}

#[test]
fn text_in_a_column_is_told_when_the_column_is_used_and_what_to_do_with_it() {
    let folder = Folder::new("text-columns");
    let line =
        |i: i32| format!("{i},{},{},good\n", i * i % 7, ["pen", "cup", "ball"][i as usize % 3]);
    folder
        .write("grasp.csv", format!("a,f,object,state\n{}", (0..40).map(line).collect::<String>()));
    let train = |outputs: &'static str| {
        [
            "train",
            "grasp.csv",
            "--inputs",
            "a",
            "--outputs",
            outputs,
            "--no-refine",
            "--centres",
            "4",
            "-o",
            "m.bin",
        ]
    };
    folder.succeed(&train("f"));
    for (outputs, says) in [
        (
            "object",
            ["\"object\" is a class label", "pen, cup, ball", "get_dummies", "take the largest"],
        ),
        ("state", ["line 2", "column \"state\"", "\"good\" is not a number", ""]),
        ("f,!f", ["--outputs", "choose no column", "'*,!f'", ""]),
        ("!f", ["--outputs", "choose no column", "'*,!f'", ""]),
        ("f,!g", ["\"!g\"", "no column matches", "--outputs", ""]),
    ] {
        let refused = folder.fail(&train(outputs), 2);
        assert!(says.iter().all(|part| refused.contains(part)), "{outputs}: {refused}");
    }
    folder.succeed(&["decode", "m.bin", "grasp.csv", "--keep", "object", "-o", "e.csv"]);
    let estimates = std::fs::read_to_string(folder.path("e.csv")).unwrap();
    assert!(estimates.lines().nth(2).unwrap().starts_with("cup,"), "{estimates}");
}

#[test]
fn options_that_state_a_dialect_are_refused_where_there_is_none() {
    let folder = Folder::new("stated");
    for option in [
        &["--separator", "tab"][..],
        &["--decimal", "comma"],
        &["--comment", "!"],
        &["--units-line"],
    ] {
        let scene = [&["train", "press", "-o", "m.bin"], option].concat();
        let refused = folder.fail(&scene, 2);
        assert!(refused.contains(option[0]) && refused.contains("leave it out"), "{refused}");
        folder.write("d.npy", "");
        let array =
            [&["train", "d.npy", "--inputs", "c1", "--outputs", "c2", "-o", "m.bin"], option];
        let refused = folder.fail(&array.concat(), 2);
        assert!(refused.contains(option[0]) && refused.contains("text files"), "{refused}");
    }
    let refused = folder.fail(&["train", "x.csv", "-o", "m.bin", "--separator", "5"], 2);
    assert!(refused.contains("comma, semicolon, tab, space"), "{refused}");
}

#[test]
fn milliseconds_beside_seconds_are_told_and_joined_by_the_factor() {
    let folder = Folder::new("time-factor");
    let log = |name: &str, unit: f64| {
        let line = |i: i32| format!("{},{i}\n", f64::from(i) * unit / 50.0);
        let lines = (0..200).map(line).collect::<Vec<_>>().concat();
        folder.write(name, format!("time,{name}\n{lines}").replace(".csv", ""));
    };
    log("sensor.csv", 1.0);
    log("scale.csv", 1000.0);
    let join =
        ["join", "sensor.csv", "scale.csv", "--on", "time", "--tolerance", "0.01", "-o", "j.csv"];
    let refused = folder.fail(&join, 2);
    assert!(
        refused.contains("--time-factor 0.001 ") && refused.contains("span 3.98 and 3980"),
        "{refused}"
    );
    assert!(!folder.path("j.csv").exists());
    folder.succeed(&[&join[..], &["--time-factor", "0.001"]].concat());
    assert_eq!(std::fs::read_to_string(folder.path("j.csv")).unwrap().lines().count(), 201);
    let refused = folder.fail(&[&join[..], &["--time-factor", "0"]].concat(), 2);
    assert!(refused.contains("--time-factor 0: give a number above 0"), "{refused}");
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
