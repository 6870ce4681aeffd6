//! Axes of all pictures: their scales, where values lie between them, and their ticks and labels.

use super::svg::{Anchor, Svg, TEXT_PX, text_width};
use super::ticks::{self, Ticks};

/// Axis of a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Quantity on the axis, with its unit.
    pub label: String,
    pub ticks: Ticks,
    pub logarithmic: bool,
}

impl Axis {
    /// Linear axis.
    pub fn linear(label: impl Into<String>, ticks: Ticks) -> Self {
        Self { label: label.into(), ticks, logarithmic: false }
    }

    /// Logarithmic axis.
    pub fn logarithmic(label: impl Into<String>, ticks: Ticks) -> Self {
        Self { label: label.into(), ticks, logarithmic: true }
    }

    /// Place of `value` along the axis: 0 at its low end, 1 at its high end.
    fn place(&self, value: f64) -> f64 {
        let Ticks { low, high, .. } = self.ticks;
        if self.logarithmic {
            (value / low).ln() / (high / low).ln()
        } else {
            (value - low) / (high - low)
        }
    }

    /// The axis with room beyond the `values` that lie at its ends, so that no mark is on the frame.
    #[must_use]
    pub fn with_room(mut self, values: impl Iterator<Item = f64>) -> Self {
        /// Share of the axis that is free beyond a mark.
        const ROOM: f64 = 0.03;
        let places = values.filter(|value| self.holds(*value)).map(|value| self.place(value));
        let Some((least, most)) = ticks::extent(places) else { return self };
        let [low, high] = [(ROOM - least).max(0.0), (most - 1.0 + ROOM).max(0.0)];
        let Ticks { low: from, high: to, .. } = self.ticks;
        if self.logarithmic {
            let whole = to / from;
            (self.ticks.low, self.ticks.high) = (from / whole.powf(low), to * whole.powf(high));
        } else {
            (self.ticks.low, self.ticks.high) = (from - low * (to - from), to + high * (to - from));
        }
        self
    }

    /// Whether `value` lies on the axis.
    pub fn holds(&self, value: f64) -> bool {
        (self.ticks.low..=self.ticks.high).contains(&value)
    }
}

/// What stands at the ticks of an upright axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Upright {
    /// Lines across the picture.
    Grid,
    /// Marks outside.
    Marks,
}

/// Part of a picture between two axes, with its edges in px.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    pub x: Axis,
    pub y: Axis,
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
}

/// Room below a panel for ticks and the label of its level axis, in px.
pub const BELOW_PX: f64 = 44.0;

impl Panel {
    /// Level coordinate of a value in px.
    pub fn x(&self, value: f64) -> f64 {
        self.left + self.x.place(value) * (self.right - self.left)
    }

    /// Upright coordinate of a value in px.
    pub fn y(&self, value: f64) -> f64 {
        self.bottom - self.y.place(value) * (self.bottom - self.top)
    }

    /// Place of a point in px.
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.x(x), self.y(y)]
    }

    /// Draws both axes, and the label of the level one. That of the upright axis stands where its picture has room.
    pub fn draw_axes(&self, svg: &mut Svg, upright: Upright) {
        let Self { left, right, bottom, .. } = *self;
        let places: Vec<f64> = self.y.ticks.at.iter().map(|(value, _)| self.y(*value)).collect();
        let step = ticks::written(&places, |_, _| 0.8 * TEXT_PX);
        for (i, ((value, label), y)) in self.y.ticks.at.iter().zip(places).enumerate() {
            match upright {
                Upright::Marks => svg.line([left - 4.0, y], [left, y], "axis"),
                Upright::Grid if *value == 0.0 => svg.line([left, y], [right, y], "axis"),
                Upright::Grid => svg.line([left, y], [right, y], "grid"),
            }
            if i % step == 0 {
                svg.text(left - 7.0, y + TEXT_PX * 0.35, Anchor::End, "tick", label);
            }
        }
        svg.line([left, bottom], [right, bottom], "axis");
        let at = self.x.ticks.at.iter().map(|(value, label)| (self.x(*value), label.as_str()));
        draw_level_ticks(svg, &at.collect::<Vec<_>>(), bottom);
        let middle = f64::midpoint(left, right);
        svg.label(middle, bottom + 38.0, Anchor::Middle, "tick", &self.x.label);
    }
}

/// Draws ticks below a level axis at height `y`, at places in px. Where labels are dense, only some are written; all ticks
/// stay.
pub fn draw_level_ticks(svg: &mut Svg, at: &[(f64, &str)], y: f64) {
    let places: Vec<f64> = at.iter().map(|(x, _)| *x).collect();
    let step = ticks::written(&places, |a, b| {
        f64::midpoint(text_width(at[a].1), text_width(at[b].1)) + 4.0
    });
    for (i, (x, label)) in at.iter().enumerate() {
        svg.line([*x, y], [*x, y + 4.0], "axis");
        if i % step == 0 {
            svg.text(*x, y + 18.0, Anchor::Middle, "tick", label);
        }
    }
}

/// Width of the longest label of an axis in px.
pub fn label_width(ticks: &Ticks) -> f64 {
    ticks.at.iter().map(|(_, label)| text_width(label)).fold(0.0, f64::max)
}
