//! The picture of a trade: the front, the chosen point, and pale what is not worth choosing.

use std::fmt::Write as _;

use taxel_core::rbf::Format;

use super::labels::Labels;
use super::scales::{Axes, AxisOfTimes, levels};
use super::words;
use crate::report::axes::{BELOW_PX, Panel, Upright, draw_level_ticks, label_width};
use crate::report::chart::{LINE_PX, Mark, Series, legend};
use crate::report::data::{Data, number};
use crate::report::format::symbol;
use crate::report::svg::{Anchor, Px, Shape, Svg, TEXT_PX, escape, text_width};
use crate::report::ticks::spread_out;
use taxel_evaluate::evaluate::trade::{Point, Trade};

/// Shape of a format's points.
fn shape(format: Format) -> Shape {
    match format {
        Format::Fixed16 => Shape::Circle,
        Format::F32 => Shape::Square,
    }
}

/// Colour of a point: by what its networks see.
fn class(point: &Point) -> &'static str {
    if point.each_row { "c1 mark" } else { "c4 mark" }
}

/// Picture in this size, and the number of points that lie outside it.
pub fn draw(trade: &Trade, [width, height]: [f64; 2]) -> (String, usize) {
    let axes = Axes::new(trade);
    let title = format!("RMSE of {} against the time of a frame", symbol(&trade.group));
    let mut svg = Svg::new(width, height, &title);
    let legend_end = legend(&mut svg, &marks(trade, &axes), width, text_width(&axes.y.label));
    let Axes { times, x, y } = axes;
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

/// Series for the legend: every mark that the picture of these `axes` has.
fn marks(trade: &Trade, axes: &Axes) -> Vec<Series> {
    let mut shown: Vec<&Point> = trade.points.iter().filter(|it| axes.hold(trade, it)).collect();
    let style = |point: &Point| {
        let format = Format::ALL.iter().rev().position(|it| *it == point.format);
        (!point.each_row, format)
    };
    let chosen = trade.chosen.map(|i| &trade.points[i]);
    let is_pale = |point: &Point| {
        !point.on_front && !chosen.is_some_and(|chosen| std::ptr::eq(point, chosen))
    };
    let pale = shown.iter().find(|point| is_pale(point)).map(|point| shape(point.format));
    let both = shown.iter().any(|p| p.each_row) && shown.iter().any(|p| !p.each_row);
    let is_chosen_shown = chosen.is_some_and(|chosen| axes.hold(trade, chosen));
    shown.sort_by_key(|point| style(point));
    shown.dedup_by_key(|point| style(point));
    let of_point = |point: &&Point| {
        let network = match (both, !point.each_row) {
            (false, _) => "",
            (true, false) => " rows",
            (true, true) => " array",
        };
        let format = point.format;
        let class = class(point).trim_end_matches(" mark");
        let name = format!("{}{network}", format.name());
        Series::new(&name, class, Mark::Points(shape(format)), vec![])
    };
    let line = Series::new("Pareto front", "front", Mark::Line, vec![]);
    let ring = Series::new("chosen", "chosen", Mark::Points(Shape::Ring), vec![]);
    let pale = pale.map(|of| Series::new("dominated", "muted dominated", Mark::Points(of), vec![]));
    let points = shown.iter().map(of_point).chain(pale);
    [line].into_iter().chain(points).chain(is_chosen_shown.then_some(ring)).collect()
}

/// All points, as a table.
pub fn data(trade: &Trade) -> Data {
    let Axes { x, y, .. } = Axes::new(trade);
    let mut data = Data::new(&["point", "on the front", "chosen", &x.label, &y.label]);
    for (i, point) in trade.points.iter().enumerate() {
        let told = [point.on_front, trade.chosen == Some(i)].map(|it| it.to_string());
        let at = [point.times.frame_ms, point.rmse(&trade.group)].map(number);
        data.lines.push([point.name()].into_iter().chain(told).chain(at).collect());
    }
    data
}

/// Place of the picture in px.
struct Place {
    times: AxisOfTimes,
    panel: Panel,
}

impl Place {
    fn of(&self, trade: &Trade, point: &Point) -> Option<[f64; 2]> {
        let (x, y) = (point.times.frame_ms, point.rmse(&trade.group));
        let inside = self.panel.x.holds(x) && self.panel.y.holds(y);
        inside.then(|| self.panel.at([x, y]))
    }

    fn draw_axes(&self, svg: &mut Svg) {
        let panel @ Panel { left, right, top, .. } = &self.panel;
        panel.draw_axes(svg, Upright::Grid);
        svg.label(0.0, TEXT_PX, Anchor::Start, "label", &panel.y.label);
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
        for (i, point) in trade.points.iter().enumerate() {
            match self.of(trade, point) {
                Some(at) if !point.on_front && trade.chosen != Some(i) => {
                    svg.path(&shape(point.format).path(at, 0.7), class(point));
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
            let path = shape(point.format).path(at, 1.0);
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
            let which = (point.each_row, point.centres, point.readings);
            let Some(at) = self.of(trade, point).filter(|_| !known.contains(&which)) else {
                continue;
            };
            if labels.beside(svg, at, &words::brief(trade, point), "note-in-chart") {
                known.push(which);
            }
        }
    }
}
