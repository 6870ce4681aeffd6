//! What the command prints: the front, and the choice in words.

use std::path::Path;

use crate::evaluate::trade::{Point, Trade, Wires};
use crate::metrics;
use crate::verdict::Verdict;

use super::others;
use crate::commands::print::{Page, wrapped};

/// Page of the front, or of `all` points; the last lines say what was chosen and what to open.
pub fn of(trade: &Trade, all: bool, folder: &Path) -> Page {
    let mut page = Page::default();
    let tested = if let Some(choice) = &trade.test_choice {
        format!("{} measured test frames ({choice})", trade.test_frames)
    } else {
        let noise = trade.noise_kind.map_or(String::new(), |kind| kind.in_words(trade.noise_level));
        format!("noise {noise} a sample, {} test frames", trade.test_frames)
    };
    let tested = match &trade.motion {
        Some(path) => format!("{tested}; judged on {}", path.in_words()),
        None => tested,
    };
    page.line(format_args!(
        "{}: {} ways to decode, {tested}; RMSE of {}{}",
        trade.subject,
        trade.points.len(),
        trade.group,
        if trade.unit.is_empty() { String::new() } else { format!(" in {}", trade.unit) }
    ));
    page.line(format_args!(
        "\n  {:<26} {:>3} {:>4} {:>3} {:>4} {:>7} {:>7} {:>6} {:>6} {:>6} {:>6} {:>6} {:>5}",
        "format",
        "K",
        "cols",
        "avg",
        "filt",
        "RMSE",
        "× limit",
        "ms",
        "age ms",
        "Hz",
        "cycles",
        "blob",
        "RAM"
    ));
    let shown = shown(trade, all);
    for i in &shown {
        page.line(line_of(trade, *i));
    }
    for (place, readings) in trade.readings.iter().enumerate() {
        // Always predicting the mean is the same whatever is read.
        for (name, rmse) in readings.references(&trade.group).skip(usize::from(place > 0)) {
            page.line(format_args!(
                "  {name:<30} {:>4} {:>3} {:>12}",
                readings.columns().map_or("-".into(), |columns| columns.to_string()),
                readings.samples_averaged,
                error(rmse)
            ));
        }
    }
    page.line(format_args!("\n{}", legend(trade, all)));
    wrapped(&mut page, &limit_note(trade));
    for note in &trade.left_out {
        wrapped(&mut page, &format!("left out: {note}"));
    }
    if !all && trade.points.len() > shown.len() {
        let more = trade.points.len() - shown.len();
        page.line(format_args!("{more} more points with --all, and in trade.csv"));
    }
    page.line("");
    match trade.chosen {
        Some(chosen) => choice(&mut page, trade, chosen, folder),
        None => no_choice(&mut page, trade),
    }
    others::note(&mut page, trade);
    page.line(format_args!("open {}", folder.join("trade.html").display()));
    page
}

/// The limit that ratios of the chosen point are to.
fn limit_note(trade: &Trade) -> String {
    let readings = trade.main_readings();
    match trade.distinction(readings) {
        of if of.is_empty() => readings.limit.note(),
        of => format!("With {of}: {}", readings.limit.note()),
    }
}

/// Explanation of the columns.
fn legend(trade: &Trade, all: bool) -> String {
    let wires = trade.main_readings().wires;
    let scan = match (trade.device.scan_ms, wires) {
        (Some(ms), _) => {
            format!("ms: time of a frame, scan ({ms} ms a sample, as given) and decoding")
        }
        (None, Some(Wires { rows, columns })) => {
            let is_same = trade.readings.iter().all(|readings| readings.wires == wires);
            let columns = if is_same { columns.to_string() } else { "`cols`".into() };
            format!(
                "ms: time of a frame, scan (by the board's plan for {rows} × {columns} wires) and decoding"
            )
        }
        (None, None) => {
            "ms: time of decoding a frame alone; the scan's is unknown (--scan-ms)".into()
        }
    };
    let mut lines = vec![
        format!("{scan}, at {} MHz", trade.device.clock_mhz),
        "cycles: of decoding on a Cortex-M4F whose memory never waits (docs/cycles.md); blob, RAM: bytes".into(),
        "× limit: RMSE relative to the least possible one with as many samples a reading and the same columns".into(),
        "avg: samples a reading; Hz: frames a second on the device, the serial line may carry fewer".into(),
    ];
    if trade.motion.is_some() {
        lines.push(
            "RMSE: of the newest finished estimate against the truth at that moment, every ms"
                .into(),
        );
        lines.push("filt: time constant in ms of an α–β filter behind the decoder (docs/filter.md); - for none".into());
    }
    if trade.points.iter().any(|point| point.times.age_ms.is_some()) {
        lines.push("age: mean time from the middle of a scan until its estimate is used".into());
    }
    if trade.group == metrics::ALL {
        lines.push("RMSE of all: mean over the outputs of RMSE/standard deviation σ; always predicting the mean has 1".into());
    }
    if wires.is_some() {
        lines.push("cols: column-wires that are read".into());
    }
    if all {
        lines.push("*: on the Pareto front (RMSE, time of a frame); >: chosen".into());
    } else {
        lines.push(
            "All are on the Pareto front (RMSE, time of a frame) but perhaps the one chosen (>)"
                .into(),
        );
    }
    if trade.points.iter().any(|point| !point.each_row) {
        lines.push("array: one network for all rows, behind a projection; not listed if larger than a slot".into());
    }
    lines.join("\n")
}

