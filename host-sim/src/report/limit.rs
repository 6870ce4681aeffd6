//! Page of a limit: what a sensor can know, with pictures.

use std::fmt::Write as _;

use taxel_limit::identify::Observability;

use super::axes::Axis;
use super::chart::{Chart, Mark, STYLES, Series};
use super::colour::ColourScale;
use super::errors::BAR_PX;
use super::face::Face;
use super::face_map::{Map, Values};
use super::figures::{Figure, Figures, Page, Panel};
use super::format::{noise, significant, symbol, with_unit};
use super::html::document;
use super::svg::{Shape, escape};
use super::tables::numbers;
use super::ticks;
use taxel_evaluate::evaluate::limit::{Figures as Limits, Level, LimitResult};
use taxel_evaluate::metrics::DecoderErrors;

/// Signal-to-noise ratios below this are not drawn.
const LEAST_RATIO: f64 = 1e-3;
/// Sizes of charts in wide and in narrow windows.
const SIZES: [[f64; 2]; 2] = [[920.0, 400.0], [480.0, 400.0]];
/// Directions that are drawn at most.
const MOST_DIRECTIONS: usize = 60;

/// Chart of the signal-to-noise ratio of every direction, against the noise.
fn directions(level: &Level) -> Chart {
    let line = |seen: &Observability| -> Vec<[f64; 2]> {
        let ratios = seen.signal_to_noise.iter().take(MOST_DIRECTIONS).enumerate();
        ratios.filter(|(_, r)| **r > LEAST_RATIO).map(|(i, r)| [i as f64 + 1.0, *r]).collect()
    };
    let mut series = Vec::new();
    for (i, row) in level.by_row.iter().enumerate() {
        let name = match &row.row_wires[..] {
            _ if i == 0 => "each row by itself".into(),
            [wire] => format!("row {wire}"),
            wires => format!("{} rows", wires.len()),
        };
        let line = Series::new(&name, "c2", Mark::LineAnd(Shape::Circle), line(row));
        series.push(Series { opacity: 0.45, is_listed: i == 0, ..line });
    }
    if level.by_row.len() > 1 {
        let all = line(&level.observability);
        series.push(Series::new("all readings", "c1", Mark::LineAnd(Shape::Square), all));
    }
    let most = series.iter().map(|s| s.points.len()).max().unwrap_or(1) as f64;
    series.push(Series::new(
        "the noise",
        "muted",
        Mark::Dashed,
        vec![[0.5, 1.0], [most + 0.5, 1.0]],
    ));
    let ratios = series.iter().flat_map(|s| s.points.iter().map(|[_, ratio]| *ratio));
    let y = ticks::logarithmic(ratios, |ratio| significant(ratio, 1));
    let mut x = ticks::linear([0.0, most], 8);
    (x.low, x.high) = (0.5, most + 0.5);
    x.at.retain(|(value, _)| (1.0..=most).contains(value));
    Chart {
        title: "Signal-to-noise ratio of every direction of the deformation".into(),
        x: Axis::linear("direction, the best visible one first", x),
        y: Axis::logarithmic("signal-to-noise ratio", y),
        series,
        end_labels: false,
    }
}

