//! Figures of single frames, by the rank of their errors.

use super::colour::ColourScale;
use super::data::{Data, number};
use super::errors::{BAR_PX, Pictures};
use super::face::Face;
use super::face_map::{Map, Values};
use super::figures::{Figure, Panel, Step};
use super::format::{fixed, significant, symbol, with_unit};
use super::svg::{Anchor, TEXT_PX};
use super::ticks;
use taxel_evaluate::evaluate::distribution::{Rank, RelativeTo, ShownFrame};

/// Columns that are a place on the face.
const PLACES: [[&str; 2]; 2] = [["contact_x_mm", "contact_y_mm"], ["x_mm", "y_mm"]];

/// Name of a frame in headings.
pub fn name(frame: &ShownFrame) -> String {
    match frame.rank {
        Rank::Median => "median frame".into(),
        Rank::Worst => "worst frame".into(),
        Rank::Percent(0) => "best frame".into(),
        rank => format!("{} % frame", rank.percent()),
    }
}

/// Words about a frame for captions: its number, its rank, and its error.
fn described(view: &Pictures<'_>, frame: &ShownFrame) -> String {
    let rank = match frame.rank {
        Rank::Median => "The frame of median error".into(),
        Rank::Worst => "The frame with the largest error".into(),
        Rank::Percent(0) => "The frame with the least error".into(),
        rank => format!("The frame with a larger error than {} % of all", rank.percent()),
    };
    let errors = view.distribution.groups.iter().zip(&frame.rmse);
    let errors: Vec<String> = errors
        .filter(|(_, rmse)| rmse.is_finite())
        .map(|(g, rmse)| format!("{} {} {}", symbol(&g.group), significant(*rmse, 2), g.unit))
        .collect();
    format!("{rank}: number {} (from 0), RMSE {}.", frame.frame, errors.join(", "))
}

/// How frames are ordered, for a caption.
pub const ORDER: &str = "Frames are ordered by the root mean square of their errors over all outputs; outputs of \
                         different quantities are divided by their standard deviations first.";

/// Figure of the readings of all shown frames.
pub fn readings(view: &Pictures<'_>) -> Option<Figure> {
    let shown = &view.distribution.readings;
    let (label, words) = match shown.relative_to {
        RelativeTo::Rest => {
            ("ΔR/R₀ (%)", "Change of the readings from the sensor at rest, ΔR/R₀ in %")
        }
        RelativeTo::Median => (
            "change from median (%)",
            "Readings relative to the median of each over all frames, in %; the sensor at rest is not known",
        ),
        RelativeTo::MedianInDeviations => (
            "change from median (σ)",
            "Readings relative to the median of each over all frames, in its standard deviations σ; the sensor at \
             rest is not known",
        ),
    };
    let unit = if shown.relative_to == RelativeTo::MedianInDeviations { "" } else { "%" };
    let Some(face) = Face::of_readings(shown) else { return channels(view, label, words) };
    let changes = || view.distribution.frames.iter().map(|frame| &frame.change);
    let scale = ColourScale::diverging(changes().flatten().copied());
    let frames = &view.distribution.frames;
    let map = |frame: &ShownFrame| {
        let title = format!("Readings of the {}", name(frame));
        let shown = frames.len();
        let values = Values { of_cells: &frame.change, scale: &scale, label, unit, shown };
        Map::new(&face, &title, &name(frame), BAR_PX).values(&values)
    };
    let panels: Vec<Panel> = frames.iter().map(map).collect();
    let missing = if changes().flatten().any(|change| change.is_nan())
        || face.cells.len() > shown.names.len()
    {
        " × marks a reading that is missing or left out."
    } else {
        ""
    };
    let caption = format!("{words}. All maps share one scale.{missing} {ORDER}");
    Some(Figure::of_panels("readings", caption, &panels))
}

