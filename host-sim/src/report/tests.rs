//! Tests of whole pages, on the results of a small run.

use std::sync::OnceLock;

use taxel_data::Silent;
use taxel_data::table::Table as Values;
use taxel_evaluate::evaluate::distribution::{Distribution, Reference};
use taxel_evaluate::experiment::Experiment;
use taxel_evaluate::run::{RunResult, run};
use taxel_evaluate::subject::Subject;
use taxel_evaluate::table1::{Column, Entry, NETWORK, Table1};
use taxel_evaluate::verdict::{Verdict, Warning};

use super::{Judged, Page, Pictures, Sections};

fn page(result: &RunResult) -> Page {
    let mut sections = super::of_run(result);
    sections.files = ["model.bin", "metrics.json"].map(String::from).to_vec();
    sections.page("taxel run 'by <hand>.toml' --seed 7")
}

fn html(result: &RunResult) -> String {
    page(result).html
}

/// Electrodes of the three row-wires that are read.
const ELECTRODES: usize = 18;

/// Result of a small run, with a hand-made table 1 and texts that need escaping.
fn result() -> RunResult {
    static RUN: OnceLock<RunResult> = OnceLock::new();
    let run = RUN.get_or_init(|| {
        let mut scene = Experiment::load("press").unwrap();
        scene.world.read_rows = vec![1, 2, 3];
        (scene.frames, scene.test_frames) = (600, 20);
        (scene.training.options.centres, scene.training.refine) = (9, false);
        let options = scene.options();
        run(&Subject::Scene(scene.into()), &options, None, &Silent).unwrap().0
    });
    let mut result = run.clone();
    let entry = |decoder: &str, spread: Option<f64>, rmse: f64| {
        let mut errors = result.decoders[0].errors.clone();
        errors.iter_mut().for_each(|errors| errors.rmse = rmse);
        Entry { decoder: decoder.into(), spread, errors, largest_positional_percent: None }
    };
    let column = |noise_level| Column {
        limit: result.limit.clone(),
        noise_level,
        decoders: vec![
            entry("mean", None, 0.3),
            entry("linear", None, 0.25),
            entry(NETWORK, Some(0.5), 0.4),
            entry(NETWORK, Some(1.0), 0.2),
            entry("standard", Some(1.0), 1234.0),
        ],
    };
    let columns = [0.0, 0.01, 0.1].map(column).to_vec();
    result.table1 = Some(Table1 {
        centres: 48,
        noise_kind: result.scene.as_ref().unwrap().noise_kind,
        training_frames: 600,
        test_frames: 300,
        standard_frames: 50,
        solver: "rls",
        columns,
        comparison: vec![],
    });
    result.subject = "by <hand>".into();
    (result.seed, result.model.model_crc, result.model.blob_bytes) = (7, "deadbeef".into(), 12_345);
    let cost = &mut result.device_cost;
    (cost.us, cost.ram_bytes, cost.blob_bytes, cost.weights_in_ram) = (200.0, 2000, 12_345, true);
    result.verdict = Verdict {
        sentence: "It is a <good> model of dz_mm.".into(),
        warnings: vec![Warning { name: "few-frames", text: "Few frames for dz_mm.".into() }],
    };
    result
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
    let result = result();
    let page = html(&result);
    assert_eq!(page, html(&result));
    assert!(is_drawable(&page));
    // Frames; density, histogram; by electrode; readings, arrows, sensor; noise. Errors, by row-wire, other contacts.
    assert_eq!((figures(&page), page.matches("<figure id=\"table-").count()), (8, 3));
    for text in [
        "seed 7",
        "K = 9",
        "12\u{202f}345\u{a0}bytes",
        "deadbeef",
        &format!("number {} (from 0)", result.distribution.frames[0].frame),
        "It is a &lt;good&gt; model of Δz.",
        "<li>Few frames for Δz. (few-frames)</li>",
        "200\u{a0}<span>µs</span>",
        "2\u{202f}000\u{a0}bytes; the images copy the weights",
        "fits a slot of 131\u{202f}072\u{a0}bytes",
        "taxel run &#39;by &lt;hand&gt;.toml&#39; --seed 7",
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
    let result = result();
    let page = page(&result);
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
    assert!(csv.contains(&format!("RMSE of Δz,2,1,1.6666666666666667,3.375,{rmse},mm\n")), "{csv}");
    let csv = text("frames.csv");
    assert_eq!(csv.lines().count(), 1 + 12 * 3 * ELECTRODES);
    let values = csv.lines().skip(1).map(|line| line.rsplit(',').nth(1).unwrap().parse().unwrap());
    let values: Vec<f64> = values.step_by(ELECTRODES).take(3).collect();
    assert_eq!(values[2], values[1] - values[0], "decoded − true");
    let csv = text("error-by-noise.csv");
    assert!(
        csv.starts_with("series,noise level p,RMSE of Δz (mm)\n")
            && csv.contains("network,0.01,0.2\n"),
        "{csv}"
    );
}

#[test]
fn a_missing_value_is_drawn_nowhere() {
    let mut result = result();
    let whole = html(&result);
    result.distribution.steps[5].estimate[2] = f64::NAN;
    result.distribution.frames[0].change[2] = f64::NAN;
    result.distribution.outputs[0].rmse = f64::NAN;
    let page = html(&result);
    assert!(is_drawable(&page));
    let count = |page: &str| page.matches("cell-of-map").count();
    let styles = 1;
    let readings = 3 * 18;
    assert_eq!(count(&whole) - styles, 12 * 3 * ELECTRODES + 3 * ELECTRODES + 3 * readings);
    assert_eq!(count(&whole) - count(&page), 2 + 1 + 1, "decoded, difference, reading, RMSE");
    assert_eq!(page.matches(": missing ").count(), 4);
}

#[test]
fn outputs_of_no_electrode_have_a_table_and_places_are_drawn() {
    let names = ["r2c1_ohm", "r2c2_ohm", "r3c1_ohm", "r3c2_ohm"].map(String::from).to_vec();
    let readings = Values { names, values: (0..16).map(|i| 50.0 - 0.1 * f64::from(i)).collect() };
    let result = result();
    let of = |names: &[&str], readings: &Values| {
        let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        let truth: Vec<f64> = (0..4 * names.len()).map(|i| (i * i % 17) as f64).collect();
        let estimate = truth.iter().enumerate().map(|(i, truth)| truth + i as f64).collect();
        let [truth, estimate] =
            [truth, estimate].map(|values| Values { names: names.clone(), values: values.into() });
        let distribution = Distribution::new(&truth, &estimate, readings, Reference::Median);
        let pictures = Some(Pictures { distribution: &distribution, frames: 4, sensor: None });
        let judged = Judged { pictures, table1: None, ..super::run::of_run(&result) };
        super::of_judged(&judged, Sections::default()).page("").html
    };
    let page = of(&["contact_x_mm", "contact_y_mm", "contact_depth_mm"], &readings);
    assert!(is_drawable(&page));
    assert_eq!(
        page.matches("<title>Place in the").count(),
        2,
        "of four frames, the worst is at 95 %, too"
    );
    assert!(page.contains("relative to the median") && page.contains("decoded: "));
    assert!(page.contains("<td>contact depth (mm)</td>"), "unit once");
    let channels = Values { names: vec!["ch1".into()], ..readings };
    let channels = Values { values: channels.values[..4].to_vec().into(), ..channels };
    let page = of(&["fx_n", "fz_n"], &channels);
    assert!(is_drawable(&page) && !page.contains("Place in the"));
    assert!(page.contains("in its standard deviations") && page.contains(">ch1</text>"));
    assert_eq!(page.matches("<title>Map of").count(), 0);
}

#[test]
fn names_are_escaped() {
    let mut result = result();
    result.distribution.groups[0].group = "<b>\"&".into();
    result.distribution.readings.names[0] = "<b>\"&".into();
    result.decoders[0].decoder = "<i>".into();
    let page = html(&result);
    assert!(page.contains("by &lt;hand&gt;") && !page.contains("<hand>"));
    assert!(page.contains("&lt;i&gt;") && !page.contains("<i>"));
    assert!(page.contains("&lt;b&gt;&quot;&amp;") && !page.contains("<b>\"&"));
}

#[test]
fn rows_are_named_by_numbers_where_programs_read_them() {
    let json: serde_json::Value = serde_json::from_str(&super::of_run(&result()).json()).unwrap();
    let rows = json["by_row"].as_array().unwrap().iter().map(|row| row["row_wire"].as_u64());
    assert_eq!(rows.collect::<Vec<_>>(), [Some(2), Some(3), Some(4)]);
}

#[test]
fn arrows_point_to_the_right_for_x_and_up_for_y() {
    let mut result = result();
    result.distribution.frames[0].truth.fill(1.0);
    let page = html(&result);
    let before = page.split("\" class=\"truth arrow\"").next().unwrap();
    let shaft = before.rsplit("d=\"M").next().unwrap().split([' ', 'L', 'M']);
    let ends: Vec<f64> = shaft.take(4).map(|place| place.parse().unwrap()).collect();
    assert!(ends[2] > ends[0] && ends[3] < ends[1], "{ends:?}");
}
