//! Picture of the study of centres, spread and samples: a map for each number of samples, noise level and kind of error.

use crate::question::map::{Cell, Map, MapStudy};

use host_sim::report::format::{fixed, percent, significant, symbol};
use host_sim::report::svg::{Anchor, Svg, TEXT_PX, standalone};

/// Size of a cell.
const CELL: [f64; 2] = [28.0, 13.0];
/// Space left of all maps, between them, before the column K = N, and above.
const LEFT: f64 = 104.0;
const BETWEEN: f64 = 22.0;
const BEFORE_N: f64 = 5.0;
const TOP: f64 = 116.0;
/// Space between two rows of maps.
const BETWEEN_ROWS: f64 = 18.0;
/// Ratio to the mean's error from which on colours are full.
const FULL: f64 = 3.0;
/// Ratios to the mean's error that the key shows.
const KEY: [f64; 9] = [0.0, 0.25, 0.5, 0.75, 0.9, 1.05, 1.25, 2.0, 3.0];

/// Kind of error that a column of maps shows.
#[derive(Clone, Copy)]
enum Kind {
    Training,
    Test,
}

impl Kind {
    const ALL: [Self; 2] = [Self::Training, Self::Test];

    fn heading(self) -> &'static str {
        match self {
            Self::Training => "on the samples",
            Self::Test => "on test frames",
        }
    }

    fn of(self, cell: &Cell) -> f64 {
        match self {
            Self::Training => cell.training_rmse,
            Self::Test => cell.test_rmse,
        }
    }
}

/// Colour class and opacity of an error, as a ratio to the mean's.
fn colour(ratio: f64) -> (&'static str, f64) {
    // Roots: small differences near 1 are what is looked for.
    if ratio < 1.0 {
        ("above", (1.0 - ratio).sqrt())
    } else {
        ("below", (ratio.min(FULL).ln() / FULL.ln()).sqrt())
    }
}

/// Places of cells in a map, which are the same in all maps.
struct Grid<'s> {
    study: &'s MapStudy,
}

impl Grid<'_> {
    fn size(&self) -> [f64; 2] {
        let columns = self.study.centres.len() + 1;
        [columns as f64 * CELL[0] + BEFORE_N, self.study.spreads.len() as f64 * CELL[1]]
    }

    /// Left edge of the column for so many `centres` of a map, if it has one.
    fn x(&self, centres: usize, samples: usize) -> Option<f64> {
        let all = &self.study.centres;
        if centres == samples {
            return Some(all.len() as f64 * CELL[0] + BEFORE_N);
        }
        all.iter().position(|k| *k == centres).map(|place| place as f64 * CELL[0])
    }

    /// Top edge of the line for a spread: the widest is at the top.
    fn y(&self, spread: f64) -> Option<f64> {
        let spreads = &self.study.spreads;
        let place = spreads.iter().position(|s| *s == spread)?;
        Some((spreads.len() - 1 - place) as f64 * CELL[1])
    }
}

