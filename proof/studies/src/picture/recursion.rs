//! Picture of where recursive least squares diverges: maps of λ and of the condition against δ.

use crate::question::recursion::{
    FORGETTING_FACTORS, INITIAL_COVARIANCES, KINDS, Outcome, SPOILT, Study,
};

use host_sim::report::format::fixed;
use host_sim::report::svg::{Anchor, Svg, TEXT_PX, standalone};

/// Width of the Gaussians at which λ is varied: the widest of the paper.
const WIDTH: f64 = 1.0;
/// Forgetting factor at which the width is varied.
const FORGETTING_FACTOR: f64 = 0.99;

const CELL: [f64; 2] = [33.0, 26.0];
const LEFT: f64 = 112.0;
/// Room between the panels of a row.
const GAP: f64 = 18.0;
/// Room above a row of panels, for headings, and below it, for ticks.
const ABOVE: f64 = 54.0;
const BELOW: f64 = 58.0;
const LEGEND: f64 = 60.0;

/// Rows of a map, from the top: label, width, λ.
type Lines = Vec<(String, f64, f64)>;

/// Picture of the study, as a file of its own.
pub fn svg(study: &Study) -> String {
    let by_forgetting: Lines =
        FORGETTING_FACTORS.iter().map(|l| (format!("λ = {l}"), WIDTH, *l)).collect();
    let by_width: Lines = study
        .widths
        .iter()
        .map(|it| {
            let label = format!("σ {:.1} ({})", it.width, power(it.condition));
            (label, it.width, FORGETTING_FACTOR)
        })
        .collect();
    let condition =
        study.widths.iter().find(|it| it.width == WIDTH).map_or(f64::NAN, |it| it.condition);
    let maps = [
        (
            format!(
                "Forgetting factor λ against initial covariance δ (σ = {WIDTH}, condition {})",
                power(condition)
            ),
            by_forgetting,
        ),
        (
            format!(
                "Width σ (and condition of the regressors) against initial covariance δ (λ = {FORGETTING_FACTOR})"
            ),
            by_width,
        ),
    ];
    let panel = CELL[0] * INITIAL_COVARIANCES.len() as f64;
    let heights = maps.each_ref().map(|(_, lines)| ABOVE + CELL[1] * lines.len() as f64 + BELOW);
    let width = LEFT + 4.0 * panel + 3.0 * GAP + 6.0;
    let size = [width, LEGEND + heights.iter().sum::<f64>()];
    let title = "Where recursive least squares diverges, by form, precision, λ, δ and condition";
    let mut svg = Svg::new(size[0], size[1], title);
    legend(&mut svg, study.plan.updates);
    let mut top = LEGEND;
    for ((heading, lines), height) in maps.iter().zip(heights) {
        svg.text(0.0, top + TEXT_PX + 6.0, Anchor::Start, "label strong", heading);
        let first = top + ABOVE;
        for (line, (label, ..)) in lines.iter().enumerate() {
            let y = first + CELL[1] * (line as f64 + 0.5) + TEXT_PX * 0.35;
            svg.text(LEFT - 8.0, y, Anchor::End, "tick", label);
        }
        for (place, kind) in KINDS.into_iter().enumerate() {
            let left = LEFT + place as f64 * (panel + GAP);
            let middle = left + panel / 2.0;
            let heading = format!("{}, {}", kind.0.name(), kind.1);
            svg.text(middle, first - 8.0, Anchor::Middle, "label", &heading);
            let bottom = first + CELL[1] * lines.len() as f64;
            for (column, delta) in INITIAL_COVARIANCES.into_iter().enumerate() {
                let x = left + CELL[0] * column as f64;
                for (line, (_, width, forgetting)) in lines.iter().enumerate() {
                    if let Some(outcome) = study.outcome(kind, *width, *forgetting, delta) {
                        cell(&mut svg, [x, first + CELL[1] * line as f64], outcome);
                    }
                }
                let label = format!("1e{}", delta.log10().round());
                svg.text(x + CELL[0] / 2.0, bottom + 16.0, Anchor::Middle, "tick", &label);
            }
            svg.text(middle, bottom + 35.0, Anchor::Middle, "tick", "initial covariance δ");
        }
        top += height;
    }
    standalone(&svg.finish(), size)
}

/// Colour, opacity and text of an outcome.
fn look(outcome: &Outcome) -> (&'static str, f64, String) {
    match (outcome.diverged_after, outcome.difference) {
        (None, Some(difference)) if difference <= SPOILT => {
            // Fourteen digits are pale, two digits are half of the full colour.
            let lost = (difference.max(1e-14).log10() + 14.0) / 12.0;
            ("above", 0.06 + 0.44 * lost, exponent(difference))
        }
        (None, Some(difference)) => ("below", 0.45, exponent(difference)),
        (updates, _) => ("below", 1.0, updates.map_or("×".into(), count)),
    }
}

fn cell(svg: &mut Svg, [x, y]: [f64; 2], outcome: &Outcome) {
    let (class, opacity, text) = look(outcome);
    svg.rect([x, y], CELL, class, &format!(" fill-opacity=\"{opacity:.2}\""));
    let style = if opacity > 0.9 { "cell full" } else { "cell" };
    let y = y + CELL[1] / 2.0 + 4.0;
    svg.text(x + CELL[0] / 2.0, y, Anchor::Middle, style, &text);
}

/// Exponent of the power of ten nearest to a positive number, with a true minus sign.
fn exponent(value: f64) -> String {
    fixed(value.max(1e-300).log10(), 0)
}

/// Power of ten nearest to a positive number.
fn power(value: f64) -> String {
    format!("1e{}", exponent(value))
}

/// Number in at most four characters.
fn count(updates: usize) -> String {
    match updates {
        0..=9999 => updates.to_string(),
        _ => format!("{}k", updates / 1000),
    }
}

fn legend(svg: &mut Svg, updates: usize) {
    let right = "right to so many digits: −9 is a difference of 1e−9 from the batch solution in f64, in standard deviations of the output";
    let diverged = format!("diverged after so many of {updates} updates");
    let entries = [
        ([0.0, 0.0], 0.25, "−9", right),
        ([0.0, 26.0], 0.45, "−1", "spoilt: a difference of more than 1e−2"),
        ([LEFT + 2.0 * CELL[0] * INITIAL_COVARIANCES.len() as f64, 26.0], 1.0, "640", &diverged),
    ];
    for ([x, y], opacity, sample, words) in entries {
        let class = if opacity == 0.25 { "above" } else { "below" };
        svg.rect([x, y + 2.0], [CELL[0], 20.0], class, &format!(" fill-opacity=\"{opacity}\""));
        let style = if opacity > 0.9 { "cell full" } else { "cell" };
        svg.text(x + CELL[0] / 2.0, y + 16.0, Anchor::Middle, style, sample);
        svg.text(x + CELL[0] + 8.0, y + 17.0, Anchor::Start, "tick", words);
    }
}
