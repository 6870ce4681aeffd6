//! Small plots with two linear axes: histograms and densities.

use super::format::{fixed, grouped, significant, symbol, with_unit};
use super::svg::{Anchor, Svg, TEXT_PX, text_width};
use super::ticks::{self, Ticks};
use taxel_evaluate::evaluate::distribution::GroupDistribution;

const WIDTH: f64 = 310.0;

/// Plot to which marks are added.
struct Plot {
    svg: Svg,
    x: Ticks,
    y: Ticks,
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

impl Plot {
    fn new(title: &str, [x, y]: [Ticks; 2], height: f64, top: f64) -> Self {
        let widest = y.at.iter().map(|(_, label)| text_width(label)).fold(0.0, f64::max);
        let svg = Svg::new(WIDTH, height, title);
        Self { svg, x, y, left: widest + 10.0, right: WIDTH - 12.0, top, bottom: height - 42.0 }
    }

    fn x(&self, value: f64) -> f64 {
        let share = (value - self.x.low) / (self.x.high - self.x.low);
        self.left + share * (self.right - self.left)
    }

    fn y(&self, value: f64) -> f64 {
        self.bottom - (value - self.y.low) / (self.y.high - self.y.low) * (self.bottom - self.top)
    }

    /// Draws ticks, and labels of both axes: that of y above the plot.
    fn axes(&mut self, [x_label, y_label]: [&str; 2], grid: bool) {
        for (value, label) in self.y.at.clone() {
            let y = self.y(value);
            if grid {
                self.svg.line([self.left, y], [self.right, y], "grid");
            } else {
                self.svg.line([self.left - 4.0, y], [self.left, y], "axis");
            }
            self.svg.text(self.left - 7.0, y + TEXT_PX * 0.35, Anchor::End, "tick", &label);
        }
        let at = self.x.at.clone();
        let places: Vec<f64> = at.iter().map(|(value, _)| self.x(*value)).collect();
        let half = |i: usize| text_width(&at[i].1) / 2.0;
        let step = ticks::written(&places, |a, b| half(a) + half(b) + 3.0);
        for (i, ((_, label), x)) in at.iter().zip(&places).enumerate() {
            self.svg.line([*x, self.bottom], [*x, self.bottom + 4.0], "axis");
            if i % step == 0 {
                self.svg.text(*x, self.bottom + 18.0, Anchor::Middle, "tick", label);
            }
        }
        self.svg.line([self.left, self.bottom], [self.right, self.bottom], "axis");
        self.svg.text(0.0, TEXT_PX, Anchor::Start, "label", y_label);
        let middle = f64::midpoint(self.left, self.right);
        self.svg.text(middle, self.bottom + 38.0, Anchor::Middle, "tick", x_label);
    }
}

/// Ticks within exact ends.
fn within(low: f64, high: f64, wanted: usize) -> Ticks {
    let mut ticks = ticks::linear([low, high], wanted);
    let slack = 1e-9 * (high - low);
    ticks.at.retain(|(value, _)| (low - slack..=high + slack).contains(value));
    Ticks { low, high, ..ticks }
}

/// Exponents of ten from the least to the greatest share in per cent of a histogram, for its logarithmic axis.
fn decades(shares: impl Iterator<Item = f64>) -> Ticks {
    let (low, high) = ticks::extent(shares.filter(|share| *share > 0.0)).unwrap_or((1.0, 100.0));
    // A bin with the least share is still seen.
    let (low, high) = ((0.7 * low).log10().floor(), high.log10().ceil());
    let at = (low as i32..=high as i32).map(|decade| {
        let decimals = usize::try_from(-decade).unwrap_or(0);
        (f64::from(decade), fixed(10_f64.powi(decade), decimals))
    });
    Ticks { low, high: high.max(low + 1.0), at: at.collect() }
}

/// Histogram of a group's errors, with median, 95 % and largest.
pub fn histogram(group: &GroupDistribution) -> String {
    let (name, histogram) = (symbol(&group.group), &group.histogram);
    let width = histogram.bin_width;
    let share = |count: usize| 100.0 * count as f64 / group.count.max(1) as f64;
    let x = within(0.0, width * histogram.counts.len() as f64, 4);
    let y = decades(histogram.counts.iter().map(|count| share(*count)));
    let title = format!("Histogram of the error of {name}");
    let mut plot = Plot::new(&title, [x, y], 270.0, 68.0);
    let x_label = with_unit(&format!("|error of {name}|"), &group.unit);
    plot.axes([&x_label, &format!("{name}: share of errors (%)")], true);
    for (bin, count) in histogram.counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let (from, to) = (width * bin as f64, width * (bin + 1) as f64);
        let corner = [plot.x(from), plot.y(share(*count).log10())];
        let size = [(plot.x(to) - corner[0] - 0.6).max(0.4), plot.bottom - corner[1]];
        let hover = format!(
            "{} to {} {}: {} of {} errors",
            significant(from, 3),
            significant(to, 3),
            group.unit,
            grouped(*count),
            grouped(group.count)
        );
        plot.svg.hovered_rect(corner, size, "c1 mark", &hover);
    }
    // Words stand above each other, each from its line on, as far as the edge lets them.
    let marks = [("median", group.median), ("95 %", group.percentile_95), ("worst", group.largest)];
    for (line, (words, value)) in marks.into_iter().enumerate().filter(|(_, (_, v))| v.is_finite())
    {
        let beyond = plot.x(value) > plot.right + 0.5;
        let label = format!("{words} {}{}", significant(value, 3), if beyond { " →" } else { "" });
        let y = plot.top - 35.0 + 15.0 * line as f64;
        let from = plot.x(value).min(plot.right);
        if !beyond {
            plot.svg.line([from, y + 3.0], [from, plot.bottom], "truth dashed");
        }
        let end = from + 4.0 + text_width(&label) > plot.right;
        let (x, anchor) = if end { (from - 4.0, Anchor::End) } else { (from + 4.0, Anchor::Start) };
        plot.svg.text(x, y + 4.0, anchor, "tick", &label);
    }
    plot.svg.finish()
}

