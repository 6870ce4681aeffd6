//! Trade between speed and accuracy: three answers, a picture, and the front.

use super::figures::Figure;
use super::format::{UNDEFINED, fixed, grouped, named, noise, significant, symbol, with_unit};
use super::points::EQUAL_ERRORS;
use super::quantity::in_bounds;
use super::sections::{Card, Digits, Fact, Section, Sections, TableOf, number_value};
use taxel_evaluate::metrics;
use taxel_evaluate::trade::{Point, Shown, Trade};

mod words;
mod plot;

/// What a trade is shown with.
#[derive(Debug, Clone, Copy)]
pub struct With<'s> {
    /// Model of the chosen point, or of the most accurate one.
    pub shown: Option<&'s Shown>,
    /// Whether all points are shown, and not only those of the front.
    pub all: bool,
    /// What a user types for these points, without a bound.
    pub command: &'s str,
}

/// Digits of errors, and of their ratios to the limit.
const RMSE: Digits = Digits::Significant(3);
const RATIO: Digits = Digits::Decimals(2);

/// Sections of a trade.
pub fn sections(trade: &Trade, with: With<'_>) -> Sections {
    let mut sections = Sections::new(format!("Speed against accuracy: {}", trade.subject));
    sections.files = vec!["trade.csv".into(), "trade.json".into()];
    values(&mut sections, trade);
    sections.sections.push(Section::Cards(answers(trade, with.command)));
    let tested = match &trade.test_choice {
        Some(choice) => format!("{} measured test frames ({choice})", grouped(trade.test_frames)),
        None => format!(
            "noise {} a sample, {} test frames",
            trade.noise_kind.map_or(String::new(), |kind| noise(kind, trade.noise_level)),
            grouped(trade.test_frames)
        ),
    };
    let motion = trade.motion.as_ref().map_or(String::new(), |path| {
        let path = path.in_words();
        format!("; errors are those of the newest finished estimate, every ms, on {path}")
    });
    let knee = trade.knee().map_or("", |_| " Knee: where the front bends most.");
    sections.note(format!(
        "Of {} ways to decode on a Cortex-M4F at {} MHz; {tested}{motion}. Most accurate: the fastest of those whose errors count \
         as equal to the smallest.{knee} Age: mean time from the middle of a scan until its estimate is \
         used. {EQUAL_ERRORS}",
        trade.points.len(),
        trade.device.clock_mhz
    ));
    chosen(&mut sections, trade, with.shown);
    picture(&mut sections, trade);
    front(&mut sections, trade, with.all);
    references(&mut sections, trade, with.shown);
    others(&mut sections, trade, with.shown);
    trade.left_out.iter().for_each(|note| sections.note(format!("Left out: {note}.")));
    sections
}

/// Adds what programs read.
fn values(sections: &mut Sections, trade: &Trade) {
    sections.value("subject", &trade.subject);
    sections.value("seed", &trade.seed);
    sections.value("noise_kind", &trade.noise_kind);
    sections.value("noise_level", &trade.noise_level);
    sections.value("training_frames", &trade.training_frames);
    sections.value("test_frames", &trade.test_frames);
    sections.value("test_choice", &trade.test_choice);
    sections.value("motion", &trade.motion);
    sections.value("outliers", &trade.outliers);
    sections.value("device", &trade.device);
    let mut line = Sections::default();
    line.value("baud", &trade.line.baud);
    line.value("estimate_bytes", &trade.line.estimate_bytes);
    line.value("estimates_per_s", &trade.line.estimates_per_s);
    sections.object("line", &line);
    sections.value("group", &trade.group);
    sections.value("unit", &trade.unit);
    sections.value("worst_case", &trade.worst_case);
    let points = TableOf::new(&trade.points, "All points.");
    let mut table = points.values("id", |it| it.id.as_str().into());
    for field in &trade.merged.fields {
        table = table.values(field, |it| it.values.get(field).cloned().unwrap_or_default());
    }
    for name in &trade.merged.columns {
        table = table.values(name, |it| number_value(it.result(name)));
    }
    sections.rows("points", table.values("on_front", |it| it.on_front.into()));
    sections.value("left_out", &trade.left_out);
    sections.value("bounds", &trade.bounds);
    sections.value("most_accurate", &trade.most_accurate());
    sections.value("knee", &trade.knee());
    sections.value("fastest_within_10_percent", &trade.fastest_within(1.1));
    sections.value("chosen", &trade.chosen);
}

/// Name of the error that front and choice count.
fn counted_rmse(trade: &Trade) -> String {
    let error = if trade.worst_case { "worst RMSE" } else { "RMSE" };
    format!("{error} of {}", symbol(&trade.group))
}

