//! Report of a trade between speed and accuracy: a picture, and a page.

use std::fmt::Write as _;

use super::figures::{Figure, Figures, Page};
use super::format::{fixed, grouped, noise, significant, symbol, unbroken};
use super::html::document;
use super::svg::escape;
use taxel_evaluate::evaluate::trade::Trade;

mod words;
mod plot;
mod table;

/// Page of a trade, with the `command` that computed it.
pub fn html(trade: &Trade, command: &str) -> Page {
    let title = format!("Taxel: speed against accuracy, {}", trade.subject);
    let tested = match &trade.test_choice {
        Some(choice) => format!("{} measured test frames ({choice})", grouped(trade.test_frames)),
        None => format!(
            "Noise {} a sample; {} test frames",
            trade.noise_kind.map_or(String::new(), |kind| noise(kind, trade.noise_level)),
            grouped(trade.test_frames)
        ),
    };
    let tested = match &trade.motion {
        Some(path) => format!(
            "{tested}; errors are those of the newest finished estimate on {}",
            path.in_words()
        ),
        None => tested,
    };
    let mut body = format!(
        "<header>\n<h1>{}</h1>\n<p>{}; {} ways to decode on a Cortex-M4F at {}\u{a0}MHz.</p>\n</header>\n",
        escape(&title),
        escape(&unbroken(&tested)),
        trade.points.len(),
        trade.device.clock_mhz,
    );
    body += &answer(trade);
    let (chart, outside) = plot::chart(trade);
    let outside = match outside {
        0 => String::new(),
        1 => " One dominated point lies outside.".into(),
        outside => format!(" {outside} dominated points lie outside."),
    };
    let networks = if trade.points.iter().any(|point| !point.each_row) {
        " Rows: a network for each row-wire; array: one for all of them."
    } else {
        ""
    };
    let caption = format!(
        "RMSE of {} against the time of a frame, both logarithmic. The line joins the Pareto front: no other point is as good \
         in both and better in one. Its points have their number of centres K. Lines outside are in the legend alone.{networks}{outside}{}",
        symbol(&trade.group),
        hidden_bounds(trade)
    );
    let mut figures = Figures::in_files("");
    let figure =
        Figure::of_chart("error-by-time", caption, &chart, [[920.0, 540.0], [480.0, 600.0]]);
    body += &figures.html(&figure);
    let _ = write!(
        body,
        "<figure id=\"table-1\" class=\"table\">\n<figcaption><b>Table 1.</b> The Pareto front, from fast to slow. \
         <a href=\"trade.csv\">trade.csv</a> has all {} points and all outputs.</figcaption>\n{}<p class=\"note\">{}</p>\n\
         <p class=\"note\">Cycles are those of decoding by a Cortex-M4F whose memory never waits, predicted to a tenth \
         (not checked against silicon). {}</p>\n</figure>\n\
         <p class=\"note\">Made by <code>{}</code></p>\n",
        grouped(trade.points.len()),
        table::of_front(trade),
        escape(&named(trade, &references(trade))),
        unbroken(&scan(trade)),
        escape(command),
    );
    Page { html: document(&title, &body), figures: figures.files }
}

/// What was chosen, what it is worth and what it costs.
fn answer(trade: &Trade) -> String {
    let Some(chosen) = trade.chosen else {
        let why = trade.refused.as_ref().map_or("no bound was given".into(), ToString::to_string);
        let why = format!("Nothing is chosen: {why}.");
        return format!(
            "<section class=\"summary\">\n<p>{}</p>\n</section>\n",
            escape(&unbroken(&why))
        );
    };
    let point = &trade.points[chosen];
    let verdict = trade.verdict_on(chosen);
    let times = &point.times;
    let mut html = format!(
        "<section class=\"summary\">\n<p><b>Chosen for {}: {}.</b> {}</p>\n<dl>\n",
        escape(&unbroken(&words::bounds(&trade.bounds))),
        escape(&unbroken(&point.name())),
        escape(&named(trade, &verdict.sentence))
    );
    let mut fact = |name: &str, value: String, unit: &str| {
        let (name, unit) = (escape(name), escape(unit));
        let _ =
            writeln!(html, "<div><dt>{name}</dt><dd>{value}\u{a0}<span>{unit}</span></dd></div>");
    };
    let rmse = significant(point.rmse(&trade.group), 3);
    fact(&format!("RMSE of {}", symbol(&trade.group)), rmse, &trade.unit);
    if let Some(scan_ms) = times.scan_ms {
        fact("Frames a second, at most", words::rate(times.frames_per_s), "");
        fact("Scan", fixed(scan_ms, 2), "ms");
    }
    if let Some(age_ms) = times.age_ms {
        fact("Age when used", significant(age_ms, 3), "ms");
    }
    fact("Decoding", significant(1000.0 * times.decode_ms, 3), "µs");
    fact("Blob", significant(point.blob_bytes as f64 / 1000.0, 3), "kB");
    html += "</dl>\n";
    let warnings = verdict.warnings.iter().map(ToString::to_string);
    for note in std::iter::once(trade.line_note()).chain(warnings) {
        let _ = writeln!(html, "<p class=\"note\">{}</p>", escape(&named(trade, &note)));
    }
    html + "</section>\n"
}

/// Sentence in which the outputs have their symbol, and no number is parted from its unit.
fn named(trade: &Trade, sentence: &str) -> String {
    let name = |text: String, (group, _): (&str, _)| text.replace(group, &symbol(group));
    unbroken(&trade.groups().fold(sentence.to_owned(), name))
}

/// Errors to compare with, and what they are of if readings differ.
fn references(trade: &Trade) -> String {
    let others = trade.readings.iter().filter(|_| trade.readings.len() > 1).map(|readings| {
        let all = readings.references(&trade.group).skip(1);
        let all = all.map(|(name, rmse)| format!("{name} {}", words::error(trade, rmse)));
        format!(" With {}: {}.", trade.distinction(readings), all.collect::<Vec<_>>().join(", "))
    });
    let main = trade.main_readings();
    match trade.distinction(main) {
        of if of.is_empty() => main.limit.note(),
        of => format!("With {of}: {}{}", main.limit.note(), others.collect::<String>()),
    }
}

/// Bounds that the picture cannot show.
fn hidden_bounds(trade: &Trade) -> String {
    let bounds = taxel_evaluate::evaluate::trade::Bounds {
        cycles: trade.bounds.cycles,
        blob_bytes: trade.bounds.blob_bytes,
        ..Default::default()
    };
    if bounds.any() {
        format!(" Not drawn: the bounds of {}.", words::bounds(&bounds))
    } else {
        String::new()
    }
}

/// Where the time of a scan comes from.
fn scan(trade: &Trade) -> String {
    match (trade.device.scan_ms, trade.main_readings().wires) {
        (Some(ms), _) => {
            format!("The time of a scan was given: {ms} ms for each sample of a reading.")
        }
        (None, Some(wires)) => format!(
            "The time of a scan is computed from the board’s firmware for {} rows, within 3 % of the emulated board.",
            wires.rows
        ),
        (None, None) => "The time of a scan is unknown.".into(),
    }
}
