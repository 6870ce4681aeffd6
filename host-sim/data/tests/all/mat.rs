//! Names of the cells of mats.

use taxel_data::columns;
use taxel_data::mat::{cell_names, whole_wires};

fn header(names: impl IntoIterator<Item = String>) -> Vec<String> {
    let outputs = ["x_mm", "force_N"].map(String::from);
    ["time_s".to_owned()].into_iter().chain(names).chain(outputs).collect()
}

fn named(header: &[String], pattern: &str, given: Option<&str>) -> Result<Vec<String>, String> {
    let given = given.map(|text| text.parse().unwrap());
    cell_names(header, &columns::select(header, pattern), given).map(|(names, _)| names)
}

#[test]
fn numbered_columns_that_fill_a_square_are_cells_row_by_row() {
    let header = header((0..256).map(|cell| format!("adc_{cell}")));
    let names = named(&header, "adc_*", None).unwrap();
    assert_eq!((names[0].as_str(), names[16].as_str()), ("r1c1_adc_0", "r2c1_adc_16"));
    assert_eq!(names[255], "r16c16_adc_255");
    // Dead cells, the first and the last among them, move no other.
    let names = named(&header, "adc_1..adc_36,adc_38..adc_254", None).unwrap();
    assert_eq!((names[0].as_str(), names[36].as_str()), ("r1c2_adc_1", "r3c7_adc_38"));
}

#[test]
fn other_columns_keep_their_names_unless_a_grid_is_given() {
    let header = header((1..=64).map(|cell| format!("ch{cell}")));
    let plain = |pattern| named(&header, pattern, None).unwrap()[0].clone();
    assert_eq!((plain("ch*"), plain("ch1..ch12")), ("r1c1_ch1".into(), "ch1".into()));
    assert_eq!(plain("ch*,time_s"), "time_s");
    assert_eq!(named(&header, "ch*", Some("none")).unwrap()[0], "ch1");
    let names = named(&header, "ch*", Some("4x16")).unwrap();
    assert_eq!((names[15].as_str(), names[16].as_str()), ("r1c16_ch16", "r2c1_ch17"));
    let refused = named(&header, "ch*", Some("4x17")).unwrap_err();
    assert!(refused.contains("--grid 4x17 has 68 cells, and 64 columns are inputs"), "{refused}");
    assert_eq!(named(&header, "time_s,x_mm", Some("1x2")).unwrap()[1], "r1c2_x_mm");
}

#[test]
fn columns_named_after_their_wires_are_cells_from_one() {
    let names = |names: &[&str]| {
        let header = header(names.iter().map(ToString::to_string));
        named(&header, "r*", None).unwrap()
    };
    assert_eq!(names(&["r1c1_ohm", "r1c2_ohm"]), ["r1c1_ohm", "r1c2_ohm"]);
    assert_eq!(names(&["r0c0", "r0c1"]), ["r1c1_r0c0", "r1c2_r0c1"]);
    assert_eq!(names(&["r1c1_adc", "r2c7_adc"]), ["r1c1_adc", "r2c7_adc"]);
    let of_grid = |names: [&str; 2], grid| {
        named(&header(names.map(String::from)), "r*", Some(grid))
            .map_err(|why| why[..22].to_owned())
    };
    assert_eq!(of_grid(["r1c1_adc", "r2c7_adc"], "2x7").unwrap()[1], "r2c7_adc");
    assert_eq!(of_grid(["r1c1_adc", "r2c7_adc"], "7x2"), Err("--grid 7x2: r2c7_adc n".into()));
    assert_eq!(of_grid(["r1c1_adc", "r2c7_adc"], "none"), Err("--grid none: r1c1_adc ".into()));
    assert_eq!(of_grid(["r0c1", "r0c0"], "1x2").unwrap()[0], "r1c2_r0c1");
    assert_eq!(of_grid(["r0c1", "r0c0"], "none").unwrap()[0], "r0c1");
}

#[test]
fn a_wire_is_named_if_all_its_readings_are_faulty() {
    let names: Vec<String> =
        (1..=3).flat_map(|m| (1..=3).map(move |k| format!("r{m}c{k}_a"))).collect();
    let faulty = [&names[3..6], &names[..1]].concat();
    assert_eq!(whole_wires(&names, &faulty), ["row-wire 2"]);
}