/// Figure of readings whose names tell no wires: bars in the order of the columns.
fn channels(view: &Pictures<'_>, label: &str, words: &str) -> Option<Figure> {
    use super::axes::Axis;
    use super::chart::{Chart, Mark, Series};
    let shown = &view.distribution.readings;
    let count = shown.names.len();
    let frames = &view.distribution.frames;
    let all = || frames.iter().flat_map(|frame| frame.change.iter().copied());
    let short = count <= 16 && shown.names.iter().all(|name| name.chars().count() <= 5);
    // Numbers are marked as far apart as a reader can tell them.
    let step = if short { 1 } else { count.div_ceil(16).next_power_of_two() };
    let names = shown.names.iter().enumerate().filter(|(i, _)| (i + 1) % step == 0 || *i == 0);
    let at = names
        .map(|(i, name)| (i as f64 + 1.0, if short { name.clone() } else { (i + 1).to_string() }));
    let at: Vec<(f64, String)> = at.collect();
    let axis = if short { "reading" } else { "reading, as the model’s inputs" };
    let panel = |frame: &ShownFrame| {
        let points = frame.change.iter().enumerate().map(|(i, y)| [i as f64 + 1.0, *y]).collect();
        let chart = Chart {
            title: format!("Readings of the {}", name(frame)),
            x: Axis::linear(
                axis,
                ticks::Ticks { low: 0.5, high: count as f64 + 0.5, at: at.clone() },
            ),
            y: Axis::linear(
                format!("{}: {label}", name(frame)),
                ticks::linear(all().chain([0.0]), 4),
            ),
            series: vec![Series::new("readings", "c1", Mark::Bars(0.7), points).unlisted()],
            end_labels: false,
        };
        let mut data = Data::new(&["reading", label]);
        let lines = shown.names.iter().zip(&frame.change);
        data.lines.extend(lines.map(|(reading, change)| vec![reading.clone(), number(*change)]));
        Panel { heading: name(frame), drawing: chart.draw([310.0, 230.0]), data }
    };
    let panels: Vec<Panel> = frames.iter().map(panel).collect();
    let caption = format!("{words}. All axes share one scale. {ORDER}");
    (!panels.is_empty()).then(|| Figure::of_panels("readings", caption, &panels))
}

/// Frames to step through: of all ranks, or of a sensor with many electrodes those that matter most.
fn steps<'v>(view: &'v Pictures<'_>, face: &Face) -> Vec<&'v ShownFrame> {
    /// Cells of all maps at most: more would make the page large.
    const MOST_CELLS: usize = 6000;
    const BY_WORTH: [u8; 13] = [50, 95, 100, 0, 90, 99, 80, 20, 70, 30, 60, 40, 10];
    let count = (MOST_CELLS / (3 * face.cells.len().max(1))).clamp(3, BY_WORTH.len());
    let all = view.distribution.steps.iter();
    all.filter(|frame| BY_WORTH[..count].contains(&frame.rank.percent())).collect()
}