/// Page of a limit, with the `command` that computed it.
pub fn html(result: &LimitResult, command: &str) -> Page {
    let title = format!("Taxel: what the sensor can know, {}", result.subject);
    let mut figures = Figures::in_files("");
    let mut body = format!(
        "<header>\n<h1>{}</h1>\n<p>{} noise; {} test frames; seed {}</p>\n{}</header>\n",
        escape(&title),
        result.noise_kind.name(),
        result.frames,
        result.seed,
        least(result)
    );
    if result.levels.len() > 1 {
        let caption = "Least possible RMSE from all readings against the noise, both logarithmic. Dashed: predicting the mean.";
        body += &figures.html(&Figure::of_chart(
            "limit-by-noise",
            caption.into(),
            &by_noise(result),
            SIZES,
        ));
    }
    for level in &result.levels {
        let seen = &level.observability;
        let noise = noise(result.noise_kind, level.noise_level);
        let of_level = match result.levels.len() {
            1 => String::new(),
            _ => format!(
                "-at-{}",
                noise.replace('\u{a0}', "-").replace('%', "percent").replace('Ω', "ohm")
            ),
        };
        let _ = writeln!(body, "<h2>What {noise} noise leaves visible</h2>");
        let caption = format!(
            "Signal-to-noise ratio of every direction: how far one standard deviation of the prior moves the readings, in \
             standard deviations of the noise. {} of {} directions are observable, above the dashed line. Ratios below \
             {LEAST_RATIO} are not drawn.",
            seen.observable, seen.unknowns
        );
        let name = format!("directions{of_level}");
        body += &figures.html(&Figure::of_chart(&name, caption, &directions(level), SIZES));
        let caption = "Share of the prior's variance of each electrode's Δx, Δy and Δz that all readings take away, for a sensor \
                       linearised at the mean deformation: 0 is invisible, 1 is known.";
        let name = format!("known{of_level}");
        body += &figures.html(&Figure::of_panels(&name, caption.into(), &known(result, seen)));
    }
    body += &limits(result);
    let _ = writeln!(body, "<p class=\"note\">Made by <code>{}</code></p>", escape(command));
    Page { html: document(&title, &body), figures: figures.files }
}

/// Least possible errors of all readings at the first noise level.
fn least(result: &LimitResult) -> String {
    let of_first = |level: &Level| noise(result.noise_kind, level.noise_level);
    let noise = result.levels.first().map_or(String::new(), of_first);
    let figures = result.levels.first().and_then(|level| level.limits.first());
    let groups = figures.iter().flat_map(|figures| &figures.groups).map(|group| {
        format!(
            "<div><dt>Least possible RMSE of {} at {noise} noise</dt><dd>{}\u{a0}<span>{}</span></dd></div>\n",
            escape(&symbol(&group.group)),
            significant(group.limit, 3),
            escape(&group.unit)
        )
    });
    let groups: String = groups.collect();
    if groups.is_empty() { groups } else { format!("<dl>\n{groups}</dl>\n") }
}

/// Line of the table for a model: its errors, and their ratios to the limit.
fn model_row(noise: &str, model: &DecoderErrors) -> String {
    let cells = model.errors.iter().map(|errors| {
        let ratio = errors.ratio_to_limit.map_or(String::new(), |r| format!(" ({r:.3} ×)"));
        format!("{:.4}{ratio}", errors.rmse)
    });
    let (name, cells) = (escape(&model.decoder), numbers("td", cells));
    format!("<tr><td>{noise}</td><td>model {name}</td>{cells}<td></td></tr>\n")
}

/// Table of the limits.
fn limits(result: &LimitResult) -> String {
    let mut html = String::from(
        "<h2>Least possible errors</h2>\n<figure class=\"table\">\n<figcaption>Least possible RMSE of any decoder, ± its standard error. ESS: smallest \
         and median effective sample size of the posteriors. Of a model: RMSE on these frames, and its ratio to the \
         limit of all readings.</figcaption>\n<div class=\"scroll\" tabindex=\"0\" \
         role=\"region\" aria-label=\"Limits\">\n<table>\n<thead><tr><th>noise</th><th>readings</th>",
    );
    let groups =
        result.levels.iter().flat_map(|level| &level.limits).map(|figures| &figures.groups);
    let groups = groups.max_by_key(|groups| groups.len());
    let groups = groups.into_iter().flatten();
    let heads = groups.map(|group| escape(&with_unit(&symbol(&group.group), &group.unit)));
    html += &numbers("th", heads.chain(["ESS".into()]));
    html += "</tr></thead>\n<tbody>\n";
    for level in &result.levels {
        let noise = noise(result.noise_kind, level.noise_level);
        for figures in &level.limits {
            let _ = write!(html, "<tr><td>{noise}</td><td>{}</td>", name(figures));
            if let Some(refused) = &figures.refused {
                let _ = write!(
                    html,
                    "<td colspan=\"4\" style=\"white-space: normal\">not given: {}</td>",
                    escape(refused)
                );
            }
            let limits = figures.groups.iter();
            let limits = limits.map(|g| format!("{:.4} ± {:.4}", g.limit, g.limit_standard_error));
            let samples = figures.effective_samples;
            let samples = samples.map(|e| format!("{:.0}, {:.0}", e.least, e.median));
            html += &(numbers("td", limits.chain(samples)) + "</tr>\n");
        }
        for model in &level.decoders {
            html += &model_row(&noise, model);
        }
    }
    html + "</tbody>\n</table>\n</div>\n</figure>\n"
}

