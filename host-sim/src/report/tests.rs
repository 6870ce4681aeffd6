//! Tests of whole pages, on results made by hand.

use taxel_limit::Refusal;
use taxel_limit::reference::GroupLimit;

use super::html;
use crate::evaluate::table1::{Column, Entry, NETWORK, Printed, Table1};
use crate::metrics::{DecoderErrors, Errors, LimitSummary};
use crate::run::{Example, ExampleOutput, ModelSummary, RowErrors, RunResult, SceneSummary};

const ROW_WIRES: usize = 3;
const PER_ROW: usize = 2;

fn errors(group: &str, rmse: f64) -> Errors {
    Errors {
        group: group.into(),
        unit: taxel_data::columns::unit_of(group).into(),
        count: 10,
        rmse,
        relative_l2_percent: Some(30.0 * rmse),
        full_scale_percent: Some(20.0 * rmse),
        positional_percent: (group == "dz_mm").then_some(10.0 * rmse),
        r_squared: Some(1.0 - rmse),
        mean_relative_percent: None,
        ratio_to_limit: Some(1.0 + rmse),
        ratio_standard_error: Some(0.02),
    }
}

fn of_groups(groups: &[&str], rmse: f64) -> Vec<Errors> {
    groups.iter().map(|group| errors(group, rmse)).collect()
}

fn result(groups: &[&str]) -> RunResult {
    let electrodes = ROW_WIRES * PER_ROW;
    let values = |shift: f64| (0..electrodes).map(|i| 0.1 * i as f64 + shift).collect();
    let entry = |decoder: &str, spread: Option<f64>, rmse: f64| Entry {
        decoder: decoder.into(),
        spread,
        errors: of_groups(groups, rmse),
    };
    let column = |noise_level| Column {
        limit: LimitSummary::of(&Err(Refusal::Drift)),
        noise_level,
        decoders: vec![
            entry("mean", None, 0.3),
            entry("linear", None, 0.25),
            entry(NETWORK, Some(0.5), 0.4),
            entry(NETWORK, Some(1.0), 0.2),
            entry("standard", Some(1.0), 1234.0),
        ],
    };
    RunResult {
        scene: SceneSummary {
            name: "by <hand>".into(),
            digest: "0123".into(),
            seed: 7,
            noise_kind: "relative".into(),
            noise_level: 0.005,
            gain_drift: 0.0,
            size_mm: [20.0, 18.0, 5.0],
            row_wires: 8,
        },
        model: ModelSummary {
            projected_readings: 0,
            training_frames: 1000,
            test_frames: 100,
            networks: ROW_WIRES,
            inputs: 4,
            relative_inputs: false,
            centres: 9,
            outputs: groups.len() * PER_ROW,
            expanded_outputs: 0,
            spread: 0.8,
            refined: true,
            affine_tail: true,
            blob_bytes: 12_345,
            blob_crc: "deadbeef".into(),
            frame: taxel_learn::cost::Cost {
                instructions: 20_000,
                cycles: 34_000,
                flash_cycles: 36_000,
            },
        },
        decoders: [("network", 0.1), ("linear", 0.2), ("mean", 0.3)]
            .map(|(name, rmse)| DecoderErrors {
                decoder: name.into(),
                errors: of_groups(groups, rmse),
            })
            .to_vec(),
        limit: LimitSummary::of(&Err(Refusal::Drift)),
        by_depth: vec![],
        rows: (0..ROW_WIRES)
            .map(|row| RowErrors { row_wire: row + 2, errors: of_groups(groups, 0.1) })
            .collect(),
        example: Example {
            frame: 42,
            electrodes_mm: (0..electrodes)
                .map(|i| [5.0 + 10.0 * (i % PER_ROW) as f64, 3.375 + 2.25 * (i / PER_ROW) as f64])
                .collect(),
            row_wires: ROW_WIRES,
            outputs: groups
                .iter()
                .map(|group| ExampleOutput {
                    group: (*group).into(),
                    unit: taxel_data::columns::unit_of(group).into(),
                    truth: values(0.0),
                    estimate: values(-0.05),
                })
                .collect(),
            reading_row_wire: 3,
            ideal_ohm: vec![50.0, 51.0, 52.0, 53.0],
            noisy_ohm: vec![50.1, 50.9, 52.3, 52.8],
        },
        table1: Some(Table1 {
            centres: 48,
            affine_tail: false,
            training_frames: 600,
            test_frames: 300,
            standard_frames: 50,
            columns: vec![column(0.0), column(0.01), column(0.1)],
            printed: vec![Printed { spread: 0.5, noise_level: 0.01, percent: 6.75 }],
        }),
    }
}

/// Whether every number that places an element in a drawing is finite.
fn is_drawable(page: &str) -> bool {
    !["NaN", "inf\"", "inf ", "-inf"].iter().any(|word| page.contains(word))
}

fn figures(page: &str) -> usize {
    page.matches("<figure id=\"figure-").count()
}

#[test]
fn the_page_is_whole_self_contained_and_always_the_same() {
    let result = result(&["dx_mm", "dy_mm", "dz_mm"]);
    let page = html(&result);
    assert_eq!(page, html(&result));
    assert!(is_drawable(&page));
    assert_eq!((figures(&page), page.matches("<figure id=\"table-").count()), (7, 2));
    assert_eq!(page.matches("<figcaption>").count(), 9);
    for text in
        ["seed 7", "K = 9", "12\u{202f}345 bytes", "deadbeef", "frame 42 (from 0)", "6.5–11.4 %"]
    {
        assert!(page.contains(text), "{text}");
    }
    for outside in ["http", "<script", "src=", "@import", "url(//"] {
        assert!(!page.contains(outside), "{outside}");
    }
    for drawing in page.split("<svg ").skip(1) {
        assert!(drawing.starts_with("role=\"img\"") && drawing.contains("<title>"));
    }
}

