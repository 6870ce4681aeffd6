//! Maps over a face: coloured cells with their numbers, or arrows.

use super::axes::{Panel, Upright};
use super::colour::ColourScale;
use super::data::{Data, number};
use super::face::Face;
use super::figures::Panel as Drawn;
use super::format::{fixed, significant};
use super::svg::{Anchor, Px, Svg, TEXT_PX, escape, polyline, text_width};
use super::ticks;
use super::voronoi;

/// Width of a map in px.
pub const WIDTH: f64 = 310.0;
/// Cells of maps of a kind that have a hover text at most: more would make the page large.
const MOST_HOVERS: usize = 3000;
/// Width of a number in a cell relative to other text.
const SMALL: f64 = 11.0 / TEXT_PX;

/// Drawing of a face, to which values are added.
pub struct Map<'f> {
    face: &'f Face,
    heading: String,
    svg: Svg,
    panel: Panel,
}

/// Values over a face.
#[derive(Debug, Clone, PartialEq)]
pub struct Values<'v> {
    /// Value of each cell; one that is not finite, or missing at the end, leaves its cell empty.
    pub of_cells: &'v [f64],
    pub scale: &'v ColourScale,
    /// Quantity with its unit, for the bar below the map.
    pub label: &'v str,
    /// Unit, for hover texts.
    pub unit: &'v str,
    /// Number of maps of this kind on the page: with many, those of many cells have no hover texts.
    pub shown: usize,
}

impl<'f> Map<'f> {
    /// Empty map of `face`. Screen readers read out `title`; `heading` stands above.
    pub fn new(face: &'f Face, title: &str, heading: &str, below: f64) -> Self {
        let (left, right, top) = (34.0, WIDTH - 28.0, 42.0);
        let bottom = top + (right - left) * face.height_over_width;
        let mut svg = Svg::new(WIDTH, bottom + 46.0 + below, title);
        svg.label(left, TEXT_PX, Anchor::Start, "label", heading);
        svg.text(0.0, top - 9.0, Anchor::Start, "tick", &face.axes[1].label);
        let [x, y] = face.axes.clone();
        let heading = heading.to_owned();
        let mut map = Self { face, heading, svg, panel: Panel { x, y, left, right, top, bottom } };
        if let Some([x, y]) = face.outline {
            let (corner, end) = (map.place([0.0, y]), map.place([x, 0.0]));
            map.svg.rect(corner, [end[0] - corner[0], end[1] - corner[1]], "face", "");
        }
        map
    }

    /// Place of a point in px.
    pub fn place(&self, point: [f64; 2]) -> [f64; 2] {
        self.panel.at(point)
    }

    /// Drawing to which marks are added.
    pub fn svg(&mut self) -> &mut Svg {
        &mut self.svg
    }