/// Indices of the points to print: all as they were measured, or the front and the chosen one from fast to slow.
fn shown(trade: &Trade, all: bool) -> Vec<usize> {
    if all {
        return (0..trade.points.len()).collect();
    }
    let mut shown = trade.front();
    if let Some(chosen) = trade.chosen.filter(|chosen| !shown.contains(chosen)) {
        let time = |i: usize| trade.points[i].times.frame_ms;
        let place = shown.partition_point(|i| time(*i) <= time(chosen));
        shown.insert(place, chosen);
    }
    shown
}

fn line_of(trade: &Trade, i: usize) -> String {
    let point = &trade.points[i];
    let mark = match (trade.chosen == Some(i), point.on_front) {
        (true, _) => ">",
        (false, true) => "*",
        (false, false) => " ",
    };
    let ratio = point.ratio_to_limit(&trade.group).map_or("-".into(), |r| format!("{r:.2}"));
    format!(
        "{mark} {:<26} {:>3} {:>4} {:>3} {:>4} {:>7} {ratio:>7} {:>6} {:>6} {:>6} {:>6} {:>6} {:>5}",
        point.way(),
        point.centres,
        point.columns.map_or("-".into(), |columns| columns.to_string()),
        point.samples_averaged,
        point.filter.map_or("-".into(), |filter| format!("{:.1}", filter.time_constant_ms)),
        error(point.rmse(&trade.group)),
        ms(point.times.frame_ms),
        point.times.age_ms.map_or("-".into(), ms),
        rate(point.times.frames_per_s),
        point.frame.cycles,
        point.blob_bytes,
        point.ram_bytes,
    )
}

/// The chosen point in words, and what to do with it.
fn choice(page: &mut Page, trade: &Trade, chosen: usize, folder: &Path) {
    let point = &trade.points[chosen];
    let verdict = trade.verdict_on(chosen);
    wrapped(page, &format!("Chosen: {}. {}", point.name(), verdict.sentence));
    wrapped(page, &cost(point));
    wrapped(page, &trade.line_note());
    for warning in &verdict.warnings {
        wrapped(page, &warning.to_string());
    }
    page.line(format_args!("the blob: {}", folder.join("chosen.bin").display()));
    if let Some(columns) = &trade.main_readings().column_wires {
        page.line(format_args!("in a scene, below [readout]: column_wires = {columns:?}"));
    }
    let period = period_us(trade, point).map(|us| format!(" --period-us {us}"));
    let oversampling =
        (point.samples_averaged > 1).then(|| format!(" --oversampling {}", point.samples_averaged));
    let filter = point.filter.map(|filter| {
        format!(" --filter-ms {} --lead-ms {}", filter.time_constant_ms, filter.lead_ms)
    });
    let options: String = [period, oversampling, filter].into_iter().flatten().collect();
    if !options.is_empty() {
        page.line(format_args!("on a device: host-sim link PORT configure{options}"));
    }
}

/// Period of frames in µs to configure: as asked for, or the shortest that the point can keep up with. On contacts that move
/// the latter, at which the point was judged.
fn period_us(trade: &Trade, point: &Point) -> Option<u64> {
    let shortest = point.times.scan_ms.map(|_| (1000.0 * point.times.period_ms()).ceil())?;
    let asked = trade.bounds.frame_rate_hz.filter(|_| trade.motion.is_none());
    let asked = asked.map(|hz| (1e6 / hz).floor());
    Some(asked.unwrap_or(shortest) as u64)
}

/// What the ends of the front are worth, where nothing is chosen.
fn no_choice(page: &mut Page, trade: &Trade) {
    let front = trade.front();
    let (Some(fastest), Some(best)) = (front.first(), trade.most_accurate()) else { return };
    for (end, i) in [("The fastest", *fastest), ("The most accurate", best)] {
        if let Some((decoder, least)) = trade.better_baseline(i) {
            let least = error(least);
            page.line(format_args!(
                "{end}: no model; the baseline {decoder} has a smaller error, {least}"
            ));
            continue;
        }
        let point = &trade.points[i];
        let Verdict { sentence, warnings } = trade.verdict_on(i);
        wrapped(page, &format!("{end}: {}. {sentence} {}", point.name(), cost(point)));
        warnings.iter().for_each(|warning| wrapped(page, &warning.to_string()));
    }
    if !trade.bounds.any() {
        page.line("To choose one, give a bound: --max-error, --frame-rate, --max-latency-ms, --max-cycles or --max-flash");
    }
}

/// What a point costs a device.
fn cost(point: &Point) -> String {
    let times = &point.times;
    let time = match times.scan_ms {
        Some(scan_ms) => format!(
            "An estimate is finished {} ms after the start of its scan ({} ms to scan, {} ms to decode). There are at most {} \
             frames a second. An estimate is {} ms old when it is used, on average",
            ms(times.frame_ms),
            ms(scan_ms),
            ms(times.decode_ms),
            rate(times.frames_per_s),
            ms(times.age_ms.unwrap_or_default())
        ),
        None => format!("Decoding a frame takes {} ms, besides its scan", ms(times.decode_ms)),
    };
    format!(
        "{time}; {} cycles, {} bytes of flash, {} bytes of RAM.",
        point.frame.cycles, point.blob_bytes, point.ram_bytes
    )
}

/// Text of an RMSE.
fn error(rmse: f64) -> String {
    match rmse {
        rmse if (0.001..1000.0).contains(&rmse) => format!("{rmse:.4}"),
        rmse => format!("{rmse:.2e}"),
    }
}

/// Text of a time in ms with three significant digits, or in µs' steps.
fn ms(time: f64) -> String {
    if time < 100.0 { format!("{time:.3}") } else { format!("{time:.1}") }
}

/// Text of a rate.
fn rate(frames_per_s: f64) -> String {
    if frames_per_s < 1000.0 { format!("{frames_per_s:.1}") } else { format!("{frames_per_s:.0}") }
}
