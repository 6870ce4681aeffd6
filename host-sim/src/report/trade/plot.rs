//! The picture of a trade: the front, the chosen point, and pale what is not worth choosing.

use std::fmt::Write as _;

use model_core::rbf::Format;

use super::axes::Axes;
use super::labels::Labels;
use super::words;
use crate::report::format::symbol;
use crate::report::svg::{Anchor, Px, Shape, Svg, TEXT_PX, escape, text_width};
use taxel_evaluate::evaluate::trade::{Point, Trade};

const LINE_PX: f64 = TEXT_PX + 7.0;

/// Shape of a format's points.
fn shape(format: Format) -> Shape {
    match format {
        Format::Fixed16 => Shape::Circle,
        Format::F32 => Shape::Square,
        Format::F32Direct => Shape::Triangle,
    }
}

/// Colour of a point: by what its networks see. Behind a gate it is hollow.
fn class(point: &Point) -> &'static str {
    match (point.whole_array, point.gate_k.is_some()) {
        (false, false) => "c1 mark",
        (false, true) => "c1 hollow mark",
        (true, false) => "c4 mark",
        (true, true) => "c4 hollow mark",
    }
}

/// Picture in this size, and the number of points that lie outside it.
pub fn draw(trade: &Trade, [width, height]: [f64; 2]) -> (String, usize) {
    let axes = Axes::of(trade);
    let title = format!("RMSE of {} against the time of a frame", symbol(&trade.group));
    let mut svg = Svg::new(width, height, &title);
    let tick_width = axes.y.at.iter().map(|(_, label)| text_width(label)).fold(0.0, f64::max);
    let legend_end = legend(&mut svg, trade, width);
    let place = Place {
        left: tick_width + 10.0,
        right: width - 10.0,
        top: legend_end + 3.0 * LINE_PX + 4.0,
        bottom: height - 2.0 * LINE_PX - 4.0,
        axes,
    };
    place.draw_axes(&mut svg, trade, height);
    let mut labels = Labels::new([place.left, place.top, place.right, place.bottom]);
    let outside = place.draw_dominated(&mut svg, trade);
    place.draw_front(&mut svg, trade, &mut labels);
    place.draw_bounds(&mut svg, trade, &mut labels);
    place.draw_notes(&mut svg, trade, &mut labels);
    (svg.finish(), outside)
}

/// Draws what marks mean, as far as they occur on the front. Returns the y coordinate at which it ends.
fn legend(svg: &mut Svg, trade: &Trade, width: f64) -> f64 {
    let shown = |of: &dyn Fn(&Point) -> bool| {
        let chosen = trade.chosen.map(|chosen| &trade.points[chosen]);
        trade.points.iter().filter(|p| p.on_front).chain(chosen).any(of)
    };
    let mut entries: Vec<(&str, Shape, &str)> = Vec::new();
    let mut add = |name, shape, class| entries.push((name, shape, class));
    let (of_rows, of_array) = (shown(&|p| !p.whole_array), shown(&|p| p.whole_array));
    if of_rows {
        add("a network a row", Shape::Circle, "c1 mark");
    }
    if of_array {
        add("one for the array", Shape::Circle, "c4 mark");
    }
    let colour = if of_array { "c4 mark" } else { "c1 mark" };
    for (format, name) in [(Format::F32, "f32"), (Format::F32Direct, "f32-direct")] {
        if shown(&|p| p.arithmetic.format == format) {
            add(name, shape(format), colour);
        }
    }
    if shown(&|p| p.gate_k.is_some()) {
        add("gate", Shape::Circle, if of_rows { "c1 hollow mark" } else { "c4 hollow mark" });
    }
    if trade.chosen.is_some() {
        add("chosen", Shape::Ring, "chosen mark");
    }
    let (mut x, mut y) = (8.0, TEXT_PX);
    for (name, shape, class) in entries {
        let entry = text_width(name) + 30.0;
        if x > 8.0 && x + entry > width {
            (x, y) = (8.0, y + LINE_PX);
        }
        svg.path(&shape.path([x, y - TEXT_PX * 0.35], 1.0), class);
        svg.text(x + 12.0, y, Anchor::Start, "tick", name);
        x += entry;
    }
    y
}

/// Place of the picture in px.
struct Place {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
    axes: Axes,
}

impl Place {
    fn x(&self, value: f64) -> f64 {
        self.left + self.axes.x.place(value) * (self.right - self.left)
    }

    fn y(&self, value: f64) -> f64 {
        self.bottom - self.axes.y.place(value) * (self.bottom - self.top)
    }

    fn of(&self, trade: &Trade, point: &Point) -> Option<[f64; 2]> {
        let (x, y) = (self.axes.x_of(&point.times), point.rmse(&trade.group));
        let inside = self.axes.x.holds(x) && self.axes.y.holds(y);
        inside.then(|| [self.x(x), self.y(y)])
    }

