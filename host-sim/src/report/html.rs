//! HTML page: its order, its words, and its style.

use std::fmt::{Display, Write as _};

use super::figures::{self, Figure};
use super::format::{grouped, percent, quantity, significant, symbol};
use super::svg::escape;
use super::tables;
use crate::run::RunResult;

/// Body of a page, which numbers its figures and tables.
#[derive(Default)]
struct Body {
    html: String,
    figures: usize,
    tables: usize,
}

impl Body {
    fn add(&mut self, html: impl Display) {
        // Writing to a string cannot fail.
        let _ = write!(self.html, "{html}");
    }

    fn heading(&mut self, text: &str) {
        self.add(format_args!("<h2>{}</h2>\n", escape(text)));
    }

    fn figure(&mut self, figure: &Figure) {
        self.figures += 1;
        let (number, caption) = (self.figures, escape(&figure.caption));
        self.add(format_args!(
            "<figure id=\"figure-{number}\">\n{}<figcaption><b>Figure {number}.</b> {caption}\
             </figcaption>\n</figure>\n",
            figure.drawing
        ));
    }

    /// Adds a numbered table; `caption` is HTML.
    fn table(&mut self, caption: &str, table: &str, legend: &str) {
        self.tables += 1;
        let number = self.tables;
        self.add(format_args!(
            "<figure id=\"table-{number}\" class=\"table\">\n<figcaption><b>Table {number}.</b> \
             {caption}</figcaption>\n<div class=\"scroll\" tabindex=\"0\" role=\"region\" \
             aria-label=\"Table {number}\">\n{table}</div>\n{legend}</figure>\n"
        ));
    }
}

/// Whole page of a run.
pub fn page(result: &RunResult) -> String {
    let mut body = Body::default();
    body.html += &header(result);
    body.html += &summary(result);

    body.heading("Errors");
    body.table(
        &format!(
            "Errors on {} test frames, by output and decoder. No definition stands alone: they \
             differ by more than the decoders do.",
            grouped(result.model.test_frames)
        ),
        &tables::errors(result),
        &format!("{}<p class=\"note\">{}</p>\n", tables::legend(), escape(&result.limit.note())),
    );

    body.heading("One test frame");
    body.figure(&figures::readings(result));
    let of_electrodes = !result.rows.is_empty();
    let shown = figures::shown(&result.example);
    if of_electrodes {
        body.figure(&figures::by_electrode(result));
        body.figure(&figures::error_by_electrode(result));
        if let Some(output) = shown {
            body.figure(&figures::maps(result, output));
        }
    } else {
        let caption = format!("Outputs of {}, true and decoded.", figures::chosen(result));
        body.table(&caption, &tables::example(result), "");
    }
    if let (Some(table), Some(output)) = (&result.table1, shown) {
        body.heading("Noise and spread");
        body.figure(&figures::error_by_noise(table, &output.group, &output.unit));
        body.figure(&figures::error_by_spread(table, &output.group, &output.unit));
        let caption = tables::table1_caption(table, &output.group);
        body.table(&caption, &tables::table1(table, &output.group), "");
    }
    if !result.by_depth.is_empty() {
        body.heading("By depth");
        let caption = "RMSE of the network by the true depth of the contact. The last line holds all frames that \
                       are not shallow.";
        body.table(caption, &tables::by_depth(result), "");
    }
    if of_electrodes {
        body.heading("By row-wire");
        body.figure(&figures::by_row_wire(result));
    }

    document(&format!("Taxel: {}", result.scene.name), &body.html)
}

/// Page with this title around `body`, which is HTML: no script, no file beside it.
pub fn document(title: &str, body: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en-GB\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>{}</title>\n\
         <style>\n{}</style>\n</head>\n<body>\n<main>\n{body}</main>\n</body>\n</html>\n",
        escape(title),
        include_str!("style.css")
    )
}

fn header(result: &RunResult) -> String {
    let (scene, model) = (&result.scene, &result.model);
    let tail = if model.affine_tail { "affine tail" } else { "no affine tail" };
    let readings = if model.relative_inputs { "relative readings" } else { "readings" };
    let inputs = match model.projected_readings {
        0 => format!("{} {readings}", model.inputs),
        count => format!("{count} {readings} → {} features", model.inputs),
    };
    let outputs = match model.expanded_outputs {
        0 => format!("{} outputs", model.outputs),
        all => format!("{} components → {all} outputs", model.outputs),
    };
    let drift = match scene.gain_drift {
        0.0 => String::new(),
        gain => format!(" · gain drift ±{}", percent(gain)),
    };
    let refined = if model.refined { " (refined)" } else { "" };
    let plural = if model.networks == 1 { "" } else { "s" };
    format!(
        "<header>\n<h1>Scene “{}”</h1>\n\
         <p>{} noise of {}{} · seed {} · {} training and {} test frames · scene digest {}</p>\n\
         <p>{} network{plural}: {inputs} → K = {} → {outputs} · spread {}{refined} · {tail} · \
         {} bytes · CRC-32 {}</p>\n\
         <p>A frame on a Cortex-M4F: {} cycles at zero wait, {} from flash (by the price list in docs/cycles.md)</p>\n</header>\n",
        escape(&scene.name),
        escape(&scene.noise_kind),
        percent(scene.noise_level),
        drift,
        scene.seed,
        grouped(model.training_frames),
        grouped(model.test_frames),
        escape(&scene.digest),
        model.networks,
        model.centres,
        model.spread,
        grouped(model.blob_bytes),
        escape(&model.blob_crc),
        grouped(model.frame.cycles as usize),
        grouped(model.frame.flash_cycles as usize)
    )
}

/// Headline: one output, every decoder.
fn summary(result: &RunResult) -> String {
    let Some(output) = figures::shown(&result.example) else { return String::new() };
    let (group, unit) = (&output.group, &output.unit);
    let name = escape(&symbol(group));
    let mut html = format!(
        "<section class=\"summary\">\n<p>A network decodes the sensor’s row–column resistances to \
         {}. RMSE of {name} over {} test frames:</p>\n<dl>\n",
        if result.rows.is_empty() {
            "few numbers of the whole array".to_owned()
        } else {
            format!("the {} of its electrodes", quantity(group))
        },
        grouped(result.model.test_frames)
    );
    for decoder in &result.decoders {
        let _ = writeln!(
            html,
            "<div><dt>{}</dt><dd>{} <span>{}</span></dd></div>",
            escape(tables::decoder_name(decoder)),
            significant(tables::rmse(&decoder.errors, group), 3),
            escape(unit)
        );
    }
    if let Some(limit) = result.limit.groups.iter().find(|limit| limit.group == *group) {
        let _ = writeln!(
            html,
            "<div><dt>Least possible</dt><dd>{} <span>{}</span></dd></div>",
            significant(limit.limit, 3),
            escape(unit)
        );
    }
    html + "</dl>\n<p>The training mean ignores the readings: a decoder has learnt nothing unless \
            it is better. The best linear decoder shows how much needs no network.</p>\n</section>\n"
}
