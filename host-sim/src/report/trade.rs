//! Trade between speed and accuracy: three answers, a picture, and the front.

use super::figures::Figure;
use super::format::{UNDEFINED, fixed, grouped, named, noise, symbol};
use super::points::in_bounds;
use super::sections::{Digits, Sections, TableOf};
use taxel_evaluate::metrics;
use taxel_evaluate::trade::{Point, Shown, Trade};

mod words;
mod plot;

/// Sections of a trade, with the model that is `shown`, and with the points of its front or with `all` of them.
pub fn sections(trade: &Trade, shown: Option<&Shown>, all: bool) -> Sections {
    let mut sections = Sections::new(format!("Speed against accuracy: {}", trade.subject));
    sections.files = vec!["trade.csv".into(), "trade.json".into()];
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
    sections.note(format!(
        "{} ways to decode on a Cortex-M4F at {} MHz; {tested}{motion}.",
        trade.points.len(),
        trade.device.clock_mhz
    ));
    answers(&mut sections, trade);
    chosen(&mut sections, trade, shown);
    picture(&mut sections, trade);
    front(&mut sections, trade, all);
    references(&mut sections, trade, shown);
    others(&mut sections, trade, shown);
    trade.left_out.iter().for_each(|note| sections.note(format!("Left out: {note}.")));
    sections
}

/// Rows of points: what marks them, and their indices.
type Marked = (String, usize);

/// Heading of the errors of points.
fn rmse(trade: &Trade) -> String {
    format!("RMSE of {}", symbol(&trade.group))
}

/// Text in which groups of outputs have their symbols.
fn in_symbols(trade: &Trade, text: &str) -> String {
    let results = trade.points.first().map(|point| point.results.keys());
    named(text, results.into_iter().flatten().filter_map(|name| name.strip_prefix("rmse_")))
}

/// Adds the points that a reader looks for first: the chosen one, the most accurate, the knee, and the fastest that is nearly
/// as accurate.
fn answers(sections: &mut Sections, trade: &Trade) {
    let found = [
        ("chosen", trade.chosen),
        ("most accurate", trade.most_accurate()),
        ("knee", trade.knee()),
        ("fastest within 10 %", trade.fastest_within(1.1)),
    ];
    let rows: Vec<Marked> =
        found.into_iter().filter_map(|(answer, point)| Some((answer.into(), point?))).collect();
    let caption = "Points to look at first. Most accurate: the fastest of those whose errors the test frames do not tell from the smallest. Knee: where the front bends most. Within 10 %: of the smallest error. With its option, trade chooses the point and writes its blob.";
    let table = TableOf::new(&rows, caption).names("answer", |(answer, _)| answer.clone()).names(
        "decoder",
        |(_, point)| {
            let point = &trade.points[*point];
            format!("{}, {}", point.way(), words::brief(trade, point))
        },
    );
    let table = table
        .numbers(&rmse(trade), &trade.unit, Digits::Significant(3), |row| {
            Some(trade.points[row.1].rmse(&trade.group))
        })
        .numbers("× limit", "", Digits::Decimals(2), |row| {
            trade.points[row.1].result(&format!("ratio_to_limit_{}", trade.group))
        })
        .texts("frames/s", "", |row| words::rate(trade.points[row.1].times.frames_per_s))
        .numbers("age", "ms", Digits::Decimals(2), |row| trade.points[row.1].times.age_ms)
        .texts("blob", "B", |row| grouped(trade.points[row.1].blob_bytes));
    let table = table.texts("option", "", |(_, point)| {
        format!("--max-error {}", words::above(trade.counted_rmse(*point)))
    });
    sections.table(table);
}

/// Adds what is chosen, what it is worth, and how a device is configured for it; of no choice, why, and what the most accurate
/// point is worth.
fn chosen(sections: &mut Sections, trade: &Trade, shown: Option<&Shown>) {
    let Some(shown) = shown else { return };
    let why = trade.refused.as_deref().unwrap_or(
        "no bound was given (--max-error, --frame-rate, --max-latency-ms, --max-cycles or --max-flash)",
    );
    let (point, verdict) = (shown.point, &shown.verdict);
    let start = match trade.chosen {
        Some(_) => format!("Chosen for {}:", in_bounds(&trade.bounds)),
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
        sections.note(format!("In a scene, below [readout]: column_wires = {columns:?}"));
    }
    let options = words::device_options(trade, &trade.points[point]);
    if !options.is_empty() {
        sections.note(format!("On a device: taxel link PORT configure{options}"));
    }
}

