//! Picture of where recursive least squares diverges: maps of λ and of the condition against δ.

use crate::question::recursion::{
    FORGETTING_FACTORS, INITIAL_COVARIANCES, KINDS, Outcome, SPOILT, Study,
};

use host_sim::report::format::fixed;

use super::heat::{Map, Picture, Square};

/// Width of the Gaussians at which λ is varied: the widest of the paper.
const WIDTH: f64 = 1.0;
/// Forgetting factor at which the width is varied.
const FORGETTING_FACTOR: f64 = 0.99;

/// Picture of the study, as a file of its own.
pub fn svg(study: &Study) -> String {
    // Lines of a map: label, width, λ.
    let by_forgetting = FORGETTING_FACTORS.map(|l| (format!("λ = {l}"), WIDTH, l)).to_vec();
    let of_width = |width: f64, condition: f64| {
        (format!("σ {width:.1} ({})", power(condition)), width, FORGETTING_FACTOR)
    };
    let by_width: Vec<_> = study.widths.iter().map(|it| of_width(it.width, it.condition)).collect();
    let condition = study.widths.iter().find(|it| it.width == WIDTH).map(|it| it.condition);
    let rows = [
        (
            format!(
                "Forgetting factor λ against initial covariance δ (σ = {WIDTH}, condition {})",
                power(condition.unwrap_or(f64::NAN))
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
    let maps = |lines: &[(String, f64, f64)]| {
        KINDS.map(|kind| {
            let line = |(label, width, forgetting): &(String, f64, f64)| {
                let outcome = |delta| study.outcome(kind, *width, *forgetting, delta);
                let squares = INITIAL_COVARIANCES.map(|delta| outcome(delta).map(square));
                (label.clone(), squares.to_vec())
            };
            let heading = format!("{}, {}", kind.0.name(), kind.1);
            Map { heading, lines: lines.iter().map(line).collect() }
        })
    };
    let picture = Picture {
        title: "Where recursive least squares diverges, by form, precision, λ, δ and condition"
            .into(),
        key: vec![
            (
                look("above", 0.25, "−9"),
                "right to so many digits: −9 is a difference of 1e−9 from the batch solution in f64, in standard deviations of the output".into(),
            ),
            (look("below", 0.45, "−1"), "spoilt: a difference of more than 1e−2".into()),
            (
                look("below", 1.0, "640"),
                format!("diverged after so many of {} updates", study.plan.updates),
            ),
        ],
        cell: [33.0, 26.0],
        columns: INITIAL_COVARIANCES.map(|delta| format!("1e{}", delta.log10().round())).to_vec(),
        across: "across: initial covariance δ",
        rows: rows.map(|(heading, lines)| (heading, maps(&lines).into())).into(),
    };
    picture.svg()
}

fn look(class: &'static str, opacity: f64, text: &str) -> Square {
    Square { class, opacity, text: text.into(), hover: String::new(), is_framed: false }
}

/// Square of an outcome.
fn square(outcome: &Outcome) -> Square {
    match (outcome.diverged_after, outcome.difference) {
        (None, Some(difference)) if difference <= SPOILT => {
            // Fourteen digits are pale, two digits are half of the full colour.
            let lost = (difference.max(1e-14).log10() + 14.0) / 12.0;
            look("above", 0.06 + 0.44 * lost, &exponent(difference))
        }
        (None, Some(difference)) => look("below", 0.45, &exponent(difference)),
        (Some(updates @ 0..=9999), _) => look("below", 1.0, &updates.to_string()),
        (Some(updates), _) => look("below", 1.0, &format!("{}k", updates / 1000)),
        (None, None) => look("below", 1.0, "×"),
    }
}

/// Exponent of the power of ten nearest to a positive number, with a true minus sign.
fn exponent(value: f64) -> String {
    fixed(value.max(1e-300).log10(), 0)
}

/// Power of ten nearest to a positive number.
fn power(value: f64) -> String {
    format!("1e{}", exponent(value))
}
