//! Tests of whole pages, on results made by hand.

use taxel_limit::Refusal;
use taxel_simulate::noise::NoiseKind;

use taxel_data::table::Table as Values;

use super::{Made, View};
use taxel_evaluate::evaluate::device_cost::DeviceCost;
use taxel_evaluate::evaluate::distribution::{Distribution, Reference};
use taxel_evaluate::evaluate::table1::{Column, Entry, NETWORK, Table1};
use taxel_evaluate::metrics::{DecoderErrors, Errors, LimitSummary};
use taxel_evaluate::run::{
    ModelSummary, RowErrors, RowWire, RunResult, SceneSummary, SensorSketch,
};
use taxel_evaluate::verdict::{Verdict, Warning};

fn made() -> Made {
    let files = ["model.bin", "metrics.json"].map(String::from).to_vec();
    Made { command: "host-sim run 'by <hand>.toml' --seed 7".into(), files }
}

fn html(result: &RunResult) -> String {
    super::html(result, &made()).html
}

const ROW_WIRES: usize = 3;
const PER_ROW: usize = 2;
const ELECTRODES: usize = ROW_WIRES * PER_ROW;

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

/// Outputs of so many `frames`, and readings of two column-wires: row-wires 2 to 4, of five.
fn tables(groups: &[&str], frames: usize) -> [Values; 3] {
    let rows = 2..2 + ROW_WIRES;
    let electrodes = rows.clone().flat_map(|row| (1..=PER_ROW).map(move |e| (row, e)));
    let names = electrodes.flat_map(|(row, electrode)| {
        groups.iter().map(move |group| format!("r{row}e{electrode}_{group}"))
    });
    let names: Vec<String> = names.collect();
    let truth: Vec<f64> =
        (0..frames * names.len()).map(|i| 0.1 * (i % 7) as f64 + 0.001 * (i % 3) as f64).collect();
    // Frame n is off by n·0.01 everywhere.
    let off = |(i, truth): (usize, &f64)| truth + 0.01 * (i / names.len()) as f64;
    let estimate = truth.iter().enumerate().map(off).collect();
    let readings: Vec<String> =
        rows.flat_map(|row| (1..=2).map(move |k| format!("r{row}c{k}_ohm"))).collect();
    let ohm = (0..frames * readings.len()).map(|i| 50.0 - 0.1 * (i % 11) as f64).collect();
    [
        Values { names: names.clone(), values: truth },
        Values { names, values: estimate },
        Values { names: readings, values: ohm },
    ]
}

fn distribution(groups: &[&str]) -> Distribution {
    let [truth, estimate, readings] = tables(groups, 20);
    Distribution::new(&truth, &estimate, &readings, Reference::Rest(&[50.0; 2 * ROW_WIRES]))
}

fn sensor() -> SensorSketch {
    let row = |row: usize| RowWire {
        read: (1..=ROW_WIRES).contains(&row),
        electrodes_mm: (0..PER_ROW)
            .map(|i| [5.0 + 10.0 * i as f64, 2.0 + 3.5 * row as f64])
            .collect(),
    };
    SensorSketch {
        face_mm: [20.0, 18.0],
        row_wires: (0..5).map(row).collect(),
        column_numbers: vec![1, 2],
        column_wires_mm: vec![vec![[5.0, 4.0], [5.0, 14.0]], vec![[15.0, 4.0], [15.0, 14.0]]],
    }
}

