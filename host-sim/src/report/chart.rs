//! Charts: two axes, some series, and a legend or labels at the ends of lines.

use std::fmt::Write as _;

use super::axes::{Axis, BELOW_PX, Panel, Upright, label_width};
use super::data::{Data, number};
use super::format::significant;
use super::svg::{Anchor, Px, Shape, Svg, TEXT_PX, text_width};

/// Mark of a series.
#[derive(Debug, Clone, PartialEq)]
pub enum Mark {
    /// Line through the points with a shape at every one; a missing value is a gap.
    LineAnd(Shape),
    /// Shapes without a line.
    Points(Shape),
    /// Line without shapes.
    Line,
    Dashed,
    Dotted,
    /// Bars from zero, this wide on the x axis.
    Bars(f64),
    /// Names of the points, beside them; those for which there is no room are left out.
    Names(Vec<String>),
}

/// Colours and marks of series that stand beside each other, such as groups of outputs.
pub const STYLES: [(&str, Shape); 4] =
    [("c1", Shape::Circle), ("c2", Shape::Square), ("c3", Shape::Triangle), ("c4", Shape::Diamond)];

/// Series of values.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    pub name: String,
    /// Whether the name stands in the legend.
    pub is_listed: bool,
    /// CSS class, which decides on the colour.
    pub class: &'static str,
    /// Opacity, for series that are graded.
    pub opacity: f64,
    pub mark: Mark,
    /// Points [x, y]; a y that is not finite is missing.
    pub points: Vec<[f64; 2]>,
}

impl Series {
    /// Series in full colour.
    pub fn new(name: &str, class: &'static str, mark: Mark, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.into(), is_listed: true, class, opacity: 1.0, mark, points }
    }

    /// The series with a name that the legend does not have.
    #[must_use]
    pub fn unlisted(self) -> Self {
        Self { is_listed: false, ..self }
    }
}

/// Chart with two axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Title that screen readers read out.
    pub title: String,
    /// Axis along the bottom.
    pub x: Axis,
    /// Axis up the left side; its label stands above it, to be read level.
    pub y: Axis,
    /// Series, in the order in which they are drawn.
    pub series: Vec<Series>,
    /// Whether names stand at the right end of the lines instead of in a legend.
    pub end_labels: bool,
}

/// Layout of a chart.
struct Frame<'c> {
    chart: &'c Chart,
    panel: Panel,
    /// Size of marks, which shrink where they would cover each other.
    mark_size: f64,
}

/// Distance of lines of text in px.
const LINE_PX: f64 = TEXT_PX + 7.0;
const SWATCH_PX: f64 = 24.0;
/// Room between the end of a line and its name, in px.
const LEADER_PX: f64 = 26.0;
/// Largest width of a bar, in px.
const BAR_PX: f64 = 30.0;

impl Chart {
    /// Draws the chart in this size.
    pub fn draw(&self, [width, height]: [f64; 2]) -> String {
        let mut svg = Svg::new(width, height, &self.title);
        let named = self.series.iter().filter(|series| series.is_listed);
        let end_width = named.map(|s| text_width(&s.name)).fold(0.0, f64::max) + LEADER_PX;
        svg.label(0.0, TEXT_PX, Anchor::Start, "label", &self.y.label);
        let top = if self.end_labels {
            LINE_PX + 6.0
        } else {
            legend(&mut svg, &self.series, width, text_width(&self.y.label)) + 12.0
        };
        // Charts that stand above each other are aligned unless a label is long.
        let left = label_width(&self.y.ticks).max(5.0 * text_width("0")) + 10.0;
        // The last label of the level axis needs half its width.
        let last = self.x.ticks.at.last().map_or(0.0, |(_, label)| text_width(label));
        let right = width - if self.end_labels { end_width } else { (0.5 * last).max(10.0) };
        let marked = |axis: usize| self.marked().map(move |point| point[axis]);
        let [x, y] =
            [(&self.x, 0), (&self.y, 1)].map(|(axis, place)| axis.clone().with_room(marked(place)));
        let panel = Panel { x, y, left, right, top, bottom: height - BELOW_PX };
        panel.draw_axes(&mut svg, Upright::Grid);
        let most = self.series.iter().map(|series| series.points.len()).max().unwrap_or(0);
        let spacing = (right - left) / most.max(1) as f64;
        let frame = Frame { chart: self, panel, mark_size: (spacing / 9.0).clamp(0.6, 1.0) };
        for series in &self.series {
            svg.open(&opacity(series));
            frame.draw_series(&mut svg, series);
            svg.close();
        }
        if self.end_labels {
            frame.draw_end_labels(&mut svg);
        }
        svg.finish()
    }