pub fn svg(study: &MapStudy) -> String {
    let grid = Grid { study };
    let [width, height] = grid.size();
    let mut levels: Vec<f64> = study.maps.iter().map(|map| map.noise_level).collect();
    levels.dedup();
    let mut samples: Vec<usize> = study.maps.iter().map(|map| map.samples).collect();
    samples.sort_unstable();
    samples.dedup();
    let columns = (levels.len() * Kind::ALL.len()) as f64;
    let size = [
        LEFT + columns * (width + BETWEEN),
        TOP + samples.len() as f64 * (height + BETWEEN_ROWS) + 66.0,
    ];
    let name = symbol(&study.group);
    let title = format!("Error of {name} by centres K, spread and samples N");
    let mut svg = Svg::new(size[0], size[1], &title);
    head(&mut svg, study);
    for (place, level) in levels.iter().enumerate() {
        let left = LEFT + (2 * place) as f64 * (width + BETWEEN);
        let heading = format!("{} noise", percent(*level));
        svg.text(left, TOP - 32.0, Anchor::Start, "label strong", &heading);
        for (side, kind) in Kind::ALL.into_iter().enumerate() {
            let left = left + side as f64 * (width + BETWEEN);
            svg.text(left, TOP - 12.0, Anchor::Start, "label", kind.heading());
            for (row, samples) in samples.iter().enumerate() {
                let top = TOP + row as f64 * (height + BETWEEN_ROWS);
                let wanted = |map: &&Map| map.noise_level == *level && map.samples == *samples;
                if let Some(map) = study.maps.iter().find(wanted) {
                    svg.open(&format!(r#" transform="translate({left} {top})""#));
                    draw(&mut svg, &grid, map, kind);
                    svg.close();
                }
            }
            let bottom = TOP + samples.len() as f64 * (height + BETWEEN_ROWS) - BETWEEN_ROWS;
            centres_axis(&mut svg, &grid, [left, bottom]);
        }
    }
    for (row, samples) in samples.iter().enumerate() {
        let top = TOP + row as f64 * (height + BETWEEN_ROWS);
        let middle = top + height / 2.0;
        svg.text(
            4.0,
            middle + TEXT_PX * 0.35,
            Anchor::Start,
            "label strong",
            &format!("N = {samples}"),
        );
        for spread in &study.spreads {
            let Some(y) = grid.y(*spread) else { continue };
            let shown = [study.spreads.first(), study.spreads.last()].contains(&Some(spread))
                || *spread == 0.5;
            if shown {
                let y = top + y + CELL[1] / 2.0 + TEXT_PX * 0.35;
                svg.text(LEFT - 6.0, y, Anchor::End, "tick", &fixed(*spread, 1));
            }
        }
    }
    svg.text(LEFT - 6.0, TOP - 12.0, Anchor::End, "tick", "spread");
    let sets = study.maps.iter().map(|map| map.training_sets).max().unwrap_or(1);
    let note = format!(
        "K = N: every sample is a centre. Few samples: root mean square over up to {sets} training sets."
    );
    svg.text(LEFT, size[1] - 8.0, Anchor::Start, "tick", &note);
    standalone(&svg.finish(), size)
}

/// Title, key of the colours, and what the marks mean.
fn head(svg: &mut Svg, study: &MapStudy) {
    let name = symbol(&study.group);
    let heading = format!(
        "RMSE of {name} over that of always predicting the mean (scene {}, row {})",
        study.subject, study.row_wire
    );
    svg.text(4.0, 20.0, Anchor::Start, "label strong", &heading);
    let (top, step) = (34.0, 46.0);
    for (place, ratio) in KEY.into_iter().enumerate() {
        let left = LEFT + place as f64 * step;
        let (class, opacity) = colour(ratio);
        svg.rect([left, top], [step, 12.0], class, &format!(r#" fill-opacity="{opacity:.3}""#));
        let most = if ratio >= FULL { "≥ " } else { "" };
        let text = format!("{most}{ratio}");
        svg.text(left + step / 2.0, top + 27.0, Anchor::Middle, "tick", &text);
    }
    let left = LEFT + KEY.len() as f64 * step + 28.0;
    svg.rect([left, top], [18.0, 12.0], "best", "");
    svg.text(left + 26.0, top + 11.0, Anchor::Start, "tick", "least test error");
}

/// Draws one map at the origin.
fn draw(svg: &mut Svg, grid: &Grid<'_>, map: &Map, kind: Kind) {
    let mean = match kind {
        Kind::Training => map.mean_training_rmse,
        Kind::Test => map.mean_rmse,
    };
    let ratio = |cell: &Cell| kind.of(cell) / mean;
    for cell in &map.cells {
        let (Some(x), Some(y)) = (grid.x(cell.centres, map.samples), grid.y(cell.spread)) else {
            continue;
        };
        let (class, opacity) = colour(ratio(cell));
        let hover = format!(
            "K = {}, spread {}: {} {}, {} of the mean's",
            cell.centres,
            cell.spread,
            significant(kind.of(cell), 3),
            grid.study.unit,
            significant(ratio(cell), 3)
        );
        svg.open(&format!(r#" fill-opacity="{opacity:.3}""#));
        svg.hovered_rect([x, y], CELL, class, &hover);
        svg.close();
    }
    if let Some(best) = map.best(|_| true)
        && let (Some(x), Some(y)) = (grid.x(best.centres, map.samples), grid.y(best.spread))
    {
        svg.rect([x, y], CELL, "best", "");
    }
}

/// Numbers of centres below a column of maps, whose bottom left corner is given.
fn centres_axis(svg: &mut Svg, grid: &Grid<'_>, [left, bottom]: [f64; 2]) {
    let study = grid.study;
    for (place, centres) in study.centres.iter().enumerate() {
        let x = left + (place as f64 + 0.5) * CELL[0];
        svg.text(x, bottom + 17.0, Anchor::Middle, "tick", &centres.to_string());
    }
    let x = left + (study.centres.len() as f64 + 0.5) * CELL[0] + BEFORE_N;
    svg.text(x, bottom + 17.0, Anchor::Middle, "tick", "N");
    let middle = left + grid.size()[0] / 2.0;
    svg.text(middle, bottom + 38.0, Anchor::Middle, "label", "centres K");
}
