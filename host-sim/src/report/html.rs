//! HTML page: its order, its words, and its style.

use std::fmt::{Display, Write as _};

use super::face::Face;
use super::figures::{Figure, Figures, Page, link};
use super::format::{grouped, significant, symbol, unbroken};
use super::svg::escape;
use super::view::View;
use super::{errors, frames, moving, over_time, sketch, sweep, tables};
use taxel_evaluate::by_load::LoadErrors;
use taxel_learn::decoders::centroid;

/// Body of a page, which numbers its figures and tables, and lists its headings.
#[derive(Default)]
struct Body {
    html: String,
    headings: Vec<(&'static str, &'static str)>,
    figures: Figures,
    tables: usize,
}

impl Body {
    fn add(&mut self, html: impl Display) {
        // Writing to a string cannot fail.
        let _ = write!(self.html, "{html}");
    }

    fn heading(&mut self, id: &'static str, text: &'static str) {
        self.headings.push((id, text));
        self.add(format_args!("<h2 id=\"{id}\">{}</h2>\n", escape(text)));
    }

    fn figure(&mut self, figure: &Figure) {
        self.html += &self.figures.html(figure);
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

/// Whole page of a model, whose `figures` are to be numbered.
pub fn page(view: &View<'_>, figures: Figures) -> Page {
    let mut body = Body { figures, ..Body::default() };
    let face = Face::of_electrodes(view.distribution, view.sensor);
    error_section(&mut body, view, face.as_ref());
    if let Some(log) = view.over_time {
        body.heading("time", "Over time");
        body.figure(&over_time::errors(log));
        if let Some(rest) = &log.rest {
            body.figure(&over_time::at_rest(log, rest));
        }
    }
    if let Some(moving) = view.moving {
        body.heading("moving", "Contacts that move");
        body.table(
            &format!(
                "Errors as a robot meets them, on {}: the newest finished estimate against the truth at that moment, every ms, \
                 read by the board. Age: mean time from the middle of a scan until its estimate is used.",
                escape(&moving.path.in_words())
            ),
            &moving::table(moving),
            "",
        );
        body.figure(&moving::trajectory(moving));
    }
    frame_section(&mut body, view, face.as_ref());
    if let Some(sensor) = view.sensor {
        body.heading("sensor", "The sensor");
        body.figure(&sketch::figure(sensor));
    }
    if let (Some(table), Some(group)) = (view.table1, view.distribution.main_group()) {
        body.heading("noise", "Noise");
        body.figure(&sweep::error_by_noise(table, &group.group, &group.unit));
        if let Some(nearest) = table.nearest_formula() {
            body.add("<details>\n<summary>Beside Table 1 of the paper</summary>\n");
            let caption = tables::table1_caption(table, nearest);
            body.table(&caption, &tables::table1(nearest), "");
            body.add("</details>\n");
        }
    }
    body.heading("made", "How this was made");
    body.html += &made(view);
    let top = header(view) + &contents(&body.headings);
    let html = document(&format!("Taxel: {}", view.title), &(top + &body.html));
    Page { html, figures: body.figures.files }
}

fn error_section(body: &mut Body, view: &View<'_>, face: Option<&Face>) {
    body.heading("errors", "Errors");
    body.table(
        &format!(
            "Errors on {} frames, by output and decoder. No definition stands alone: they differ by more than the \
             decoders do.",
            grouped(view.frames)
        ),
        &tables::errors(view.decoders),
        &format!(
            "{}<p class=\"note\">{}</p>\n",
            tables::legend(view.decoders),
            escape(&named(view, &view.limit.note()))
        ),
    );
    body.figure(&errors::density(view));
    body.figure(&errors::histogram(view));
    if let Some(face) = face {
        body.figure(&errors::by_electrode(view, face));
    }
    if let Some(LoadErrors { load, .. }) = view.by_load.first() {
        let caption = format!("RMSE of the model by the true {}.", symbol(load));
        body.table(&caption, &tables::by_load(view.by_load), "");
    }
    if let Some(others) = view.others {
        let caption = format!(
            "RMSE and R² on contacts that the model was not trained on, {} frames each; mean: RMSE of always predicting the \
             mean of training{}.",
            grouped(others.frames),
            if tables::knows_novel(others) {
                "; novel: share of the frames that a confidence notices"
            } else {
                ""
            }
        );
        body.table(&caption, &tables::others(others, view.decoders), "");
    }
}

fn frame_section(body: &mut Body, view: &View<'_>, face: Option<&Face>) {
    if view.distribution.frames.is_empty() {
        return;
    }
    body.heading("frames", "Single frames");
    if let Some(readings) = frames::readings(view) {
        body.figure(&readings);
    }
    if let Some(face) = face {
        if let Some(maps) = frames::maps(view, face) {
            body.figure(&maps);
        }
        if let Some(arrows) = frames::arrows(view, face) {
            body.figure(&arrows);
        }
    } else {
        if let Some(places) = frames::places(view) {
            body.figure(&places);
        }
        let caption = "Outputs of these frames, true and decoded; in brackets the number of the frame, from 0.";
        body.table(caption, &tables::frames(view), "");
    }
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

/// Top of the page: the verdict, the cost, and the errors in short.
fn header(view: &View<'_>) -> String {
    let mut html = format!(
        "<header>\n<h1>{}</h1>\n<p class=\"verdict\">{}</p>\n",
        escape(&view.title),
        escape(&named(view, &view.verdict.sentence))
    );
    if !view.verdict.warnings.is_empty() {
        html += "<ul class=\"warnings\">\n";
        for warning in &view.verdict.warnings {
            let _ = writeln!(html, "<li>{}</li>", with_code(&escape(&named(view, &warning.text))));
        }
        html += "</ul>\n";
    }
    html += &cost(view);
    html += &tables::headline(view);
    let limit = if view.limit.groups.is_empty() {
        ""
    } else {
        " Least possible: the limit that no decoder of these readings can pass; × limit: the network’s ratio to it."
    };
    let judged = |name: &str| view.decoders.iter().any(|decoder| decoder.decoder == name);
    let centroid = if judged(centroid::NAME) { " Centroid: that of the touch." } else { "" };
    let linear = if judged("linear") {
        " Linear: the best linear decoder, which shows how much needs no network."
    } else if view.linear_at_training.is_empty() {
        ""
    } else {
        " Linear in training: the best linear decoder, on frames of training that it was not fitted to."
    };
    let _ = writeln!(
        html,
        "<p class=\"note\">Root mean square errors on {} frames. Mean: always predicting the mean, which ignores the \
         readings: a decoder that is no better has learnt nothing.{linear}{centroid}{limit}</p>\n</header>",
        grouped(view.frames)
    );
    html
}

/// Sentence in which groups of outputs have their symbols.
fn named(view: &View<'_>, sentence: &str) -> String {
    let groups = view.distribution.groups.iter();
    unbroken(
        &groups.fold(sentence.to_owned(), |text, group| {
            text.replace(&group.group, &symbol(&group.group))
        }),
    )
}

/// HTML in which commands between backticks are code.
fn with_code(html: &str) -> String {
    let parts = html.split('`').enumerate();
    parts
        .map(|(i, part)| if i % 2 == 0 { part.into() } else { format!("<code>{part}</code>") })
        .collect()
}

/// What decoding costs a device.
fn cost(view: &View<'_>) -> String {
    let device = view.device;
    let weights = if device.weights_in_ram { device.blob_bytes } else { 0 };
    let ram = grouped(device.ram_bytes + weights);
    let of_ram = match weights {
        0 => "weights stay in flash".to_owned(),
        bytes => format!("{} of them weights", grouped(bytes)),
    };
    let fits = if device.fits_slot { "fits" } else { "does not fit" };
    format!(
        "<dl>\n<div><dt>Decoding a frame</dt><dd>{}\u{a0}<span>µs</span></dd><dd class=\"small\">{} cycles \
         at 180\u{a0}MHz, without waiting</dd></div>\n\
         <div><dt>RAM</dt><dd>{ram}\u{a0}<span>B</span></dd><dd class=\"small\">{of_ram}</dd></div>\n\
         <div><dt>Blob</dt><dd>{}\u{a0}<span>B</span></dd><dd class=\"small\">{fits} a slot of {}\u{a0}B</dd></div>\n</dl>\n",
        significant(device.us, 3),
        grouped(device.cycles as usize),
        grouped(device.blob_bytes),
        grouped(device.slot_bytes)
    )
}

fn contents(headings: &[(&str, &str)]) -> String {
    let links = headings.iter().map(|(id, text)| format!("<a href=\"#{id}\">{}</a>", escape(text)));
    format!("<nav aria-label=\"Contents\">{}</nav>\n", links.collect::<Vec<_>>().join(" "))
}

/// Command, files and facts.
fn made(view: &View<'_>) -> String {
    let mut html = String::new();
    if !view.made.command.is_empty() {
        let _ = writeln!(html, "<pre><code>{}</code></pre>", escape(&view.made.command));
    }
    html += "<dl class=\"facts\">\n";
    for (name, value) in &view.facts {
        let _ = writeln!(html, "<div><dt>{name}</dt><dd>{}</dd></div>", escape(value));
    }
    if !view.made.files.is_empty() {
        let links: Vec<String> = view.made.files.iter().map(|file| link(file, file)).collect();
        let _ = writeln!(html, "<div><dt>Files</dt><dd>{}</dd></div>", links.join(", "));
    }
    let version = env!("CARGO_PKG_VERSION");
    let _ = writeln!(html, "<div><dt>Program</dt><dd>host-sim {version}</dd></div>\n</dl>");
    html + "<p class=\"note\">Cycles and RAM are those of a Cortex-M4F as docs/cycles.md predicts them.</p>\n"
}