/// Text in which groups of outputs have their symbols.
fn in_symbols(trade: &Trade, text: &str) -> String {
    let results = trade.points.first().map(|point| point.results.keys());
    named(text, results.into_iter().flatten().filter_map(|name| name.strip_prefix("rmse_")))
}

/// The points that a reader looks for first, and what to type for each with a `command` for all of them.
fn answers(trade: &Trade, command: &str) -> Vec<Card> {
    let found = [
        ("most accurate", trade.most_accurate()),
        ("knee", trade.knee()),
        ("fastest within 10 % of the smallest error", trade.fastest_within(1.1)),
        ("chosen", trade.chosen),
    ];
    let mut answers: Vec<(usize, Vec<&str>)> = vec![];
    for (title, point) in found.into_iter().filter_map(|(title, point)| Some((title, point?))) {
        match answers.iter_mut().find(|(known, _)| *known == point) {
            Some((_, titles)) => titles.push(title),
            None => answers.push((point, vec![title])),
        }
    }
    answers
        .into_iter()
        .map(|(point, titles)| card(trade, point, titles.join(", "), command))
        .collect()
}

fn card(trade: &Trade, place: usize, title: String, command: &str) -> Card {
    let point = &trade.points[place];
    let fact = |label: &str, value: String, unit: &str| Fact {
        label: label.into(),
        value,
        unit: unit.into(),
    };
    let rmse = RMSE.text(Some(trade.counted_rmse(place)));
    let mut facts = vec![fact(&counted_rmse(trade), rmse, &trade.unit)];
    if trade.worst_case {
        let own = RMSE.text(Some(point.rmse(&trade.group)));
        facts.push(fact("own contacts", own, &trade.unit));
    }
    let ratio = point.result(&format!("ratio_to_limit_{}", trade.group));
    facts.extend(ratio.map(|it| fact("× least possible", RATIO.text(Some(it)), "")));
    let rate = if point.times.scan_ms.is_some() { "speed" } else { "speed, decoding alone" };
    facts.push(fact(rate, Digits::Count.text(Some(point.times.frames_per_s)), "frames/s"));
    facts.push(fact("flash", grouped(point.blob_bytes), "B"));
    facts.extend(point.times.age_ms.map(|ms| fact("age", significant(ms, 3), "ms")));
    // A model that a baseline beats is not chosen.
    let command = match trade.better_baseline(place) {
        None => format!("{command} --max-error {}", words::above(trade.counted_rmse(place))),
        Some(_) => String::new(),
    };
    Card { title, name: point.name(), facts, command }
}

/// Adds what is chosen, what it is worth, and how a device is configured for it; of no choice, why, and what the most accurate
/// point is worth.
fn chosen(sections: &mut Sections, trade: &Trade, shown: Option<&Shown>) {
    let Some(shown) = shown else { return };
    sections.heading(if trade.chosen.is_some() { "What is chosen" } else { "The most accurate" });
    let why = trade.refused.as_deref().unwrap_or(
        "no bound was given (--max-error, --frame-rate, --max-latency-ms, --max-cycles or --max-flash)",
    );
    let (point, verdict) = (shown.point, &shown.verdict);
    let start = match trade.chosen {
        Some(_) => format!("Chosen with {}:", in_bounds(&trade.bounds)),
        None => format!("Nothing is chosen: {why}. The most accurate is"),
    };
    let name = trade.points[point].name();
    if let Some((decoder, least)) = trade.better_baseline(point) {
        let least = words::error(trade, least);
        sections.note(format!(
            "{start} no model; the baseline {decoder} has a smaller error, {least}."
        ));
        return;
    }
    sections.note(format!("{start} {name}. {}", in_symbols(trade, &verdict.sentence)));
    sections.note(cost(&trade.points[point]));
    sections.note(trade.line_note());
    verdict
        .warnings
        .iter()
        .for_each(|warning| sections.note(in_symbols(trade, &warning.to_string())));
    if trade.chosen.is_none() {
        return;
    }
    if let Some(columns) = &shown.column_wires {
        sections.note(format!("In a scene, below [readout]: `column_wires = {columns:?}`"));
    }
    let options = words::device_options(trade, &trade.points[point]);
    if !options.is_empty() {
        sections.note(format!("On a device: `taxel link PORT configure{options}`"));
    }
}

/// What a point costs a device.
fn cost(point: &Point) -> String {
    let ms = |time| fixed(time, 3);
    let times = &point.times;
    let time = match times.scan_ms {
        Some(scan_ms) => format!(
            "An estimate is finished {} ms after the start of its scan ({} ms to scan, {} ms to decode, the rest to \
             turn samples into Ω and to wait for it). There are at most {} \
             frames a second. An estimate is {} ms old when it is used, on average",
            ms(times.frame_ms),
            ms(scan_ms),
            ms(times.decode_ms),
            Digits::Count.text(Some(times.frames_per_s)),
            ms(times.age_ms.unwrap_or_default())
        ),
        None => format!("Decoding a frame takes {} ms, besides its scan", ms(times.decode_ms)),
    };
    format!(
        "{time}; {} cycles, {} bytes of flash, {} bytes of RAM for decoding (weights not counted).",
        grouped(point.cycles as usize),
        grouped(point.blob_bytes),
        grouped(point.ram_bytes)
    )
}

