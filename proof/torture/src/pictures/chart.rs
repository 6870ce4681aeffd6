//! A chart of lines on two logarithmic axes.

use std::fmt::Write as _;

/// Points [x, y].
pub type Points = Vec<[f64; 2]>;

/// Line through points; it ends with a cross if what lies beyond is refused.
pub struct Line {
    pub name: &'static str,
    /// Colour, from 1 to 4, or 0 for grey.
    pub colour: u8,
    pub dashed: bool,
    pub points: Points,
    /// Ends that are marked by a cross.
    pub crosses: Points,
}

/// Chart with the range of its axes.
pub struct Chart {
    pub title: &'static str,
    pub x_label: &'static str,
    pub y_label: &'static str,
    pub x: [f64; 2],
    pub y: [f64; 2],
    /// Powers of ten between two labels, along x and along y.
    pub steps: [i32; 2],
    pub lines: Vec<Line>,
}

const SIZE: [f64; 2] = [820.0, 400.0];
/// Left, right, upper and lower edge of the plot.
const LEFT: f64 = 62.0;
const RIGHT: f64 = 610.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 348.0;
/// Least distance of two names.
const NAME_PX: f64 = 17.0;

const STYLE: &str = "<style>
:root { color-scheme: light dark; --paper: #ffffff; --ink: #1b1f24; --soft: #545b64; --grid: #e6e9ec;
  --c0: #7a828b; --c1: #0b5cad; --c2: #bf4e00; --c3: #00785a; --c4: #7a3aa8; }
@media (prefers-color-scheme: dark) { :root { --paper: #14171b; --ink: #e8ebee; --soft: #a7b0ba; --grid: #2a3037;
  --c0: #98a1ab; --c1: #6db3f8; --c2: #f2994a; --c3: #4fcaa2; --c4: #c79af2; } }
svg { background: var(--paper); font: 13px system-ui, \"Segoe UI\", Arial, sans-serif; }
text { fill: var(--ink); } .tick { fill: var(--soft); font-size: 12px; } .grid { stroke: var(--grid); }
.line { fill: none; stroke-width: 2; } .dashed { stroke-dasharray: 5 4; stroke-width: 1.5; }
.c0 { stroke: var(--c0); } .c1 { stroke: var(--c1); } .c2 { stroke: var(--c2); } .c3 { stroke: var(--c3); }
.c4 { stroke: var(--c4); } text.c0 { fill: var(--c0); } text.c1 { fill: var(--c1); } text.c2 { fill: var(--c2); }
text.c3 { fill: var(--c3); } text.c4 { fill: var(--c4); } text { stroke: none !important; }
</style>
";

impl Chart {
    /// Chart as an SVG file.
    pub fn draw(&self) -> String {
        let [width, height] = SIZE;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} \
             {height}\" role=\"img\" aria-label=\"{}\">\n{STYLE}",
            self.title
        );
        self.draw_axes(&mut svg);
        for line in &self.lines {
            self.draw_line(&mut svg, line);
        }
        self.draw_names(&mut svg);
        svg + "</svg>\n"
    }

    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let place = |value: f64, [low, high]: [f64; 2]| {
            ((value / low).log10() / (high / low).log10()).clamp(0.0, 1.0)
        };
        [LEFT + (RIGHT - LEFT) * place(x, self.x), BOTTOM - (BOTTOM - TOP) * place(y, self.y)]
    }

    fn draw_axes(&self, svg: &mut String) {
        // Writing to a string cannot fail.
        let _ = writeln!(svg, "<text x=\"0\" y=\"14\">{}</text>", self.y_label);
        let middle = 0.5 * (LEFT + RIGHT);
        let _ = writeln!(
            svg,
            "<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            BOTTOM + 42.0,
            self.x_label
        );
        for power in powers(self.x, self.steps[0]) {
            let [x, _] = self.at([10_f64.powi(power), self.y[0]]);
            let _ = writeln!(
                svg,
                "<line class=\"grid\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{TOP}\" y2=\"{BOTTOM}\"/><text class=\"tick\" \
                 x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                BOTTOM + 18.0,
                label(power)
            );
        }
        for power in powers(self.y, self.steps[1]) {
            let [_, y] = self.at([self.x[0], 10_f64.powi(power)]);
            let _ = writeln!(
                svg,
                "<line class=\"grid\" x1=\"{LEFT}\" x2=\"{RIGHT}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/><text class=\"tick\" \
                 x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                LEFT - 6.0,
                y + 4.0,
                label(power)
            );
        }
    }

    fn draw_line(&self, svg: &mut String, line: &Line) {
        let points = line.points.iter().map(|point| {
            let [x, y] = self.at(*point);
            format!("{x:.1},{y:.1}")
        });
        let points: Vec<String> = points.collect();
        let dashed = if line.dashed { " dashed" } else { "" };
        let _ = writeln!(
            svg,
            "<polyline class=\"line c{}{dashed}\" points=\"{}\"/>",
            line.colour,
            points.join(" ")
        );
        for cross in &line.crosses {
            let [x, y] = self.at(*cross);
            let (left, right, top, bottom) = (x - 5.0, x + 5.0, y - 5.0, y + 5.0);
            let _ = writeln!(
                svg,
                "<path class=\"line c{}\" d=\"M{left:.1} {top:.1}L{right:.1} {bottom:.1}M{left:.1} {bottom:.1}L{right:.1} \
                 {top:.1}\"/>",
                line.colour
            );
        }
    }

    /// Names beside the right ends of the lines, moved apart where they would overlap.
    fn draw_names(&self, svg: &mut String) {
        let mut ends: Vec<(f64, &Line)> = Vec::new();
        for line in &self.lines {
            if let Some(last) = line.points.last() {
                ends.push((self.at(*last)[1], line));
            }
        }
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut lowest = TOP - NAME_PX;
        let rest = ends.len();
        for (place, (y, line)) in ends.into_iter().enumerate() {
            let most = BOTTOM - NAME_PX * (rest - 1 - place) as f64;
            let y = y.min(most).max(lowest + NAME_PX);
            lowest = y;
            let _ = writeln!(
                svg,
                "<text class=\"c{}\" x=\"{}\" y=\"{:.1}\">{}</text>",
                line.colour,
                RIGHT + 8.0,
                y + 4.0,
                line.name
            );
        }
    }
}

/// Powers of ten with a label in a range.
fn powers([low, high]: [f64; 2], step: i32) -> impl Iterator<Item = i32> {
    let [first, last] = [low, high].map(|value| value.log10().round() as i32);
    (first..=last).filter(move |power| power % step == 0)
}

/// Number as text: plain where it is short.
fn label(power: i32) -> String {
    match power {
        0 => "1".into(),
        1 => "10".into(),
        2 => "100".into(),
        -1 => "0.1".into(),
        -2 => "0.01".into(),
        _ => format!("1e{power}"),
    }
}