/// What a point costs a device.
fn cost(point: &Point) -> String {
    let ms = |time| fixed(time, 3);
    let times = &point.times;
    let time = match times.scan_ms {
        Some(scan_ms) => format!(
            "An estimate is finished {} ms after the start of its scan ({} ms to scan, {} ms to decode). There are at most {} \
             frames a second. An estimate is {} ms old when it is used, on average",
            ms(times.frame_ms),
            ms(scan_ms),
            ms(times.decode_ms),
            words::rate(times.frames_per_s),
            ms(times.age_ms.unwrap_or_default())
        ),
        None => format!("Decoding a frame takes {} ms, besides its scan", ms(times.decode_ms)),
    };
    format!(
        "{time}; {} cycles, {} bytes of flash, {} bytes of RAM.",
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
    let caption = format!(
        "RMSE of {} against the time of a frame, both logarithmic. The line joins the Pareto front: no other point is as good \
         in both and better in one. Its points have their number of centres K. Lines outside are in the legend alone.{outside}{hidden}",
        symbol(&trade.group)
    );
    let sizes = [[920.0, 540.0], [480.0, 600.0]];
    sections.figure(Figure::of_chart("error-by-time", caption, &chart, sizes));
}

/// Adds points of the front from fast to slow, and the chosen one; or all points, as they were measured.
fn front(sections: &mut Sections, trade: &Trade, all: bool) {
    let mut shown = if all { (0..trade.points.len()).collect() } else { trade.front() };
    shown.extend(trade.chosen.filter(|chosen| !shown.contains(chosen)));
    let mark = |point: usize| match (trade.chosen == Some(point), trade.points[point].on_front) {
        (true, _) => "chosen",
        (false, true) => "front",
        (false, false) => "",
    };
    let rows: Vec<Marked> = shown.into_iter().map(|point| (mark(point).into(), point)).collect();
    let more = trade.points.len() - rows.len();
    let which = if all {
        "All points.".to_owned()
    } else {
        format!(
            "The Pareto front, from fast to slow; {more} more points with --all, and in trade.csv."
        )
    };
    let caption = format!(
        "{which} Array: one network for all rows, behind a projection. Samples: averaged for a reading. Filter: time constant of \
         an α–β filter behind the decoder. Two errors count as equal, and the faster point is on the front, within two standard errors (±, of the same test frames) of \
         their difference, or half a per cent. × limit: to the least possible RMSE with as many samples and the same columns. Worst: \
         largest error on its own and other contacts. Frame: time from the start of a scan to its estimate. Age: mean time from the middle of a scan until its \
         estimate is used. Cycles: of decoding by a Cortex-M4F whose memory never waits, predicted to a tenth (not checked \
         against silicon). {}",
        scan(trade)
    );
    let point = |row: &Marked| &trade.points[row.1];
    let count = |count: Option<usize>| count.map_or(UNDEFINED.into(), |it| it.to_string());
    let averaged = trade.points.iter().any(|point| point.samples_averaged > 1);
    let table = TableOf::new(&rows, caption)
        .names("", |(mark, _)| mark.clone())
        .names("format", |row| point(row).way())
        .names("K", |row| point(row).centres.to_string())
        .names("columns", |row| count(point(row).columns))
        .names("samples", |row| count(averaged.then_some(point(row).samples_averaged)))
        .names("filter", |row| {
            point(row)
                .filter
                .map_or(UNDEFINED.into(), |it| format!("{:.1} ms", it.time_constant_ms))
        });
    let worst = |row: &Marked| point(row).result(&format!("worst_rmse_{}", trade.group));
    let table = table
        .estimates(&rmse(trade), &trade.unit, Digits::Significant(3), |row| {
            point(row).estimate("rmse", &trade.group)
        })
        .estimates("× limit", "", Digits::Decimals(2), |row| {
            point(row).estimate("ratio_to_limit", &trade.group)
        })
        .numbers("worst", &trade.unit, Digits::Significant(3), worst)
        .numbers("frame", "ms", Digits::Decimals(3), |row| Some(point(row).times.frame_ms))
        .numbers("age", "ms", Digits::Decimals(3), |row| point(row).times.age_ms)
        .texts("frames/s", "", |row| words::rate(point(row).times.frames_per_s))
        .texts("cycles", "", |row| grouped(point(row).cycles as usize))
        .texts("blob", "B", |row| grouped(point(row).blob_bytes))
        .texts("RAM", "B", |row| grouped(point(row).ram_bytes));
    sections.table(table);
}

/// Adds errors to compare with, of each choice of readings.
fn references(sections: &mut Sections, trade: &Trade, shown: Option<&Shown>) {
    let mut rows: Vec<(&Point, &str, f64)> = vec![];
    for (place, point) in trade.readings().into_iter().enumerate() {
        // Always predicting the mean is the same whatever is read.
        let references = trade.references(point).into_iter().skip(usize::from(place > 0));
        rows.extend(references.map(|(name, rmse)| (point, name, rmse)));
    }
    let all = if trade.group == metrics::ALL {
        " RMSE of all: mean over the outputs of RMSE/standard deviation σ; always predicting the mean has 1."
    } else {
        ""
    };
    let Some(shown) = shown else { return };
    let of = match trade.distinction(&trade.points[shown.point]) {
        of if of.is_empty() => of,
        of => format!(" With {of}:"),
    };
    let caption =
        format!("Errors to compare with.{all}{of} {}", in_symbols(trade, &shown.limit_note));
    let unknown = || UNDEFINED.to_owned();
    let table = TableOf::new(&rows, caption)
        .names("decoder", |(_, name, _)| (*name).into())
        .names("columns", |(it, ..)| it.columns.map_or_else(unknown, |count| count.to_string()))
        .names("samples", |(it, ..)| it.samples_averaged.to_string())
        .numbers("RMSE", &trade.unit, Digits::Significant(3), |(.., rmse)| Some(*rmse));
    sections.table(table);
}

/// Adds what the chosen point, or the most accurate one, is worth on contacts that it was not trained on.
fn others(sections: &mut Sections, trade: &Trade, shown: Option<&Shown>) {
    let Some(shown) = shown.filter(|shown| !shown.others.is_empty()) else { return };
    let counted = if trade.worst_case {
        "Front and choice count the worst of these and its own."
    } else {
        "--worst-case chooses by the worst."
    };
    let which = if trade.chosen.is_some() { "chosen" } else { "most accurate" };
    let caption =
        format!("The {which} point on still contacts that it was not trained on. {counted}");
    let table = TableOf::new(&shown.others, caption)
        .names("contact", |(name, _)| name.clone())
        .numbers("RMSE", &trade.unit, Digits::Significant(3), |(_, rmse)| Some(*rmse));
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
