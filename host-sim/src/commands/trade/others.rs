//! Errors on other contacts, in words.

use crate::commands::print::{Page, wrapped};
use crate::evaluate::trade::Trade;

/// Adds what the chosen point, or the most accurate one, is worth on contacts that it was not trained on.
pub fn note(page: &mut Page, trade: &Trade) {
    let shown = trade.chosen.or_else(|| trade.most_accurate());
    let Some(point) = shown.map(|point| &trade.points[point]) else { return };
    let Some(worst) = point.worst_other() else { return };
    let others = point.others.iter().map(|other| format!("{} {:.4}", other.name, other.rmse));
    let others = others.collect::<Vec<_>>().join(", ");
    let (which, unit) =
        (if trade.chosen.is_some() { "chosen" } else { "most accurate" }, &trade.unit);
    let counted = if trade.worst_case {
        "Front and choice count the worst of these and its own."
    } else {
        "--worst-case chooses by the worst."
    };
    wrapped(
        page,
        &format!(
            "On still contacts that it was not trained on, the {which} point has an RMSE of {} in {}{unit}: {others}. The worst \
             is {:.4} ({}). {counted}",
            trade.group,
            if unit.is_empty() { "its unit" } else { "" },
            worst.rmse,
            worst.name
        ),
    );
}