    /// Draws coloured cells, and the bar of their colours below.
    pub fn values(mut self, values: &Values<'_>) -> Drawn {
        let decimals = values.scale.decimals();
        let hover = values.shown * self.face.cells.len() <= MOST_HOVERS;
        let value_of = |place: usize| values.of_cells.get(place).copied().unwrap_or(f64::NAN);
        for (place, cell) in self.face.cells.iter().enumerate() {
            let value = value_of(place);
            let outline: Vec<[f64; 2]> = cell.outline.iter().map(|p| self.place(*p)).collect();
            let middle = self.place(cell.middle);
            let title = if hover {
                let value =
                    if value.is_finite() { significant(value, 3) } else { "missing".into() };
                format!("<title>{}: {value} {}</title>", self.face.name(place), escape(values.unit))
            } else {
                String::new()
            };
            if !value.is_finite() {
                self.svg.add(format_args!(
                    r#"<text x="{}" y="{}" text-anchor="middle" class="tick">×{title}</text>"#,
                    Px(middle[0]),
                    Px(middle[1] + TEXT_PX * 0.35)
                ));
                continue;
            }
            let (class, opacity) = values.scale.colour(value);
            // Corners where more than two cells meet stand twice.
            let mut corners = outline.clone();
            corners.dedup_by(|a, b| (a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 0.1);
            let d = polyline(&corners);
            self.svg.add(format_args!(
                r#"<path d="{d}Z" class="{class} cell-of-map" fill-opacity="{opacity:.2}">{title}</path>"#
            ));
            self.number(&outline, middle, &fixed(value, decimals), opacity);
        }
        self.axes();
        let (left, right, top) = (self.panel.left, self.panel.right, self.panel.bottom + 50.0);
        values.scale.draw_bar(&mut self.svg, [left, right], top, values.label);
        let data = self.face.data(&["value", "unit"], |place| {
            vec![number(value_of(place)), values.unit.to_owned()]
        });
        self.drawn(data)
    }

    /// Writes the number of a cell where it fits into the outline.
    fn number(&mut self, outline: &[[f64; 2]], middle: [f64; 2], number: &str, opacity: f64) {
        let Some([left, right]) = voronoi::chord(outline, middle, 0) else { return };
        let x = f64::midpoint(left, right);
        let Some([above, below]) = voronoi::chord(outline, [x, middle[1]], 1) else { return };
        if right - left < SMALL * text_width(number) + 3.0 || below - above < TEXT_PX {
            return;
        }
        let y = middle[1].clamp(above + 7.0, below - 6.0) + TEXT_PX * 0.3;
        let class = if opacity > 0.68 { "cell full" } else { "cell" };
        let (x, y) = (Px(x), Px(y));
        self.svg.add(format_args!(r#"<text x="{x}" y="{y}" class="{class}">{number}</text>"#));
    }

    /// Draws an arrow for each cell and finishes the map: one of `truth` and one of `estimate`, x and y. The `longest`
    /// of all is as long as neighbours are apart.
    pub fn arrows(
        mut self,
        [truth, estimate]: [[&[f64]; 2]; 2],
        longest: f64,
        unit: &str,
    ) -> Drawn {
        let px_per_mm = self.panel.x(1.0) - self.panel.x(0.0);
        let scale = 0.95 * self.face.spacing() * px_per_mm / longest;
        let scale = scale * self.room([truth, estimate], scale);
        let hover = 3 * self.face.cells.len() <= MOST_HOVERS;
        for (i, cell) in self.face.cells.iter().enumerate() {
            let from = self.place(cell.middle);
            let mut vectors = vec![];
            for ([x, y], class) in [(truth, "truth"), (estimate, "c1")] {
                if (x[i] + y[i]).is_finite() {
                    let [dx, dy] = [scale * x[i], -scale * y[i]];
                    self.arrow([from[0] - dx / 2.0, from[1] - dy / 2.0], [dx, dy], class);
                    vectors.push(format!("{}, {}", significant(x[i], 2), significant(y[i], 2)));
                }
            }
            if hover && let [truth, estimate] = &vectors[..] {
                let text = escape(&format!(
                    "{}: true {truth}; decoded {estimate} {unit}",
                    self.face.name(i)
                ));
                self.svg.circle(from, 9.0, "sensitive", &format!("<title>{text}</title>"));
            }
        }
        self.axes();
        let y = self.panel.bottom + 60.0;
        let mut x = self.panel.left;
        for (name, class) in [("true", "truth"), ("decoded", "c1")] {
            self.arrow([x, y], [20.0, 0.0], class);
            self.svg.text(x + 25.0, y + TEXT_PX * 0.35, Anchor::Start, "tick", name);
            x += 36.0 + 0.8 * text_width(name);
        }
        let length = format!("{} {unit}", significant(longest, 2));
        let full = scale * longest;
        let start = self.panel.right + 20.0 - text_width(&length) - full - 4.0;
        self.svg.line([start, y - 4.0], [start, y + 4.0], "axis");
        self.svg.line([start, y], [start + full, y], "axis");
        self.svg.line([start + full, y - 4.0], [start + full, y + 4.0], "axis");
        self.svg.text(self.panel.right + 20.0, y + TEXT_PX * 0.35, Anchor::End, "tick", &length);
        let heads =
            ["true", "decoded"].map(|of| ["x", "y"].map(|axis| format!("{of} {axis} ({unit})")));
        let heads: Vec<&str> = heads.as_flattened().iter().map(String::as_str).collect();
        let data = self.face.data(&heads, |place| {
            [truth, estimate].as_flattened().iter().map(|of| number(of[place])).collect()
        });
        self.drawn(data)
    }

    /// Factor, at most 1, with which all arrows of this `scale` in px end inside the map; never less than a half, lest one
    /// electrode at the edge make all arrows short.
    fn room(&self, vectors: [[&[f64]; 2]; 2], scale: f64) -> f64 {
        let mut room: f64 = 1.0;
        for (i, cell) in self.face.cells.iter().enumerate() {
            let [x, y] = self.place(cell.middle);
            let sides = [
                (x - self.panel.left).min(self.panel.right - x),
                (y - self.panel.top).min(self.panel.bottom - y),
            ];
            for vector in &vectors {
                for (component, side) in vector.iter().zip(sides) {
                    let half = 0.5 * scale * component[i].abs();
                    // A missing component compares as false.
                    if half > side {
                        room = room.min(side / half);
                    }
                }
            }
        }
        room.max(0.5)
    }

    fn arrow(&mut self, [x, y]: [f64; 2], [dx, dy]: [f64; 2], class: &str) {
        let length = dx.hypot(dy);
        if length < 1.5 {
            // Too short for an arrow: a dot.
            self.svg.circle([x, y], 1.2, &format!("{class} mark"), "");
            return;
        }
        let (end, head) = ([x + dx, y + dy], (0.35 * length).clamp(2.0, 5.0));
        let (along, across) = ([dx / length, dy / length], [-dy / length, dx / length]);
        let corner = |side: f64| {
            [0, 1].map(|axis| end[axis] - head * along[axis] + side * 0.5 * head * across[axis])
        };
        let (shaft, tip) = (polyline(&[[x, y], end]), polyline(&[corner(1.0), end, corner(-1.0)]));
        self.svg.path(&(shaft + &tip), &format!("{class} arrow"));
    }

    /// Draws the outline, ticks and labels.
    fn axes(&mut self) {
        let Face { outline, row_wires, .. } = self.face;
        let Panel { left, right, top, bottom, .. } = self.panel;
        let (corner, end) = match outline {
            Some([x, y]) => (self.place([0.0, *y]), self.place([*x, 0.0])),
            None => ([left, top], [right, bottom]),
        };
        self.svg.rect(corner, [end[0] - corner[0], end[1] - corner[1]], "outline", "");
        self.panel.draw_axes(&mut self.svg, Upright::Marks);
        if !row_wires.is_empty() {
            self.svg.text(WIDTH, self.panel.top - 9.0, Anchor::End, "tick", "row-wire");
        }
        let places = row_wires.iter().map(|(number, at)| (self.panel.y(*at), *number)).collect();
        for (y, number) in ticks::spread_out(places, TEXT_PX) {
            let (x, y) = (right + 8.0, y + TEXT_PX * 0.35);
            self.svg.text(x, y, Anchor::Start, "tick", &number.to_string());
        }
    }

    /// Finishes a map whose marks were added by hand.
    pub fn finish(mut self, data: Data) -> Drawn {
        self.axes();
        self.drawn(data)
    }

    fn drawn(self, data: Data) -> Drawn {
        Drawn { heading: self.heading, drawing: self.svg.finish(), data }
    }
}
