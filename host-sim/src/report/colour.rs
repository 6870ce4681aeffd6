//! Colour scales: what colour a value has, and the bar that explains it.

use super::axes::draw_level_ticks;
use super::svg::{Anchor, Svg};
use super::ticks;

/// Colour scale in one or two hues, ever fuller towards its ends.
#[derive(Debug, Clone, PartialEq)]
pub struct ColourScale {
    low: f64,
    high: f64,
    /// Whether zero has no colour, and values below it have a hue of their own.
    diverging: bool,
}

/// Strips that a bar is drawn of: in the maps they are 8 px wide, so that no rounding makes them overlap.
const STRIPS: usize = 31;

impl ColourScale {
    /// Scale of values above and below zero: it covers zero and all `values` that are finite.
    pub fn diverging(values: impl IntoIterator<Item = f64>) -> Self {
        let (low, high) = ticks::extent(values.into_iter().chain([0.0])).unwrap_or((0.0, 1.0));
        let (low, high) = if high > low { (low, high) } else { (0.0, 1.0) };
        Self { low, high, diverging: true }
    }

    /// Scale of differences between values of this scale: as full at the same distance from zero.
    pub fn of_differences(&self) -> Self {
        let most = self.farthest();
        Self { low: -most, high: most, diverging: true }
    }

    /// Distance of the farther end from zero.
    fn farthest(&self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    /// Scale from the least to the greatest of `values`, so that small differences show.
    pub fn sequential(values: impl IntoIterator<Item = f64>) -> Self {
        let (low, high) = ticks::extent(values).unwrap_or((0.0, 1.0));
        let (low, high) = if high > low { (low, high) } else { (low - 0.5, low + 0.5) };
        Self { low, high, diverging: false }
    }

    /// Scale of shares, from 0 to 1.
    pub fn of_shares() -> Self {
        Self { low: 0.0, high: 1.0, diverging: true }
    }

    /// CSS class and opacity for `value`.
    pub fn colour(&self, value: f64) -> (&'static str, f64) {
        if self.diverging {
            let most = self.farthest();
            (if value < 0.0 { "below" } else { "above" }, (value.abs() / most).min(1.0))
        } else {
            let place = ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0);
            ("above", 0.06 + 0.94 * place)
        }
    }

    /// Decimals with which values of the scale are told apart, and are not longer than cells are wide.
    pub fn decimals(&self) -> usize {
        match self.farthest() {
            most if most < 0.1 => 3,
            most if most < 10.0 => 2,
            most if most < 100.0 => 1,
            _ => 0,
        }
    }

    /// Draws the bar from `left` to `right` below `top`, in a height of 52 px; `label` names the quantity and its unit.
    pub fn draw_bar(&self, svg: &mut Svg, [left, right]: [f64; 2], top: f64, label: &str) {
        let height = 12.0;
        let width = (right - left) / STRIPS as f64;
        for strip in 0..STRIPS {
            let share = (strip as f64 + 0.5) / STRIPS as f64;
            let (class, opacity) = self.colour(self.low + share * (self.high - self.low));
            let fill = format!(r#" fill-opacity="{opacity:.2}""#);
            let corner = [left + strip as f64 * width, top];
            svg.rect(corner, [width, height], &format!("{class} strip"), &fill);
        }
        svg.rect([left, top], [right - left, height], "outline", "");
        let ticks = ticks::within(self.low, self.high, 4);
        let place =
            |value: f64| left + (value - self.low) / (self.high - self.low) * (right - left);
        let at: Vec<_> =
            ticks.at.iter().map(|(value, text)| (place(*value), text.as_str())).collect();
        draw_level_ticks(svg, &at, top + height);
        svg.label(f64::midpoint(left, right), top + height + 36.0, Anchor::Middle, "tick", label);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_has_no_colour_and_the_farthest_value_the_fullest() {
        let scale = ColourScale::diverging([0.5, -0.1, f64::NAN]);
        assert_eq!(scale.colour(0.0).1, 0.0);
        assert_eq!(scale.colour(0.5), ("above", 1.0));
        assert_eq!(scale.colour(-0.1), ("below", 0.2));
        assert_eq!(ColourScale::diverging([0.1, -0.5]).colour(-0.1), ("below", 0.2));
        let differences = ColourScale::diverging([0.0, 0.5]).of_differences();
        assert_eq!(differences.colour(-0.17), ("below", 0.34));
        assert_eq!(differences.colour(0.6), ("above", 1.0), "beyond the ends");
        let scale = ColourScale::sequential([0.04, 0.06]);
        assert_eq!(scale.colour(0.06), ("above", 1.0));
        assert!(scale.colour(0.04).1 < 0.1);
        for empty in [ColourScale::diverging([]), ColourScale::sequential([f64::NAN])] {
            assert!(empty.colour(0.3).1.is_finite());
        }
        let mut svg = Svg::new(310.0, 60.0, "bar");
        scale.draw_bar(&mut svg, [20.0, 290.0], 0.0, "RMSE (mm)");
        let svg = svg.finish();
        assert_eq!(svg.matches("above strip").count(), STRIPS);
        assert!(svg.contains(">0.040</text>"), "{svg}");
    }
}
