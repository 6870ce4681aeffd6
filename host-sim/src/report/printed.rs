//! Picture of a table beside the paper's printed Table 1: one panel a noise level, error against spread.

use taxel_evaluate::evaluate::printed::{CELLS, Cells, NOISE_LEVELS, SPREADS};

use super::axes::Axis;
use super::chart::{Chart, Mark, Series};
use super::format::percent;
use super::svg::{Shape, Svg, standalone};
use super::ticks;

const PANEL: [f64; 2] = [440.0, 300.0];
const GAP_PX: f64 = 28.0;

/// Picture of the `computed` cells beside the printed ones; a file of its own, light or dark like the viewer.
pub fn svg(computed: &Cells) -> String {
    let all = [computed, &CELLS].into_iter().flat_map(|cells| cells.as_flattened());
    // Cells that would leave no room for the others are off the scale; marks at the edge say so.
    let most = 2.0 * ticks::extent(CELLS.as_flattened().iter().copied()).map_or(1.0, |it| it.1);
    let heights: Vec<f64> = all.copied().filter(|cell| *cell <= most).collect();
    let [width, height] = [2.0 * PANEL[0] + GAP_PX, 2.0 * PANEL[1] + GAP_PX];
    let mut picture = Svg::new(width, height, "Table 1 as computed and as the paper prints it");
    for (j, level) in NOISE_LEVELS.into_iter().enumerate() {
        let points = |cells: &Cells| -> Vec<[f64; 2]> {
            SPREADS.into_iter().zip(cells).map(|(spread, line)| [spread, line[j]]).collect()
        };
        let series = |name, class, shape, cells| {
            Series::new(name, class, Mark::LineAnd(shape), points(cells))
        };
        let series = vec![
            series("printed", "muted", Shape::Circle, &CELLS),
            series("computed", "c1", Shape::Square, computed),
        ];
        let chart = Chart {
            title: format!("Error in z against spread at {} noise", percent(level)),
            x: Axis::linear("spread", ticks::linear(SPREADS, 5)),
            y: Axis::linear(
                format!("error in z, %, at {} noise", percent(level)),
                ticks::linear(heights.iter().copied(), 5),
            ),
            series,
            end_labels: true,
        };
        let [x, y] = [(j % 2) as f64 * (PANEL[0] + GAP_PX), (j / 2) as f64 * (PANEL[1] + GAP_PX)];
        picture.place([x, y], &chart.draw(PANEL));
    }
    standalone(&picture.finish(), [width, height])
}
