//! Reports as self-contained pages: tables and figures, drawn from result structs and nothing else.
//!
//! The figures are drawn here rather than by a chart crate because their colours are CSS classes:
//! one page serves light and dark.

use taxel_evaluate::evaluate::learning_curve::LearningCurve;
use taxel_evaluate::evaluate::limit::LimitResult;
use taxel_evaluate::evaluate::printed::Cells;
use taxel_evaluate::evaluate::trade::Trade;
use taxel_evaluate::run::RunResult;
use taxel_evaluate::sweep::Merged;

pub mod format;
pub mod ticks;
pub mod svg;
pub mod axes;
pub mod chart;
mod colour;
mod voronoi;
mod view;
mod face;
mod face_map;
mod plot;
mod figures;
mod errors;
mod frames;
mod sketch;
mod tables;
mod sweep;
mod over_time;
mod moving;
mod html;
mod printed;
mod trade;
mod limit;
mod points;
mod learning_curve;

pub use points::{evenly, result_text, setting_cells, setting_heads};
pub use view::{Made, View};

/// Page for `result`: no script, no file beside it, the same bytes for the same result.
pub fn html(result: &RunResult, made: &Made) -> String {
    html::page(&View::of_run(result, made))
}

/// Page for a model, whatever its result is from: as [`html`].
pub fn view_html(view: &View<'_>) -> String {
    html::page(view)
}

/// Page for a trade between speed and accuracy, with the `command` that computed it.
pub fn trade_html(trade: &Trade, command: &str) -> String {
    trade::html(trade, command)
}

/// Picture of a trade, as a file of its own: light or dark like the viewer.
pub fn trade_svg(trade: &Trade) -> String {
    trade::svg(trade)
}

/// Page for a limit: what the sensor can know, with pictures.
pub fn limit_html(limit: &LimitResult) -> String {
    limit::html(limit)
}

/// Picture of the directions that a sensor shows, as a file of its own: light or dark like the viewer.
pub fn directions_svg(limit: &LimitResult) -> String {
    limit::directions_svg(limit)
}

/// Picture of what is known of each electrode, as a file of its own: light or dark like the viewer.
pub fn known_svg(limit: &LimitResult) -> String {
    limit::known_svg(limit)
}

/// Page for the results of a sweep or a comparison, whose files begin with `stem`, with the `command` that made them.
pub fn sweep_html(merged: &Merged, stem: &str, command: &str) -> String {
    points::html(merged, stem, command)
}

/// Picture of a sweep's points and their front, as a file of its own: light or dark like the viewer.
pub fn sweep_front_svg(merged: &Merged) -> String {
    points::front_svg(merged)
}

/// Picture of what a sweep's axes explain, as a file of its own: light or dark like the viewer.
pub fn sweep_effects_svg(merged: &Merged) -> String {
    points::effects_svg(merged)
}

/// Picture of tables, each with its name, beside the paper's printed Table 1; a file of its own, light or dark like the
/// viewer.
pub fn printed_svg(tables: &[(&str, Cells)]) -> String {
    printed::svg(tables)
}

/// Picture of a recursion's learning curve on `subject`, as a file of its own: light or dark like the viewer.
pub fn learning_curve_svg(curve: &LearningCurve, subject: &str) -> String {
    learning_curve::svg(curve, subject)
}

#[cfg(test)]
mod tests;