fn picture(sections: &mut Sections, trade: &Trade) {
    let (chart, outside) = plot::chart(trade);
    let outside = match outside {
        0 => String::new(),
        1 => " One dominated point lies outside.".into(),
        outside => format!(" {outside} dominated points lie outside."),
    };
    let mut hidden = trade.bounds.clone();
    hidden.retain(|name, _| ["cycles", "blob_bytes"].contains(&name.as_str()));
    let hidden = if hidden.is_empty() {
        String::new()
    } else {
        format!(" Not drawn: {}.", in_bounds(&hidden))
    };
    let worst = if trade.worst_case {
        " Worst: the largest error on the scene's own contacts and on those that it was not trained on, by which front and \
         choice are made."
    } else {
        ""
    };
    let caption = format!(
        "{} against the time of a frame, both logarithmic.{worst} The line joins the Pareto front: no other point is as good \
         in both and better in one. Its points have their number of centres K. Lines outside are in the legend alone.{outside}{hidden}",
        words::capital(&counted_rmse(trade))
    );
    let sizes = [[920.0, 540.0], [480.0, 600.0]];
    sections.figure(Figure::of_chart("error-by-time", caption, &chart, sizes));
}

/// Row of a table of points: what marks it, and the point.
type Marked<'t> = (&'static str, &'t Point);

/// Adds points of the front from fast to slow, and the chosen one; or all points, as they were measured.
fn front(sections: &mut Sections, trade: &Trade, all: bool) {
    sections.heading(if all { "All points" } else { "The front" });
    let mut shown = if all { (0..trade.points.len()).collect() } else { trade.front() };
    shown.extend(trade.chosen.filter(|chosen| !shown.contains(chosen)));
    let mark = |point: usize| match (trade.chosen == Some(point), trade.points[point].on_front) {
        (true, _) => "chosen",
        (false, true) if all => "front",
        _ => "",
    };
    let rows: Vec<Marked<'_>> =
        shown.into_iter().map(|point| (mark(point), &trade.points[point])).collect();
    let more = trade.points.len() - rows.len();
    let which = if all {
        "All points".to_owned()
    } else {
        format!(
            "The Pareto front, from fast to slow; {more} more points with --all, and in trade.csv"
        )
    };
    let group = &trade.group;
    let worst = |row: &Marked<'_>| row.1.result(&format!("worst_rmse_{group}"));
    let of_worst = if rows.iter().any(|row| worst(row).is_some()) {
        " Worst: largest RMSE on its own and other contacts."
    } else {
        ""
    };
    let in_no_time = trade.motion.map_or("", |_| ", computed in no time");
    let caption = format!(
        "{which}. Array: one network for all rows, behind a projection. Samples: averaged for a reading. RMSE: ± its standard \
         error. × limit: to the least possible RMSE with as many samples and the same columns{in_no_time}.{of_worst}"
    );
    let keys = |name: &str| [format!("{name}_{group}"), format!("{name}_standard_error_{group}")];
    let ([rmse, rmse_error], [ratio, ratio_error]) = (keys("rmse"), keys("ratio_to_limit"));
    let heading = format!("RMSE of {}", symbol(group));
    let table = ways(TableOf::new(&rows, caption), trade)
        .estimates([&rmse, &rmse_error], &heading, &trade.unit, RMSE, |row| {
            row.1.estimate("rmse", group)
        })
        .estimates([&ratio, &ratio_error], "× limit", "", RATIO, |row| {
            row.1.estimate("ratio_to_limit", group)
        })
        .numbers(&format!("worst_rmse_{group}"), "worst", &trade.unit, RMSE, worst)
        .numbers("frames_per_s", "frames/s", "", Digits::Count, |row| {
            Some(row.1.times.frames_per_s)
        })
        .numbers("age_ms", "age", "ms", Digits::Decimals(2), |row| row.1.times.age_ms);
    sections.table(table);
    let filter = if rows.iter().any(|row| row.1.filter.is_some()) {
        " Filter: time constant of an α–β filter behind the decoder."
    } else {
        ""
    };
    let caption = format!(
        "What these points cost. Frame: time from the start of a scan to its estimate.{filter} Cycles: of decoding by a Cortex-M4F \
         whose memory never waits, predicted to a tenth (not checked against silicon). Flash: of the blob. RAM: for decoding; \
         weights are not counted. {}",
        scan(trade)
    );
    let table = ways(TableOf::new(&rows, caption), trade)
        .numbers("scan_ms", "scan", "ms", Digits::Decimals(3), |row| row.1.times.scan_ms)
        .numbers("frame_ms", "frame", "ms", Digits::Decimals(3), |row| Some(row.1.times.frame_ms))
        .numbers("cycles", "cycles", "", Digits::Count, |row| Some(row.1.cycles as f64))
        .numbers("blob_bytes", "flash", "B", Digits::Count, |row| Some(row.1.blob_bytes as f64))
        .numbers("ram_bytes", "RAM", "B", Digits::Count, |row| Some(row.1.ram_bytes as f64));
    sections.table(table);
}

