//! Maps of values over the sensor's face, as coloured cells with their numbers.

use super::format::fixed;
use super::svg::{Anchor, Svg, TEXT_PX, text_width};
use super::ticks::{self, Ticks};

/// Map of values over the face.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// Title that screen readers read out.
    pub title: String,
    /// Heading above the map.
    pub heading: String,
    /// Extent of the face in x and y.
    pub face_mm: [f64; 2],
    /// Extent of one electrode's cell in x and y.
    pub cell_mm: [f64; 2],
    /// Centre and value of every cell; a value that is not finite leaves its cell empty.
    pub cells: Vec<([f64; 2], f64)>,
    /// Number of every row-wire, and its height y on the face.
    pub row_wires: Vec<(usize, f64)>,
}

/// Colour scale: no colour at zero, ever fuller away from it, one hue above and one below.
#[derive(Debug, Clone, PartialEq)]
pub struct ColourScale(Ticks);

const WIDTH: f64 = 310.0;

impl ColourScale {
    /// Scale that covers zero and all of `values`.
    pub fn new(values: impl IntoIterator<Item = f64>) -> Self {
        Self(ticks::linear(values.into_iter().chain([0.0]), 4))
    }

    /// CSS class and opacity for `value`.
    fn colour(&self, value: f64) -> (&'static str, f64) {
        let most = self.0.low.abs().max(self.0.high.abs());
        (if value < 0.0 { "below" } else { "above" }, (value.abs() / most).min(1.0))
    }