    /// Points that have a mark.
    fn marked(&self) -> impl Iterator<Item = &[f64; 2]> {
        let has_marks = |it: &&Series| matches!(it.mark, Mark::LineAnd(_) | Mark::Points(_));
        self.series.iter().filter(has_marks).flat_map(|series| &series.points)
    }

    /// All points, by series.
    pub fn data(&self) -> Data {
        let mut data = Data::new(&["series", &self.x.label, &self.y.label]);
        for series in self.series.iter().filter(|it| !matches!(it.mark, Mark::Names(_))) {
            let line = |[x, y]: &[f64; 2]| vec![series.name.clone(), number(*x), number(*y)];
            data.lines.extend(series.points.iter().map(line));
        }
        data
    }
}

fn opacity(series: &Series) -> String {
    if series.opacity < 1.0 {
        format!(r#" opacity="{:.2}""#, series.opacity)
    } else {
        String::new()
    }
}

/// Draws names and marks: beside the label of the y axis where there is room, otherwise below it.
/// Returns the y coordinate at which the legend ends.
fn legend(svg: &mut Svg, series: &[Series], width: f64, label_width: f64) -> f64 {
    let named: Vec<_> = series.iter().filter(|series| series.is_listed).collect();
    let entry = |series: &Series| SWATCH_PX + text_width(&series.name) + 14.0;
    let total: f64 = named.iter().map(|series| entry(series)).sum();
    let beside = label_width + 24.0 + total <= width;
    let (mut x, mut y) = if beside || named.is_empty() {
        (width - total, TEXT_PX)
    } else {
        (0.0, TEXT_PX + LINE_PX)
    };
    for series in named {
        if x > 0.0 && x + entry(series) > width + 14.0 {
            (x, y) = (0.0, y + LINE_PX);
        }
        svg.open(&opacity(series));
        swatch(svg, series, [x, y - TEXT_PX * 0.35]);
        svg.close();
        svg.text(x + SWATCH_PX, y, Anchor::Start, "tick", &series.name);
        x += entry(series);
    }
    y
}

fn swatch(svg: &mut Svg, series: &Series, [x, y]: [f64; 2]) {
    let middle = [x + SWATCH_PX / 2.0 - 3.0, y];
    let line = |svg: &mut Svg, style: &str| {
        svg.line([x, y], [x + SWATCH_PX - 6.0, y], &format!("{} {style}", series.class));
    };
    match &series.mark {
        Mark::Line => line(svg, "line"),
        Mark::Dashed => line(svg, "line dashed"),
        Mark::Dotted => line(svg, "line dotted"),
        Mark::LineAnd(shape) => {
            line(svg, "line");
            svg.path(&shape.path(middle, 1.0), &format!("{} mark", series.class));
        }
        Mark::Points(shape) => {
            svg.path(&shape.path(middle, 1.0), &format!("{} mark", series.class));
        }
        Mark::Bars(_) => {
            let class = format!("{} mark", series.class);
            svg.rect([x + 3.0, y - 5.0], [11.0, 10.0], &class, "");
        }
        Mark::Names(_) => {}
    }
}

impl Frame<'_> {
    fn draw_series(&self, svg: &mut Svg, series: &Series) {
        let class = |style: &str| format!("{} {style}", series.class);
        let present = |[_, y]: &&[f64; 2]| y.is_finite();
        match &series.mark {
            Mark::Line => self.draw_line(svg, series, &class("line")),
            Mark::Dashed => self.draw_line(svg, series, &class("line dashed")),
            Mark::Dotted => self.draw_line(svg, series, &class("line dotted")),
            Mark::LineAnd(shape) => {
                self.draw_line(svg, series, &class("line"));
                self.draw_points(svg, series, *shape, &class("mark"));
            }
            Mark::Points(shape) => self.draw_points(svg, series, *shape, &class("mark")),
            Mark::Bars(width) => {
                for [x, y] in series.points.iter().filter(present) {
                    let px = (self.panel.x(width / 2.0) - self.panel.x(-width / 2.0)).min(BAR_PX);
                    let (a, b) = (self.panel.y(*y), self.panel.y(0.0));
                    let corner = [self.panel.x(*x) - px / 2.0, a.min(b)];
                    svg.rect(corner, [px, (a - b).abs()], &class("mark"), "");
                }
            }
            Mark::Names(names) => self.draw_names(svg, series, names),
        }
    }

    /// Draws a line, broken at missing values and at values off the scale.
    fn draw_line(&self, svg: &mut Svg, series: &Series, class: &str) {
        let mut d = String::new();
        let mut pen = 'M';
        for [x, y] in &series.points {
            if self.panel.y.holds(*y) {
                // Writing to a string cannot fail.
                let _ = write!(d, "{pen}{} {}", Px(self.panel.x(*x)), Px(self.panel.y(*y)));
                pen = 'L';
            } else {
                pen = 'M';
            }
        }
        if !d.is_empty() {
            svg.path(&d, class);
        }
    }

    fn draw_points(&self, svg: &mut Svg, series: &Series, shape: Shape, class: &str) {
        for [x, y] in &series.points {
            let place = [self.panel.x(*x), self.panel.y(*y)];
            if self.panel.y.holds(*y) {
                svg.path(&shape.path(place, self.mark_size), class);
            } else if *y > self.panel.y.ticks.high {
                // A value off the scale is an arrow at the edge, with the value beside it.
                let x = place[0];
                svg.path(&Shape::Triangle.path([x, self.panel.top + 5.0], 1.0), class);
                let label = significant(*y, 2);
                svg.text(x + 8.0, self.panel.top + 11.0, Anchor::Start, "tick", &label);
            }
        }
    }

    /// Writes names beside points: below them to the left, or else where there is room. Those that would cover a mark or a name
    /// before are left out.
    fn draw_names(&self, svg: &mut Svg, series: &Series, names: &[String]) {
        let marks: Vec<[f64; 2]> = self.chart.marked().map(|point| self.panel.at(*point)).collect();
        let mut taken: Vec<[f64; 3]> = Vec::new();
        for (point, name) in series.points.iter().zip(names) {
            let ([x, y], width) = (self.panel.at(*point), text_width(name));
            let (below, above) = (y + TEXT_PX + 2.0, y - 6.0);
            let (left, right) = (x - 6.0 - width, x + 6.0);
            let is_free = |[from, baseline]: &[f64; 2]| {
                let to = from + width;
                let covers_name = |[other, end, at]: &[f64; 3]| {
                    from < end && to > *other && (baseline - at).abs() < TEXT_PX
                };
                let covers_mark = |[x, y]: &[f64; 2]| {
                    (from - 4.0..to + 4.0).contains(x)
                        && (baseline - TEXT_PX..baseline + 4.0).contains(y)
                };
                let Panel { left, right, top, bottom, .. } = self.panel;
                *from > left
                    && to < right
                    && baseline - TEXT_PX > top
                    && *baseline < bottom
                    && !taken.iter().any(covers_name)
                    && !marks.iter().any(covers_mark)
            };
            let places = [[left, below], [right, above], [left, above], [right, below]];
            if let Some([from, baseline]) = places.into_iter().find(is_free) {
                taken.push([from, from + width, baseline]);
                let (at, anchor) =
                    if from < x { (from + width, Anchor::End) } else { (from, Anchor::Start) };
                svg.text(at, baseline, anchor, series.class, name);
            }
        }
    }

    /// Writes names at the last points of their lines, moved apart where they would overlap.
    fn draw_end_labels(&self, svg: &mut Svg) {
        const GAP: f64 = TEXT_PX + 3.0;
        let named = self.chart.series.iter().filter(|series| series.is_listed);
        // Place of the line's end, height of its name, and the series.
        let mut labels: Vec<([f64; 2], f64, &Series)> = named
            .filter_map(|series| {
                let [x, y] = series.points.iter().rev().find(|[_, y]| y.is_finite())?;
                let y = self.panel.y(y.min(self.panel.y.ticks.high));
                Some(([self.panel.x(*x), y], y, series))
            })
            .collect();
        labels.sort_by(|a, b| a.1.total_cmp(&b.1));
        let heights: Vec<f64> = labels.iter().map(|label| label.1).collect();
        let heights = apart(&heights, GAP, [self.panel.top, self.panel.bottom]);
        for (label, height) in labels.iter_mut().zip(heights) {
            label.1 = height;
        }
        for ([x, end], y, series) in labels {
            // A thin line leads from the end of the line to its name.
            let from = [x + 6.0, end];
            let to = [self.panel.right + LEADER_PX - 4.0, y];
            svg.line(from, to, &format!("{} thin", series.class.replace(" broken", "")));
            let class = format!("{} name", series.class);
            let x = self.panel.right + LEADER_PX;
            svg.text(x, y + TEXT_PX * 0.35, Anchor::Start, &class, &series.name);
        }
    }
}