/// Density of a group's truths and estimates: the fuller a bin, the more pairs of them it has.
pub fn density(group: &GroupDistribution) -> String {
    let (name, density) = (symbol(&group.group), &group.density);
    let ticks = || within(density.low, density.high, 4);
    let title = format!("Decoded against true {name}");
    let mut plot = Plot::new(&title, [ticks(), ticks()], 310.0, 24.0);
    // Both axes have one scale.
    let side = (plot.right - plot.left).min(plot.bottom - plot.top);
    // Bins of whole pixels leave no gaps between each other.
    let bin = (side / density.bins as f64).floor();
    let side = bin * density.bins as f64;
    (plot.left, plot.bottom) = (plot.left.round(), plot.bottom.round());
    plot.right = plot.left + side;
    plot.top = plot.bottom - side;
    let most = density.counts.iter().copied().max().unwrap_or(0).max(1) as f64;
    for (i, count) in density.counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let (x, y) = ((i % density.bins) as f64, (i / density.bins) as f64);
        // By orders of magnitude: most frames hardly move most electrodes.
        let opacity = 0.1 + 0.9 * (*count as f64).ln() / most.ln().max(1.0);
        let corner = [plot.left + x * bin, plot.bottom - (y + 1.0) * bin];
        let fill = format!(r#" fill-opacity="{opacity:.2}""#);
        plot.svg.rect(corner, [bin, bin], "above strip", &fill);
    }
    let (low, high) = (density.low, density.high);
    let (from, to) = ([plot.x(low), plot.y(low)], [plot.x(high), plot.y(high)]);
    plot.svg.line(from, to, "truth thin");
    let corner = [plot.left, plot.top];
    plot.svg.rect(corner, [side, side], "outline", "");
    let x_label = with_unit(&format!("true {name}"), &group.unit);
    let y_label = with_unit(&format!("decoded {name}"), &group.unit);
    plot.axes([&x_label, &y_label], false);
    plot.svg.finish()
}