#[test]
fn one_chart_for_every_group_of_outputs() {
    for groups in [&["dz_mm"][..], &["dx_mm", "dy_mm", "dz_mm"], &["fx_n", "fz_n"]] {
        let page = html(&result(groups));
        let titled = |end: &str| page.matches(end).count();
        // Every chart appears twice: for wide and for narrow windows.
        assert_eq!(titled("by electrode, true and decoded</title>"), 2 * groups.len());
        assert_eq!(titled("<title>Error of"), 2 * groups.len());
        assert_eq!(titled("by row-wire, at most"), groups.len());
        assert_eq!(titled("<title>Map of"), 3, "one group is mapped");
    }
}

#[test]
fn maps_and_sweeps_show_z_or_else_the_last_group() {
    assert!(html(&result(&["dz_mm", "dx_mm"])).contains("Map of Δz over the face, true"));
    assert!(html(&result(&["fx_n", "fz_n"])).contains("RMSE of Fz (N)"));
    assert!(html(&result(&["dx_mm", "dy_mm"])).contains("Map of Δy over the face, true"));
}

#[test]
fn a_missing_value_is_drawn_nowhere() {
    let mut result = result(&["dz_mm"]);
    let whole = html(&result);
    result.example.outputs[0].estimate[1] = f64::NAN;
    result.example.noisy_ohm[2] = f64::NAN;
    result.rows[0].errors[0].rmse = f64::NAN;
    let page = html(&result);
    assert!(is_drawable(&page));
    let fewer = |mark: &str| whole.matches(mark).count() - page.matches(mark).count();
    // One dot fewer on both layouts, and one dot of the reading.
    assert_eq!(fewer("c1 mark\"/>"), 2 * 3 + 1, "two dots and a bar of noise twice, a bar by row");
    assert_eq!(fewer("c2 mark\"/>"), 2, "its error");
    assert_eq!(page.matches(">×</text>").count(), 2, "its cells, decoded and difference");
}

#[test]
fn a_scene_without_a_sweep_has_a_page_without_it() {
    let mut result = result(&["dz_mm"]);
    result.table1 = None;
    result.rows.truncate(1);
    result.example.electrodes_mm.truncate(PER_ROW);
    result.example.outputs[0].truth.truncate(PER_ROW);
    result.example.outputs[0].estimate.truncate(PER_ROW);
    let page = html(&result);
    assert!(is_drawable(&page));
    assert_eq!((figures(&page), page.matches("<figure id=\"table-").count()), (5, 1));
    assert!(page.contains("electrode of row-wire 2</text>"));
    assert!(!page.contains("Noise and spread"));
}

#[test]
fn the_table_by_spread_marks_cells_that_learnt_nothing() {
    let page = html(&result(&["dz_mm"]));
    let table = page.split("<figure id=\"table-2\"").nth(1).unwrap();
    // 0.2/0.5 is worse than the mean's 0.3, at each of three noise levels; 0.2/1.0 is better.
    assert_eq!(table.matches("class=\"number poor\"").count(), 3);
    assert!(table.contains("4.00\u{a0}%<span class=\"dagger\">†</span>"));
    assert!(table.contains("<small>paper 6.75\u{a0}%</small>"));
    assert!(page.contains(">1234</text>") && page.contains("off the scale"), "standard network");
    assert!(page.contains("has no place on a logarithmic axis"), "no noise");
}

#[test]
fn forces_have_no_positional_error() {
    let page = html(&result(&["fz_n"]));
    let table = page.split("<figure id=\"table-2\"").nth(1).unwrap();
    assert!(table.contains("%FS = mean|e|/full scale"));
    assert!(!table.contains("positional"));
    assert!(page.contains("the force of its electrodes"));
}

#[test]
fn the_limit_is_a_line_where_it_is_known() {
    let mut result = result(&["dz_mm"]);
    assert!(!html(&result).contains("Limit: the least possible"));
    let limit = GroupLimit {
        group: "dz_mm".into(),
        unit: "mm".into(),
        limit: 0.07,
        limit_standard_error: 0.001,
        rmse: 0.08,
        rmse_standard_error: 0.002,
        prior_rmse: 0.3,
        monte_carlo_share: 0.01,
    };
    let summary = LimitSummary { frames: 20, groups: vec![limit], refused: None };
    result.limit = summary.clone();
    for column in &mut result.table1.as_mut().unwrap().columns {
        column.limit = summary.clone();
    }
    let page = html(&result);
    assert!(is_drawable(&page) && page.contains("Limit: the least possible"));
    assert!(page.contains("Least possible</dt><dd>0.0700"));
    assert_eq!(page.matches("truth name\">limit</text>").count(), 2, "wide and narrow");
}

#[test]
fn names_are_escaped() {
    let mut result = result(&["dz_mm"]);
    result.example.outputs[0].group = "<b>\"&".into();
    result.decoders[0].decoder = "<i>".into();
    let page = html(&result);
    assert!(page.contains("by &lt;hand&gt;") && !page.contains("<hand>"));
    assert!(page.contains("&lt;i&gt;") && !page.contains("<i>"));
    assert!(page.contains("&lt;b&gt;&quot;&amp;") && !page.contains("<b>\"&"));
}