/// Places as near to the `wanted` ones (ascending) as they can be with this `gap` between them, and within `bounds` if
/// there is room.
fn apart(wanted: &[f64], gap: f64, [low, high]: [f64; 2]) -> Vec<f64> {
    // Neighbours that are too close share what is moved: pools of a mean place, and their number.
    let mut pools: Vec<(f64, usize)> = Vec::new();
    for (i, place) in wanted.iter().enumerate() {
        pools.push((place - gap * i as f64, 1));
        while let [.., (a, n), (b, m)] = pools[..]
            && a > b
        {
            pools.truncate(pools.len() - 2);
            pools.push(((a * n as f64 + b * m as f64) / (n + m) as f64, n + m));
        }
    }
    let most = high - gap * wanted.len().saturating_sub(1) as f64;
    let levels = pools.iter().flat_map(|(level, count)| std::iter::repeat_n(*level, *count));
    levels.enumerate().map(|(i, level)| level.max(low).min(most) + gap * i as f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::ticks;

    fn chart(mark: Mark, values: &[f64]) -> Chart {
        let points = values.iter().enumerate().map(|(i, y)| [i as f64, *y]).collect();
        Chart {
            title: "a chart".into(),
            x: Axis::linear("x", ticks::linear([0.0, 4.0], 4)),
            y: Axis::linear("y", ticks::linear([-1.0, 1.0], 4)),
            series: vec![Series::new("values", "c1", mark, points).unlisted()],
            end_labels: false,
        }
    }

    #[test]
    fn data_has_every_point_of_every_series() {
        let mut chart = chart(Mark::Line, &[0.5, f64::NAN, 0.1 + 0.2]);
        let other = Series::new("bars, of it", "c2", Mark::Bars(1.0), vec![[7.0, -1.0]]);
        chart.series.push(other);
        chart.y.label = "RMSE of Δz (mm)".into();
        let data = chart.data();
        assert_eq!(data.heads, ["series", "x", "RMSE of Δz (mm)"]);
        let lines: Vec<String> = data.lines.iter().map(|line| line.join("|")).collect();
        let all = ["values|0|0.5", "values|1|", "values|2|0.30000000000000004", "bars, of it|7|-1"];
        assert_eq!(lines, all);
    }

    #[test]
    fn a_missing_value_is_a_gap_and_never_zero() {
        let values = [0.5, f64::NAN, 0.5, 1.0, f64::INFINITY];
        let line = chart(Mark::Dashed, &values).draw([400.0, 200.0]);
        let path = line.split("<path d=\"").nth(1).unwrap().split('"').next().unwrap();
        assert_eq!(path.matches('M').count(), 2, "{path}");
        assert_eq!(path.matches('L').count(), 1, "{path}");
        let bars = chart(Mark::Bars(0.8), &values).draw([400.0, 200.0]);
        assert_eq!(bars.matches("<rect").count(), 3);
        let points = chart(Mark::LineAnd(Shape::Square), &values[..4]).draw([400.0, 200.0]);
        assert_eq!(points.matches("c1 mark").count(), 3);
    }

    #[test]
    fn labels_overlap_nothing_and_stay_within_the_panel() {
        let written = |y: f64, marks: Vec<[f64; 2]>| {
            let mut chart = chart(Mark::Names((0..40).map(|i| format!("K {i}")).collect()), &[]);
            chart.series[0].points = (0..40).map(|i| [0.1 * f64::from(i), y]).collect();
            assert!(chart.data().lines.is_empty(), "places of names are those of other series");
            chart.series.push(Series::new("marks", "c1", Mark::Points(Shape::Circle), marks));
            let picture = chart.draw([400.0, 200.0]);
            let heights = picture.split("<text ").filter(|text| text.contains(">K "));
            let heights = heights.map(|text| {
                let height = text.split("y=\"").nth(1).unwrap().split('"').next().unwrap();
                height.parse::<f64>().unwrap()
            });
            heights.collect::<Vec<_>>()
        };
        let free = written(0.5, vec![]);
        assert!((6..30).contains(&free.len()), "{free:?}");
        let at_the_bottom = written(-1.0, vec![]);
        let lowest = at_the_bottom.iter().copied().fold(0.0, f64::max);
        assert!(!at_the_bottom.is_empty() && lowest < 200.0 - BELOW_PX, "{at_the_bottom:?}");
        let grid = |i: i32| [0.05 * f64::from(i % 80), 0.05 * f64::from(i / 80) - 1.0];
        assert_eq!(written(0.5, (0..3200).map(grid).collect()), [0.0; 0], "marks everywhere");
    }

    #[test]
    fn no_mark_is_on_the_frame() {
        let chart = chart(Mark::Points(Shape::Circle), &[1.0, -1.0, 0.0, 0.0, 0.5]);
        let axis = chart.y.clone().with_room([1.0, -1.0].into_iter());
        assert!(axis.ticks.low < -1.05 && axis.ticks.high > 1.05, "{:?}", axis.ticks);
        let within = chart.y.clone().with_room([0.9, -0.9].into_iter());
        assert_eq!(within, chart.y, "marks that have room");
        let none = chart.y.clone().with_room([7.0, f64::NAN].into_iter());
        assert_eq!(none, chart.y, "values off the scale");
    }

    #[test]
    fn places_move_apart_by_as_little_as_they_can() {
        assert_eq!(apart(&[10.0, 40.0], 15.0, [0.0, 100.0]), [10.0, 40.0]);
        assert_eq!(apart(&[50.0, 50.0, 90.0], 10.0, [0.0, 100.0]), [45.0, 55.0, 90.0]);
        assert_eq!(apart(&[98.0, 99.0], 10.0, [0.0, 100.0]), [90.0, 100.0]);
        assert_eq!(apart(&[1.0, 2.0], 10.0, [0.0, 100.0]), [0.0, 10.0]);
    }
}
