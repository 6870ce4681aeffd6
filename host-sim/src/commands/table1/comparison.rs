//! Text of tables beside the paper's printed Table 1.

use crate::evaluate::printed::{CELLS, Cells, NOISE_LEVELS, Nearness, SPREADS};

use taxel_simulate::noise::NoiseKind;

use super::super::print::Page;

/// Header of [`line()`]s.
pub fn header(what: &str) -> String {
    format!(
        "{what:<22} {:>6} {:>8} {:>9} {:>12} {:>12} {:>12}",
        "gap", "fitted", "held out", "correlation", "with noise", "with spread"
    )
}

/// Nearness of a table to the printed one, in a line.
pub fn line(name: &str, nearness: &Nearness) -> String {
    format!(
        "{name:<22} {:>6.2} {:>8.2} {:>9.2} {:>12} {:>+12.2} {:>+12.2}",
        nearness.gap,
        nearness.gap_fitted,
        nearness.gap_held_out,
        nearness.correlation.map_or("-".into(), |it| format!("{it:.2}")),
        nearness.rise_with_noise,
        nearness.rise_with_spread
    )
}

/// Adds computed and printed cells side by side.
pub fn cells(page: &mut Page, cells: &Cells) {
    let levels = NOISE_LEVELS.map(|level| format!("{:>18}", NoiseKind::Relative.in_words(level)));
    page.line(format_args!("{:<10}{}", "noise", levels.concat()));
    for ((spread, line), printed) in SPREADS.iter().zip(cells).zip(&CELLS) {
        let pairs =
            line.iter().zip(printed).map(|(a, b)| format!("{:>18}", format!("{a:.2} / {b:.2}")));
        page.line(format_args!("spread {spread:?}{}", pairs.collect::<String>()));
    }
}