/// Adds columns that say which points rows are.
fn ways<'r>(table: TableOf<'r, Marked<'r>>, trade: &Trade) -> TableOf<'r, Marked<'r>> {
    let count = |count: Option<usize>| count.map_or(UNDEFINED.into(), |it| it.to_string());
    let averaged = trade.points.iter().any(|point| point.samples_averaged > 1);
    table
        .names("mark", "", |(mark, _)| (*mark).into())
        .names("format", "format", |row| row.1.way())
        .names("centres", "K", |row| row.1.centres.to_string())
        .names("columns", "columns", |row| count(row.1.columns))
        .names("samples", "samples", move |row| count(averaged.then_some(row.1.samples_averaged)))
        .names("filter", "filter", |row| {
            let ms = row.1.filter.map(|it| it.time_constant_ms);
            let of_tracker = if row.1.is_tracked { "tracked" } else { UNDEFINED };
            ms.map_or(of_tracker.into(), |ms| format!("{ms:.1} ms"))
        })
}

/// Adds errors to compare with, of each choice of readings.
fn references(sections: &mut Sections, trade: &Trade, shown: Option<&Shown>) {
    let all = if trade.group == metrics::ALL {
        " RMSE of all: mean over the outputs of RMSE/standard deviation σ; always predicting the mean has 1."
    } else {
        ""
    };
    let Some(shown) = shown else { return };
    sections.heading("What to compare with");
    let of = match trade.distinction(&trade.points[shown.point]) {
        of if of.is_empty() => of,
        of => format!(" With {of}:"),
    };
    let caption = format!(
        "{} of other decoders, and the least possible, by what is read.{all}{of} {}",
        with_unit("RMSE", &trade.unit),
        in_symbols(trade, &shown.limit_note)
    );
    let rows = trade.readings();
    let unknown = || UNDEFINED.to_owned();
    let mut table = TableOf::new(&rows, caption)
        .names("columns", "columns", |it| it.columns.map_or_else(unknown, |it| it.to_string()))
        .names("samples", "samples", |it| it.samples_averaged.to_string());
    let names = rows.iter().flat_map(|point| trade.references(point)).map(|(name, _)| name);
    let mut seen = std::collections::BTreeSet::new();
    for name in names.filter(|name| seen.insert(*name)) {
        let of = |point: &&Point| trade.references(point).into_iter().find(|it| it.0 == name);
        let key = name.replace(' ', "_");
        table = table.numbers(&key, name, "", RMSE, |point| Some(of(point)?.1));
    }
    sections.table(table);
}

/// Adds what the chosen point, or the most accurate one, is worth on contacts that it was not trained on.
fn others(sections: &mut Sections, trade: &Trade, shown: Option<&Shown>) {
    let Some(shown) = shown.filter(|shown| !shown.others.is_empty()) else { return };
    let counted = if trade.worst_case {
        "Front and choice count the worst of these and its own."
    } else {
        "--worst-case chooses by the worst error."
    };
    let which = if trade.chosen.is_some() { "chosen" } else { "most accurate" };
    let caption = format!(
        "RMSE of {} of the {which} point on still contacts that it was not trained on. {counted}",
        symbol(&trade.group)
    );
    let key = format!("rmse_{}", trade.group);
    let table = TableOf::new(&shown.others, caption)
        .names("contact", "contact", |(name, _)| name.clone())
        .numbers(&key, "RMSE", &trade.unit, RMSE, |(_, rmse)| Some(*rmse));
    sections.table(table);
}

/// Where the time of a scan comes from.
fn scan(trade: &Trade) -> String {
    match (trade.device.scan_ms, trade.points[0].wires()) {
        (Some(ms), _) => {
            format!("The time of a scan was given: {ms} ms for each sample of a reading.")
        }
        (None, Some(wires)) => format!(
            "The time of a scan is computed from the board's firmware for {} × {} wires, within 3 % of the emulated board.",
            wires.rows, wires.columns
        ),
        (None, None) => {
            "The time of a scan is unknown (--scan-ms): frame is that of decoding alone.".into()
        }
    }
}