/// Figure of maps of frames of all ranks, to step through: true, decoded and their difference, of one group of outputs.
pub fn maps(view: &Pictures<'_>, face: &Face) -> Option<Figure> {
    let (group, frames) = (view.distribution.main_group()?, steps(view, face));
    let (symbol, unit) = (symbol(&group.group), &group.unit);
    let of_line = |line: &[f64]| face.values(view.distribution, &group.group, line);
    let values: Vec<[Vec<f64>; 2]> = frames
        .iter()
        .map(|frame| [&frame.truth, &frame.estimate].map(|line| of_line(line)))
        .collect();
    let signal = ColourScale::diverging(values.iter().flatten().flatten().copied());
    let of_error = signal.of_differences();
    let step = |(&frame, [truth, estimate]): (&&ShownFrame, &[Vec<f64>; 2])| {
        let error: Vec<f64> = estimate.iter().zip(truth).map(|(a, b)| a - b).collect();
        let panel = |what: &str, of_cells: &[f64], scale: &ColourScale, label: &str| {
            let heading = format!("{}: {symbol}, {what}", name(frame));
            let title = format!("Map of {symbol}, {what}, {}", name(frame));
            let (label, shown) = (&with_unit(label, unit), 3 * frames.len());
            let values = Values { of_cells, scale, label, unit, shown };
            Map::new(face, &title, &heading, BAR_PX).values(&values)
        };
        let panels = vec![
            panel("true", truth, &signal, &symbol),
            panel("decoded", estimate, &signal, &symbol),
            panel("decoded − true", &error, &of_error, &format!("error of {symbol}")),
        ];
        let label = format!("{}\u{a0}%", frame.rank.percent());
        Step { label, words: described(view, frame), panels }
    };
    let steps: Vec<Step> = frames.iter().zip(&values).map(step).collect();
    let median = frames.iter().position(|frame| frame.rank.percent() >= 50)?;
    let caption = format!(
        "Maps of {symbol} in frames of growing error. True and decoded values share one scale in all frames. The scale \
         of their difference ends at ± the largest value of the first, so that a colour means the same distance from zero on all maps. {ORDER}"
    );
    let question = "Share of the frames with no larger error";
    Some(Figure::of_steps("frames", caption, question, &steps, median))
}

/// Figure of x and y of all shown frames as arrows, true and decoded. `None` if they are not decoded both.
pub fn arrows(view: &Pictures<'_>, face: &Face) -> Option<Figure> {
    let groups = &view.distribution.groups;
    let [x, y] = [["dx_mm", "dy_mm"], ["fx_n", "fy_n"]]
        .into_iter()
        .find(|names| names.iter().all(|name| groups.iter().any(|g| g.group == *name)))?;
    let unit = taxel_data::columns::unit_of(x);
    let vectors: Vec<[[Vec<f64>; 2]; 2]> = view
        .distribution
        .frames
        .iter()
        .map(|frame| {
            [&frame.truth, &frame.estimate]
                .map(|line| [x, y].map(|group| face.values(view.distribution, group, line)))
        })
        .collect();
    let panel = |(frame, [truth, estimate]): (&ShownFrame, &[[Vec<f64>; 2]; 2])| {
        let lengths = [truth, estimate].into_iter().flat_map(|[x, y]| x.iter().zip(y));
        let longest = lengths.map(|(x, y)| x.hypot(*y)).filter(|l| l.is_finite());
        let longest = longest.fold(0.0, f64::max);
        let longest = if longest > 0.0 { longest } else { 1.0 };
        let heading = format!("{} and {}, {}", symbol(x), symbol(y), name(frame));
        let slices = [truth, estimate].map(|[x, y]| [x.as_slice(), y.as_slice()]);
        Map::new(face, &format!("Arrows of {heading}"), &heading, 28.0)
            .arrows(slices, longest, unit)
    };
    let panels: Vec<Panel> = view.distribution.frames.iter().zip(&vectors).map(panel).collect();
    let caption = format!(
        "{} and {} of every electrode in the frames of median, high and largest error, as arrows: true and decoded. Each panel has a scale of its \
         own, which the bar below it gives.",
        symbol(x),
        symbol(y)
    );
    (!panels.is_empty()).then(|| Figure::of_panels("arrows", caption, &panels))
}

