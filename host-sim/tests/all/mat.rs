//! Mats in CSV files: cells are named after their wires, and every command agrees on the image that a model needs.

use std::fmt::Write as _;

use crate::common::Folder;

/// Log of a mat of so many rows and columns, a press a line, of which one cell is dead and one column-wire is broken.
fn log([rows, columns]: [usize; 2], lines: usize) -> String {
    let cells = rows * columns;
    let names: Vec<String> = (0..cells).map(|cell| format!("adc_{cell}")).collect();
    let mut csv = format!("{},x_mm,y_mm,force_n\n", names.join(","));
    for line in 0..lines {
        let at = |step: usize, most: usize| (line * step % 97) as f64 / 97.0 * (most - 1) as f64;
        let (x, y, force) = (at(31, columns), at(57, rows), 1.0 + (line * 13 % 89) as f64 / 10.0);
        for cell in 0..cells {
            let (m, k) = ((cell / columns) as f64, (cell % columns) as f64);
            let near = f64::exp(-((m - y).powi(2) + (k - x).powi(2)) / 4.0);
            let noise = (line * 7 + cell * 3) % 5;
            let counts = 400.0 + (cell % 50) as f64 + 30.0 * force * near + noise as f64;
            let counts = if cell == 5 || cell % columns == 2 { 0.0 } else { counts.round() };
            let _ = write!(csv, "{counts},");
        }
        let _ = writeln!(csv, "{x:.3},{y:.3},{force:.3}");
    }
    csv
}

const TRAIN: [&str; 9] = [
    "train",
    "mat.csv",
    "--inputs",
    "adc_*",
    "--outputs",
    "x_mm,y_mm,force_n",
    "--no-refine",
    "-o",
    "m.bin",
];

#[test]
fn a_mat_of_numbered_columns_is_named_by_wires_and_has_an_image() {
    let folder = Folder::new("mat");
    folder.write("mat.csv", log([16, 16], 200));
    let output = folder.run(&[&TRAIN[..], &["--centres", "8"]].concat());
    let notes = String::from_utf8(output.stderr).unwrap();
    assert!(notes.contains("note: column-wire 3: none of its readings can be used"), "{notes}");
    let told = String::from_utf8(output.stdout).unwrap();
    // Whether the model is for a device, nobody has said.
    assert!(told.contains("network") && !told.contains("TAXEL_CAPACITY"), "{told}");
    let inspected = folder.succeed(&["inspect", "m.bin"]);
    for words in [
        "r1c1_adc_0 … r16c16_adc_255 (239)",
        "TAXEL_CAPACITY=16x16x18",
        "measures Ω",
        "16 × 16 wires",
    ] {
        assert!(inspected.contains(words), "{words}: {inspected}");
    }
    // The file calls its columns otherwise, and counts are not judged as Ω.
    let judged = folder.succeed(&["eval", "m.bin", "mat.csv", "--html", "eval.html"]);
    assert!(judged.contains("decodes"), "{judged}");
    let page = folder.read("eval.html");
    assert!(
        page.contains("row-wire 16, column-wire 16") && page.contains("column-wire 3: missing"),
        "{page}"
    );
    assert!(
        page.contains("× marks a reading that is missing or left out.")
            && !page.contains("href=\"figures")
    );
}

/// Statistics of readings are calibrated on folds that are held out, by models with the features that were chosen.
#[test]
fn a_trade_calibrates_its_model_as_run_does() {
    let folder = Folder::new("mat_calibrated");
    folder.write("mat.csv", log([6, 6], 600));
    let of = |command: &str| {
        let words = format!(
            "{command} mat.csv --inputs adc_* --outputs x_mm,y_mm,force_n --no-refine --centres 8 \
             --format f32 --reading-model full -o {command}"
        );
        let more = if command == "trade" { " --average 1 --max-cycles 100000000" } else { "" };
        folder.succeed(&(words + more).split_whitespace().collect::<Vec<_>>())
    };
    ["run", "trade"].iter().for_each(|command| drop(of(command)));
    let blob = |name: &str| std::fs::read(folder.path(name)).unwrap();
    assert!(blob("run/mat/model.bin") == blob("trade/mat/chosen.bin"));
}