fn result(groups: &[&str]) -> RunResult {
    let distribution = distribution(groups);
    let entry = |decoder: &str, spread: Option<f64>, rmse: f64| Entry {
        decoder: decoder.into(),
        spread,
        errors: of_groups(groups, rmse),
        largest_positional_percent: None,
    };
    let column = |noise_level| Column {
        limit: LimitSummary::new(&Err(Refusal::Drift)),
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
        moving: None,
        subject: "by <hand>".into(),
        scene_digest: "0123".into(),
        seed: 7,
        data: None,
        scene: Some(SceneSummary {
            noise_kind: NoiseKind::Relative,
            noise_level: 0.005,
            gain_drift: 0.0,
            size_mm: [20.0, 18.0, 5.0],
            row_wires: 5,
            sensor: Some(sensor()),
            ideal_changes: distribution.frames.iter().map(|frame| frame.change.clone()).collect(),
        }),
        device_cost: DeviceCost {
            cycles: 34_000,
            us: 200.0,
            ram_bytes: 2000,
            weights_in_ram: true,
            blob_bytes: 12_345,
            slot_bytes: 131_072,
            fits_slot: true,
        },
        verdict: Verdict {
            sentence: "It is a <good> model of dz_mm.".into(),
            warnings: vec![Warning { name: "few-frames", text: "Few frames for dz_mm.".into() }],
        },
        model: ModelSummary {
            projected_readings: 0,
            training_frames: 1000,
            test_frames: 100,
            networks: ROW_WIRES,
            inputs_per_network: 4,
            relative_inputs: false,
            centres: 9,
            outputs_per_network: groups.len() * PER_ROW,
            spread: 0.8,
            refined: true,
            blob_bytes: 12_345,
            model_crc: "deadbeef".into(),
            frame_cost: taxel_learn::cost::Cost { instructions: 20_000, cycles: 34_000 },
        },
        decoders: [("network", 0.1), ("linear", 0.2), ("mean", 0.3)]
            .map(|(name, rmse)| DecoderErrors {
                decoder: name.into(),
                errors: of_groups(groups, rmse),
            })
            .to_vec(),
        limit: LimitSummary::new(&Err(Refusal::Drift)),
        by_depth: vec![],
        others: None,
        by_row: (0..ROW_WIRES)
            .map(|row| RowErrors { row_wire: row + 2, errors: of_groups(groups, 0.1) })
            .collect(),
        distribution,
        table1: Some(Table1 {
            centres: 48,
            noise_kind: NoiseKind::Relative,
            training_frames: 600,
            test_frames: 300,
            standard_frames: 50,
            solver: "rls",
            columns: vec![column(0.0), column(0.01), column(0.1)],
            printed: vec![],
            comparison: vec![],
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
    // Density, histogram, by electrode; readings, frames, arrows; sensor; noise and spread.
    assert_eq!((figures(&page), page.matches("<figure id=\"table-").count()), (9, 1));
    for text in [
        "seed 7",
        "K = 9",
        "12\u{202f}345 bytes",
        "deadbeef",
        "number 9 (from 0)",
        "It is a &lt;good&gt; model of Δz.",
        "<li>Few frames for Δz.</li>",
        "200\u{a0}<span>µs</span>",
        "14\u{202f}345\u{a0}<span>B</span>",
        "fits a slot of 131\u{202f}072\u{a0}B",
        "host-sim run &#39;by &lt;hand&gt;.toml&#39; --seed 7",
        "<a href=\"model.bin\">model.bin</a>",
        env!("CARGO_PKG_VERSION"),
    ] {
        assert!(page.contains(text), "{text}");
    }
    for outside in ["http", "<script", "src=", "@import", "url(//"] {
        assert!(!page.contains(outside), "{outside}");
    }
    for drawing in page.split("<svg ").skip(1) {
        assert!(drawing.starts_with("role=\"img\"") && drawing.contains("<title>"));
    }
    for link in page.split("<nav").nth(1).unwrap().split("href=\"#").skip(1) {
        let id = link.split('"').next().unwrap();
        assert!(page.contains(&format!("<h2 id=\"{id}\">")), "{id}");
    }
}

#[test]
fn every_figure_is_a_picture_and_a_table_of_its_values() {
    let result = result(&["dx_mm", "dy_mm", "dz_mm"]);
    let page = super::html(&result, &made());
    let links =
        page.html.split("href=\"figures/").skip(1).map(|rest| rest.split('"').next().unwrap());
    let links: Vec<String> = links.map(|name| format!("figures/{name}")).collect();
    let files: Vec<String> = page.figures.iter().map(|(path, _)| path.clone()).collect();
    assert_eq!((links, files.len()), (files.clone(), 2 * figures(&page.html)));
    let text = |name: &str| {
        let path = format!("figures/{name}");
        page.figures.iter().find(|(known, _)| *known == path).unwrap().1.clone()
    };
    for (path, text) in &page.figures {
        if text.starts_with("<svg") {
            assert!(is_drawable(text) && text.matches("<svg").count() == 1, "{path}");
            assert!(
                path.contains(".svg")
                    && text.starts_with("<svg xmlns")
                    && text.ends_with("</svg>\n"),
                "{path}"
            );
        } else {
            let columns = |line: &str| line.matches(',').count() - line.matches(", ").count();
            let all = columns(text.lines().next().unwrap());
            assert!(all > 1 && text.lines().all(|line| columns(line) == all), "{path}: {text}");
        }
    }
    let csv = text("errors-by-electrode.csv");
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("panel,row-wire,electrode,x (mm),y (mm),value,unit"));
    assert_eq!(lines.count(), 3 * ELECTRODES);
    let rmse = &result.distribution.outputs[2].rmse;
    assert!(csv.contains(&format!("RMSE of Δz,2,1,5,5.5,{rmse},mm\n")), "{csv}");
    let csv = text("frames.csv");
    assert_eq!(csv.lines().count(), 1 + 12 * 3 * ELECTRODES);
    let csv = text("error-by-noise.csv");
    assert!(
        csv.starts_with("series,noise level p,RMSE of Δz (mm)\n")
            && csv.contains("network,0.01,0.2\n"),
        "{csv}"
    );
}

#[test]
fn a_missing_value_is_drawn_nowhere() {
    let mut result = result(&["dz_mm"]);
    let whole = html(&result);
    result.distribution.steps[5].estimate[1] = f64::NAN;
    result.distribution.frames[0].change[2] = f64::NAN;
    result.distribution.outputs[0].rmse = f64::NAN;
    let page = html(&result);
    assert!(is_drawable(&page));
    let count = |page: &str| page.matches("cell-of-map").count();
    let styles = 1;
    assert_eq!(count(&whole) - styles, 12 * 3 * ELECTRODES + ELECTRODES + 6 * 6);
    assert_eq!(count(&whole) - count(&page), 2 + 1 + 1, "decoded, difference, reading, RMSE");
    assert_eq!(page.matches(": missing ").count(), 4);
}

/// View of outputs and readings of a file, without a scene.
fn view<'a>(distribution: &'a Distribution, result: &'a RunResult, made: &'a Made) -> View<'a> {
    View {
        distribution,
        sensor: None,
        ideal_changes: &[],
        noise: None,
        table1: None,
        ..View::of_run(result, made)
    }
}