/// Figure of true and decoded places in the shown frames. `None` for outputs without a place.
pub fn places(view: &Pictures<'_>) -> Option<Figure> {
    let outputs = &view.distribution.outputs;
    let column = |name: &str| outputs.iter().position(|output| output.name == name);
    let [x, y] = PLACES.into_iter().find_map(|[x, y]| Some([column(x)?, column(y)?]))?;
    let face = if let Some(sensor) = view.sensor {
        Face::blank([0.0, 0.0], sensor.face_mm, Some(sensor.face_mm))
    } else {
        let group = |column: usize| {
            let name = &outputs[column].group;
            view.distribution.groups.iter().find(|group| group.group == *name)
        };
        let [x, y] = [group(x)?, group(y)?].map(|group| &group.density);
        Face::blank([x.low, y.low], [x.high, y.high], None)
    };
    let panel = |frame: &ShownFrame| {
        let heading = name(frame);
        let mut map = Map::new(&face, &format!("Place in the {heading}"), &heading, 46.0);
        for row in view.sensor.into_iter().flat_map(|sensor| &sensor.row_wires) {
            for electrode in &row.electrodes_mm {
                let place = map.place(*electrode);
                map.svg().circle(place, 1.6, "muted mark pale", "");
            }
        }
        // A place that is decoded beside the face is drawn at its edge.
        let clamped = |[x, y]: [f64; 2]| {
            let ticks = face.axes.each_ref().map(|axis| &axis.ticks);
            [x.clamp(ticks[0].low, ticks[0].high), y.clamp(ticks[1].low, ticks[1].high)]
        };
        let of_line = |line: &[f64]| [line[x], line[y]];
        let (truth, estimate) = (of_line(&frame.truth), of_line(&frame.estimate));
        if truth.iter().chain(&estimate).all(|value| value.is_finite()) {
            let [from, to] = [truth, estimate].map(|point| map.place(clamped(point)));
            let [hover_true, hover_decoded] = [("true", truth), ("decoded", estimate)]
                .map(|(what, [x, y])| format!("{what}: {x:.2}, {y:.2} mm"));
            map.svg().line(from, to, "truth thin");
            mark(&mut map, from, "truth mark", 5.0, &hover_true);
            mark(&mut map, to, "c1 ring", 7.0, &hover_decoded);
        }
        let depth =
            column("contact_depth_mm").map(|depth| [frame.truth[depth], frame.estimate[depth]]);
        legend(&mut map, &face, depth);
        let mut data = Data::new(&["output", "true", "decoded", "unit"]);
        let named = [("x", truth[0], estimate[0]), ("y", truth[1], estimate[1])];
        let depth = depth.map(|[truth, estimate]| ("depth", truth, estimate));
        for (name, truth, estimate) in named.into_iter().chain(depth) {
            data.lines.push(vec![name.into(), number(truth), number(estimate), "mm".into()]);
        }
        map.finish(data)
    };
    let panels: Vec<Panel> = view.distribution.frames.iter().map(panel).collect();
    let face_of = if view.sensor.is_some() {
        "Small dots are the upper electrodes."
    } else {
        "The frame is the range of true positions."
    };
    let caption = format!(
        "Position of the contact, true and decoded, seen from above. A line joins the two. {face_of} A position \
         beyond the frame is drawn at its edge."
    );
    (!panels.is_empty()).then(|| Figure::of_panels("places", caption, &panels))
}

fn mark(map: &mut Map<'_>, place: [f64; 2], class: &str, radius: f64, hover: &str) {
    map.svg().circle(place, radius, class, &format!("<title>{hover}</title>"));
}

fn legend(map: &mut Map<'_>, face: &Face, depth_mm: Option<[f64; 2]>) {
    let [x, y] = map.place(face.axes.each_ref().map(|axis| axis.ticks.low));
    if let Some([truth, estimate]) = depth_mm {
        let depth = format!("depth {} mm, decoded {} mm", fixed(truth, 2), fixed(estimate, 2));
        map.svg().text(x, y + 82.0, Anchor::Start, "tick", &depth);
    }
    let y = y + 58.0;
    mark(map, [x + 6.0, y], "truth mark", 5.0, "true");
    map.svg().text(x + 18.0, y + TEXT_PX * 0.35, Anchor::Start, "tick", "true");
    mark(map, [x + 76.0, y], "c1 ring", 7.0, "decoded");
    map.svg().text(x + 90.0, y + TEXT_PX * 0.35, Anchor::Start, "tick", "decoded");
}