    /// Draws the bar that explains the colours; `label` names the quantity and its unit.
    pub fn draw_bar(&self, title: &str, label: &str) -> String {
        let Ticks { low, high, at } = &self.0;
        let (left, right, top, height) = (24.0, WIDTH - 24.0, 2.0, 14.0);
        let x = |value: f64| left + (value - low) / (high - low) * (right - left);
        let mut svg = Svg::new(WIDTH, 60.0, title);
        for (id, from, to) in [("scale-below", *low, 0.0), ("scale-above", 0.0, *high)] {
            if to > from {
                let end = |offset, value: f64, class: &str| {
                    let opacity = self.colour(value).1;
                    format!(
                        r#"<stop offset="{offset}" class="{class}" stop-opacity="{opacity:.3}"/>"#
                    )
                };
                let class = self.colour(f64::midpoint(from, to)).0;
                svg.add(format_args!(
                    r#"<defs><linearGradient id="{id}">{}{}</linearGradient></defs>"#,
                    end(0, from, class),
                    end(1, to, class)
                ));
                let fill = format!(r#" fill="url(#{id})""#);
                svg.rect([x(from), top], [x(to) - x(from), height], "bar", &fill);
            }
        }
        svg.rect([left, top], [right - left, height], "outline", "");
        for (value, tick) in at {
            let x = x(*value);
            svg.line([x, top + height], [x, top + height + 4.0], "axis");
            svg.text(x, top + height + 17.0, Anchor::Middle, "tick", tick);
        }
        svg.text(f64::midpoint(left, right), 56.0, Anchor::Middle, "label", label);
        svg.finish()
    }
}

impl HeatMap {
    /// Draws the map in the colours of `scale`.
    pub fn draw(&self, scale: &ColourScale) -> String {
        let half = [self.cell_mm[0] / 2.0, self.cell_mm[1] / 2.0];
        // Electrodes may be listed outside the face.
        let extent = |axis: usize| {
            let ends = self
                .cells
                .iter()
                .flat_map(|(centre, _)| [centre[axis] - half[axis], centre[axis] + half[axis]]);
            ticks::extent(ends.chain([0.0, self.face_mm[axis]])).unwrap_or((0.0, 1.0))
        };
        let ((x_low, x_high), (y_low, y_high)) = (extent(0), extent(1));
        let (left, right, top) = (32.0, WIDTH - 30.0, 42.0);
        let px_per_mm = (right - left) / (x_high - x_low);
        let bottom = top + (y_high - y_low) * px_per_mm;
        let x = |mm: f64| left + (mm - x_low) * px_per_mm;
        let y = |mm: f64| bottom - (mm - y_low) * px_per_mm;

        let mut svg = Svg::new(WIDTH, bottom + 46.0, &self.title);
        svg.text(left, TEXT_PX, Anchor::Start, "label", &self.heading);
        svg.text(0.0, top - 9.0, Anchor::Start, "tick", "y (mm)");
        svg.text(WIDTH, top - 9.0, Anchor::End, "tick", "row-wire");
        let face = [self.face_mm[0] * px_per_mm, self.face_mm[1] * px_per_mm];
        svg.rect([x(0.0), y(self.face_mm[1])], face, "face", "");
        let size = [self.cell_mm[0] * px_per_mm, self.cell_mm[1] * px_per_mm];
        let numbers_fit = size[0] > text_width("0.00") && size[1] > TEXT_PX;
        for (centre, value) in &self.cells {
            let corner = [x(centre[0] - half[0]), y(centre[1] + half[1])];
            let middle = [x(centre[0]), y(centre[1]) + TEXT_PX * 0.35];
            if !value.is_finite() {
                svg.text(middle[0], middle[1], Anchor::Middle, "tick", "×");
                continue;
            }
            let (class, opacity) = scale.colour(*value);
            svg.rect(corner, size, class, &format!(r#" fill-opacity="{opacity:.3}""#));
            if numbers_fit {
                let class = if opacity > 0.68 { "cell full" } else { "cell" };
                svg.text(middle[0], middle[1], Anchor::Middle, class, &fixed(*value, 2));
            }
        }
        svg.rect([x(0.0), y(self.face_mm[1])], face, "outline", "");
        let inside = |ticks: Ticks, high: f64| ticks.at.into_iter().filter(move |t| t.0 <= high);
        for (value, label) in inside(ticks::linear([0.0, self.face_mm[0]], 4), x_high) {
            svg.line([x(value), bottom], [x(value), bottom + 4.0], "axis");
            svg.text(x(value), bottom + 18.0, Anchor::Middle, "tick", &label);
        }
        for (value, label) in inside(ticks::linear([0.0, self.face_mm[1]], 4), y_high) {
            svg.line([left - 4.0, y(value)], [left, y(value)], "axis");
            svg.text(left - 7.0, y(value) + TEXT_PX * 0.35, Anchor::End, "tick", &label);
        }
        for (number, height_mm) in &self.row_wires {
            let y = y(*height_mm) + TEXT_PX * 0.35;
            svg.text(right + 8.0, y, Anchor::Start, "tick", &number.to_string());
        }
        svg.text(f64::midpoint(left, right), bottom + 38.0, Anchor::Middle, "tick", "x (mm)");
        svg.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_coloured_by_value_and_missing_ones_are_empty() {
        let map = HeatMap {
            title: "map".into(),
            heading: "map".into(),
            face_mm: [4.0, 2.0],
            cell_mm: [1.0, 2.0],
            cells: [1.0, -0.5, f64::NAN, 0.0]
                .iter()
                .enumerate()
                .map(|(i, value)| ([i as f64 + 0.5, 1.0], *value))
                .collect(),
            row_wires: vec![(3, 1.0)],
        };
        let scale = ColourScale::new([1.0, -0.5, f64::NAN]);
        let svg = map.draw(&scale);
        assert_eq!(svg.matches("class=\"above\"").count(), 2);
        assert_eq!(svg.matches("class=\"below\"").count(), 1);
        assert!(svg.contains("fill-opacity=\"1.000\"") && svg.contains("fill-opacity=\"0.500\""));
        assert!(svg.contains(">×<") && svg.contains(">3<"), "{svg}");
        assert!(!svg.contains("NaN"));
        let bar = scale.draw_bar("bar", "Δz (mm)");
        assert_eq!(bar.matches("<linearGradient").count(), 2);
    }
}