#[test]
fn outputs_of_no_electrode_have_a_table_and_places_are_drawn() {
    let [_, _, readings] = tables(&["dz_mm"], 4);
    let result = result(&["dz_mm"]);
    let of = |names: &[&str], readings: &Values| {
        let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        let truth: Vec<f64> = (0..4 * names.len()).map(|i| (i * i % 17) as f64).collect();
        let estimate = truth.iter().enumerate().map(|(i, truth)| truth + i as f64).collect();
        let [truth, estimate] =
            [truth, estimate].map(|values| Values { names: names.clone(), values });
        let distribution = Distribution::new(&truth, &estimate, readings, Reference::Median);
        super::view_html(&view(&distribution, &result, &made()))
    };
    let page = of(&["contact_x_mm", "contact_y_mm", "contact_depth_mm"], &readings);
    assert!(is_drawable(&page));
    assert_eq!(
        page.matches("<title>Place in the").count(),
        2,
        "of four frames, the worst is at 95 %, too"
    );
    assert!(page.contains("relative to the median") && page.contains("decoded: "));
    assert!(page.contains("<th scope=\"row\">contact depth (mm)</th>"), "unit once");
    let channels = Values { names: vec!["ch1".into()], ..readings };
    let channels = Values { values: channels.values[..4].to_vec(), ..channels };
    let page = of(&["fx_n", "fz_n"], &channels);
    assert!(is_drawable(&page) && !page.contains("Place in the"));
    assert!(page.contains("in its standard deviations") && page.contains(">ch1</text>"));
    assert_eq!(page.matches("<title>Map of").count(), 0);
}
#[test]
fn names_are_escaped() {
    let mut result = result(&["dz_mm"]);
    result.distribution.groups[0].group = "<b>\"&".into();
    result.distribution.readings.names[0] = "<b>\"&".into();
    result.decoders[0].decoder = "<i>".into();
    let page = html(&result);
    assert!(page.contains("by &lt;hand&gt;") && !page.contains("<hand>"));
    assert!(page.contains("&lt;i&gt;") && !page.contains("<i>"));
    assert!(page.contains("&lt;b&gt;&quot;&amp;") && !page.contains("<b>\"&"));
}
