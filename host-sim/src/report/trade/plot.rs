//! The picture of a trade: the front, the chosen point, and pale what is not worth choosing.

use std::fmt::Write as _;

use taxel_core::rbf::Format;

use super::labels::Labels;
use super::scales::{Axes, AxisOfTimes, levels};
use super::words;
use crate::report::axes::{BELOW_PX, Panel, Upright, draw_level_ticks, label_width};
use crate::report::chart::{LINE_PX, Mark, Series, legend};
use crate::report::format::symbol;
use crate::report::svg::{Anchor, Px, Shape, Svg, TEXT_PX, escape, text_width};
use crate::report::ticks::spread_out;
use taxel_evaluate::evaluate::trade::{Point, Trade};

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
    let Axes { times, x, y } = Axes::new(trade);
    let title = format!("RMSE of {} against the time of a frame", symbol(&trade.group));
    let mut svg = Svg::new(width, height, &title);
    let legend_end = legend(&mut svg, &marks(trade), width, text_width(&y.label));
    let (left, right) = (label_width(&y.ticks) + 10.0, width - 10.0);
    let (top, bottom) = (legend_end + 2.0 * LINE_PX + 10.0, height - BELOW_PX);
    let place = Place { times, panel: Panel { x, y, left, right, top, bottom } };
    place.draw_axes(&mut svg);
    let mut labels = Labels::new([left, top, right, bottom]);
    let outside = place.draw_dominated(&mut svg, trade);
    place.draw_front(&mut svg, trade, &mut labels);
    place.draw_bounds(&mut svg, trade, &mut labels);
    place.draw_notes(&mut svg, trade, &mut labels);
    (svg.finish(), outside)
}

/// Series for the legend: what marks mean, as far as they occur on the front.
fn marks(trade: &Trade) -> Vec<Series> {
    let shown = |of: &dyn Fn(&Point) -> bool| {
        let chosen = trade.chosen.map(|chosen| &trade.points[chosen]);
        trade.points.iter().filter(|p| p.on_front).chain(chosen).any(of)
    };
    let (of_rows, of_array) = (shown(&|p| !p.whole_array), shown(&|p| p.whole_array));
    let colour = if of_array { "c4" } else { "c1" };
    let has = |format| shown(&|p| p.arithmetic.format == format);
    let hollow = if of_rows { "c1 hollow" } else { "c4 hollow" };
    let entries = [
        (of_rows, "a network a row", "c1", Shape::Circle),
        (of_array, "one for the array", "c4", Shape::Circle),
        (has(Format::F32), "f32", colour, shape(Format::F32)),
        (has(Format::F32Direct), "f32-direct", colour, shape(Format::F32Direct)),
        (shown(&|p| p.gate_k.is_some()), "gate", hollow, Shape::Circle),
        (trade.chosen.is_some(), "chosen", "chosen", Shape::Ring),
    ];
    let entries = entries.into_iter().filter(|(shown, ..)| *shown);
    entries
        .map(|(_, name, class, shape)| Series::new(name, class, Mark::Points(shape), vec![]))
        .collect()
}

/// Place of the picture in px.
struct Place {
    times: AxisOfTimes,
    panel: Panel,
}

impl Place {
    fn of(&self, trade: &Trade, point: &Point) -> Option<[f64; 2]> {
        let (x, y) = (self.times.of_point(&point.times), point.rmse(&trade.group));
        let inside = self.panel.x.holds(x) && self.panel.y.holds(y);
        inside.then(|| self.panel.at([x, y]))
    }

    fn draw_axes(&self, svg: &mut Svg) {
        let panel @ Panel { left, right, top, .. } = &self.panel;
        panel.draw_axes(svg, Upright::Grid);
        svg.text(0.0, TEXT_PX, Anchor::Start, "label", &panel.y.label);
        svg.text(*right, top - LINE_PX - 6.0, Anchor::End, "tick", self.times.rate_label());
        svg.line([*left, *top], [*right, *top], "axis");
        let rates = self.times.rates(&panel.x);
        let rates = rates.iter().map(|(x, label)| (panel.x(*x), label.as_str())).collect();
        draw_level_ticks(svg, &spread_out(rates, 45.0), *top, -1.0);
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
        let panel @ Panel { left, right, top, bottom, .. } = &self.panel;
        for (words, error, class) in levels(trade) {
            let text = "note-in-chart";
            if panel.y.holds(error) {
                let y = panel.y(error);
                svg.line([*left, y], [*right, y], class);
                let places =
                    [[right - 4.0, y - 4.0], [right - 4.0, y + 12.0], [left + 240.0, y - 4.0]];
                labels.at(svg, &places, Anchor::End, &words, text);
            } else {
                let (arrow, y, away) = if error > panel.y.ticks.high {
                    ("↑", top + 12.0, 14.0)
                } else {
                    ("↓", bottom - 5.0, -14.0)
                };
                let places = [0.0, 1.0, 2.0, 3.0, 4.0].map(|line| [right - 4.0, y + line * away]);
                labels.at(svg, &places, Anchor::End, &format!("{words} {arrow}"), text);
            }
        }
        for (words, x) in self.times.uprights(trade) {
            if panel.x.holds(x) {
                let x = panel.x(x);
                svg.line([x, *top], [x, *bottom], "bound");
                let places = [60.0, 76.0, 92.0].map(|down| [x - 5.0, top + down]);
                labels.at(svg, &places, Anchor::End, &words, "note-in-chart");
            } else if x > panel.x.ticks.high {
                let places = [60.0, 76.0, 92.0].map(|down| [right - 4.0, top + down]);
                labels.at(svg, &places, Anchor::End, &format!("{words} →"), "note-in-chart");
            }
        }
    }

    /// Writes K beside points of the front, and what is read if that differs, as far as there is room: once for rows
    /// and once for the array.
    fn draw_notes(&self, svg: &mut Svg, trade: &Trade, labels: &mut Labels) {
        let mut known = Vec::new();
        for i in trade.front() {
            let point = &trade.points[i];
            let which = (point.whole_array, point.centres, point.readings);
            let Some(at) = self.of(trade, point).filter(|_| !known.contains(&which)) else {
                continue;
            };
            if labels.beside(svg, at, &words::brief(trade, point), "note-in-chart") {
                known.push(which);
            }
        }
    }
}