fn name(figures: &Limits) -> String {
    match &figures.row_wires[..] {
        [row] => format!("row {row}"),
        rows => format!("all {} rows", rows.len()),
    }
}

/// Chart of the limit against the noise level.
fn by_noise(result: &LimitResult) -> Chart {
    let of_array = || result.levels.iter().filter_map(|l| Some((l.noise_level, l.limits.first()?)));
    let names = of_array().map(|(_, figures)| &figures.groups).max_by_key(|groups| groups.len());
    let mut series = Vec::new();
    for (group, (class, shape)) in names.into_iter().flatten().zip(STYLES).take(3) {
        let line = |of: &dyn Fn(&taxel_limit::reference::GroupLimit) -> f64| {
            let mut points: Vec<[f64; 2]> = of_array()
                .filter_map(|(noise, f)| {
                    f.groups.iter().find(|g| g.group == group.group).map(|g| [noise, of(g)])
                })
                .collect();
            points.sort_by(|a, b| a[0].total_cmp(&b[0]));
            points
        };
        let name = symbol(&group.group);
        let mean =
            Series::new(&format!("{name}, the mean"), class, Mark::Dashed, line(&|g| g.prior_rmse));
        series.push(mean.unlisted());
        series.push(Series::new(&name, class, Mark::LineAnd(shape), line(&|g| g.limit)));
    }
    let all = |axis: usize| series.iter().flat_map(move |s| s.points.iter().map(move |p| p[axis]));
    let (x, y) = (
        ticks::logarithmic(all(0), |level| noise(result.noise_kind, level)),
        ticks::logarithmic(all(1), |value| significant(value, 1)),
    );
    Chart {
        title: "Least possible RMSE against the noise".into(),
        x: Axis::logarithmic("noise", x),
        y: Axis::logarithmic("least possible RMSE (mm)", y),
        series,
        end_labels: true,
    }
}

/// Maps of what is known of each electrode, one an axis.
fn known(result: &LimitResult, seen: &Observability) -> [Panel; 3] {
    let per_row = seen.electrodes.len() / seen.row_wires.len().max(1);
    let [x_mm, y_mm, _] = result.size_mm;
    let size_mm = [x_mm / per_row.max(1) as f64, y_mm / result.row_wires.max(1) as f64];
    let places: Vec<[f64; 2]> = seen.electrodes.iter().map(|e| e.position_mm).collect();
    let face = Face::of_rectangles([x_mm, y_mm], size_mm, &places, &seen.row_wires);
    ['x', 'y', 'z'].map(|letter| {
        let axis = usize::from(letter as u8 - b'x');
        let of_cells: Vec<f64> = seen.electrodes.iter().map(|e| e.known[axis]).collect();
        let title = format!("Map over the face of what the readings tell about Δ{letter}");
        let (label, scale) = ("share of the prior's variance", &ColourScale::of_shares());
        let shown = 3 * result.levels.len();
        let values = Values { of_cells: &of_cells, scale, label, unit: "", shown };
        Map::new(&face, &title, &format!("Δ{letter}: share known"), BAR_PX).values(&values)
    })
}