    fn draw_axes(&self, svg: &mut Svg, trade: &Trade, height: f64) {
        let Self { left, right, top, bottom, axes } = self;
        for (value, label) in &axes.y.at {
            let y = self.y(*value);
            svg.line([*left, y], [*right, y], "grid");
            svg.text(left - 7.0, y + TEXT_PX * 0.35, Anchor::End, "tick", label);
        }
        let unit = if trade.unit.is_empty() { String::new() } else { format!(", {}", trade.unit) };
        let label = format!("RMSE of {}{unit}", symbol(&trade.group));
        svg.text(0.0, top - 2.0 * LINE_PX, Anchor::Start, "label", &label);
        svg.text(*right, top - 2.0 * LINE_PX, Anchor::End, "label", axes.rate_label());
        for (at, ticks, away) in [(*bottom, &axes.x.at, 1.0), (*top, &axes.rates(), -1.0)] {
            svg.line([*left, at], [*right, at], "axis");
            let mut free = f64::NEG_INFINITY;
            let mut ticks: Vec<(f64, &String)> =
                ticks.iter().map(|(value, label)| (self.x(*value), label)).collect();
            ticks.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (x, label) in ticks {
                let half = text_width(label) / 2.0;
                // Ticks whose labels would run into the last one, or out of the picture, are left out.
                if x - half > free && x + half < right + 10.0 {
                    let y = if away > 0.0 { at + LINE_PX } else { at - 8.0 };
                    svg.line([x, at], [x, at + 4.0 * away], "axis");
                    svg.text(x, y, Anchor::Middle, "tick", label);
                    free = x + half + 6.0;
                }
            }
        }
        let middle = f64::midpoint(*left, *right);
        svg.text(middle, height - 4.0, Anchor::Middle, "label", &axes.x_label());
    }

    /// Draws points that others beat. Returns how many points of all lie outside.
    fn draw_dominated(&self, svg: &mut Svg, trade: &Trade) -> usize {
        let mut outside = 0;
        svg.open(" class=\"dominated\"");
        for point in &trade.points {
            match self.of(trade, point) {
                Some(at) if !point.on_front => {
                    svg.path(&shape(point.arithmetic.format).path(at, 0.7), class(point));
                }
                Some(_) => {}
                None => outside += 1,
            }
        }
        svg.close();
        outside
    }

    fn draw_front(&self, svg: &mut Svg, trade: &Trade, labels: &mut Labels) {
        let front = trade.front();
        let mut d = String::new();
        for at in front.iter().filter_map(|i| self.of(trade, &trade.points[*i])) {
            let pen = if d.is_empty() { 'M' } else { 'L' };
            // Writing to a string cannot fail.
            let _ = write!(d, "{pen}{} {}", Px(at[0]), Px(at[1]));
        }
        svg.path(&d, "front line");
        let chosen = trade.chosen.filter(|chosen| !front.contains(chosen));
        for i in front.into_iter().chain(chosen) {
            let point = &trade.points[i];
            let Some(at) = self.of(trade, point) else { continue };
            let path = shape(point.arithmetic.format).path(at, 1.0);
            svg.open("");
            svg.add(format_args!("<title>{}</title>", escape(&words::in_full(trade, point))));
            svg.path(&path, class(point));
            if trade.chosen == Some(i) {
                svg.path(&Shape::Ring.path(at, 1.2), "chosen mark");
            }
            svg.close();
            labels.take_mark(at, if trade.chosen == Some(i) { 9.0 } else { 5.0 });
        }
        if let Some(chosen) = trade.chosen {
            let point = &trade.points[chosen];
            if let Some(at) = self.of(trade, point) {
                labels.beside(svg, at, &words::chosen(trade, point), "note-in-chart strong");
            }
        }
    }

    fn draw_bounds(&self, svg: &mut Svg, trade: &Trade, labels: &mut Labels) {
        let Self { left, right, top, bottom, axes } = self;
        for (words, error, class) in Axes::levels(trade) {
            let text = "note-in-chart";
            if axes.y.holds(error) {
                let y = self.y(error);
                svg.line([*left, y], [*right, y], class);
                let places =
                    [[right - 4.0, y - 4.0], [right - 4.0, y + 12.0], [left + 240.0, y - 4.0]];
                labels.at(svg, &places, Anchor::End, &words, text);
            } else {
                let (arrow, y, away) = if error > axes.y.high {
                    ("↑", top + 12.0, 14.0)
                } else {
                    ("↓", bottom - 5.0, -14.0)
                };
                let places = [0.0, 1.0, 2.0].map(|line| [right - 4.0, y + line * away]);
                labels.at(svg, &places, Anchor::End, &format!("{words} {arrow}"), text);
            }
        }
        for (words, x) in axes.uprights(trade) {
            if axes.x.holds(x) {
                let x = self.x(x);
                svg.line([x, *top], [x, *bottom], "bound");
                let places = [60.0, 76.0, 92.0].map(|down| [x - 5.0, top + down]);
                labels.at(svg, &places, Anchor::End, &words, "note-in-chart");
            } else if x > axes.x.high {
                let places = [60.0, 76.0, 92.0].map(|down| [right - 4.0, top + down]);
                labels.at(svg, &places, Anchor::End, &format!("{words} →"), "note-in-chart");
            }
        }
    }

    /// Writes K beside points of the front, as far as there is room: each K once for rows and once for the array.
    fn draw_notes(&self, svg: &mut Svg, trade: &Trade, labels: &mut Labels) {
        let mut known = Vec::new();
        for i in trade.front() {
            let point = &trade.points[i];
            let which = (point.whole_array, point.centres, point.samples_averaged);
            let Some(at) = self.of(trade, point).filter(|_| !known.contains(&which)) else {
                continue;
            };
            if labels.beside(svg, at, &format!("K {}", point.centres), "note-in-chart") {
                known.push(which);
            }
        }
    }
}
