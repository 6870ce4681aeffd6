//! Small plots with two linear axes: histograms and densities.

use super::axes::{Axis, BELOW_PX, Panel, Upright, label_width};
use super::data::{Data, number};
use super::figures::Panel as Drawn;
use super::format::{fixed, grouped, significant, symbol, with_unit};
use super::svg::{Anchor, Svg, TEXT_PX, text_width};
use super::ticks::{self, Ticks};
use taxel_evaluate::evaluate::distribution::GroupDistribution;

const WIDTH: f64 = 310.0;

/// Panel for values of `x` and `y` in a picture of this `height`, below the label of y.
fn panel([x, y]: [Axis; 2], height: f64, top: f64) -> Panel {
    let left = label_width(&y.ticks) + 10.0;
    Panel { x, y, left, right: WIDTH - 12.0, top, bottom: height - BELOW_PX }
}

/// Powers of ten from the least to the greatest share in per cent of a histogram, for its logarithmic axis.
fn decades(shares: impl Iterator<Item = f64>) -> Ticks {
    let (low, high) = ticks::extent(shares.filter(|share| *share > 0.0)).unwrap_or((1.0, 100.0));
    // A bin with the least share is still seen.
    let low = (0.7 * low).log10().floor() as i32;
    let high = (high.log10().ceil() as i32).max(low + 1);
    let power = |decade: i32| 10_f64.powi(decade);
    let label = |decade: i32| fixed(power(decade), usize::try_from(-decade).unwrap_or(0));
    let at = (low..=high).map(|decade| (power(decade), label(decade)));
    Ticks { low: power(low), high: power(high), at: at.collect() }
}

/// Histogram of a group's errors, with median, 95 % and largest.
pub fn histogram(group: &GroupDistribution) -> Drawn {
    let (name, histogram) = (symbol(&group.group), &group.histogram);
    let width = histogram.bin_width;
    let share = |count: usize| 100.0 * count as f64 / group.count.max(1) as f64;
    let x = ticks::within(0.0, width * histogram.counts.len() as f64, 4);
    let x = Axis::linear(with_unit(&format!("|error of {name}|"), &group.unit), x);
    let y = decades(histogram.counts.iter().map(|count| share(*count)));
    let y = Axis::logarithmic(format!("{name}: share of errors (%)"), y);
    let mut svg = Svg::new(WIDTH, 272.0, &format!("Histogram of the error of {name}"));
    let panel = panel([x, y], 272.0, 68.0);
    svg.label(0.0, TEXT_PX, Anchor::Start, "label", &panel.y.label);
    panel.draw_axes(&mut svg, Upright::Grid);
    for (bin, count) in histogram.counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let (from, to) = (width * bin as f64, width * (bin + 1) as f64);
        let corner = [panel.x(from), panel.y(share(*count))];
        let size = [(panel.x(to) - corner[0] - 0.6).max(0.4), panel.bottom - corner[1]];
        let hover = format!(
            "{} to {} {}: {} of {} errors",
            significant(from, 3),
            significant(to, 3),
            group.unit,
            grouped(*count),
            grouped(group.count)
        );
        svg.hovered_rect(corner, size, "c1 mark", &hover);
    }
    // Words stand above each other, each from its line on, as far as the edge lets them.
    let marks = [("median", group.median), ("95 %", group.percentile_95), ("worst", group.largest)];
    for (line, (words, value)) in marks.into_iter().enumerate().filter(|(_, (_, v))| v.is_finite())
    {
        let beyond = panel.x(value) > panel.right + 0.5;
        let label = format!("{words} {}{}", significant(value, 3), if beyond { " →" } else { "" });
        let y = panel.top - 35.0 + 15.0 * line as f64;
        let from = panel.x(value).min(panel.right);
        if !beyond {
            svg.line([from, y + 3.0], [from, panel.bottom], "truth dashed");
        }
        let end = from + 4.0 + text_width(&label) > panel.right;
        let (x, anchor) = if end { (from - 4.0, Anchor::End) } else { (from + 4.0, Anchor::Start) };
        svg.text(x, y + 4.0, anchor, "tick halo", &label);
    }
    let mut data = Data::new(&["error from", "error to", "unit", "errors"]);
    for (bin, count) in histogram.counts.iter().enumerate() {
        let [from, to] = [bin, bin + 1].map(|edge| number(width * edge as f64));
        data.lines.push(vec![from, to, group.unit.clone(), count.to_string()]);
    }
    Drawn { heading: name, drawing: svg.finish(), data }
}

/// Density of a group's truths and estimates: the fuller a bin, the more pairs of them it has.
pub fn density(group: &GroupDistribution) -> Drawn {
    let (name, density) = (symbol(&group.group), &group.density);
    let axis = |what: &str| {
        let ticks = ticks::within(density.low, density.high, 4);
        Axis::linear(with_unit(&format!("{what} {name}"), &group.unit), ticks)
    };
    let mut svg = Svg::new(WIDTH, 312.0, &format!("Decoded against true {name}"));
    let mut panel = panel([axis("true"), axis("decoded")], 312.0, 24.0);
    // Both axes have one scale, and bins of whole pixels leave no gaps between each other.
    let side = (panel.right - panel.left).min(panel.bottom - panel.top);
    let bin = (side / density.bins as f64).floor();
    let side = bin * density.bins as f64;
    (panel.left, panel.bottom) = (panel.left.round(), panel.bottom.round());
    (panel.right, panel.top) = (panel.left + side, panel.bottom - side);
    let most = density.counts.iter().copied().max().unwrap_or(0).max(1) as f64;
    for (i, count) in density.counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let (x, y) = ((i % density.bins) as f64, (i / density.bins) as f64);
        // By orders of magnitude: most frames hardly move most electrodes.
        let opacity = 0.15 + 0.85 * (*count as f64).ln() / most.ln().max(1.0);
        let corner = [panel.left + x * bin, panel.bottom - (y + 1.0) * bin];
        let fill = format!(r#" fill-opacity="{opacity:.2}""#);
        svg.rect(corner, [bin, bin], "above strip", &fill);
    }
    let [from, to] = [density.low, density.high].map(|end| panel.at([end, end]));
    svg.line(from, to, "truth thin");
    svg.rect([panel.left, panel.top], [side, side], "outline", "");
    svg.label(0.0, TEXT_PX, Anchor::Start, "label", &panel.y.label);
    panel.draw_axes(&mut svg, Upright::Marks);
    let mut data = Data::new(&["true", "decoded", "unit", "pairs"]);
    let middle = |bin: usize| {
        let width = (density.high - density.low) / density.bins as f64;
        number(density.low + (bin as f64 + 0.5) * width)
    };
    for (i, count) in density.counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let [x, y] = [i % density.bins, i / density.bins].map(middle);
        data.lines.push(vec![x, y, group.unit.clone(), count.to_string()]);
    }
    Drawn { heading: name, drawing: svg.finish(), data }
}
