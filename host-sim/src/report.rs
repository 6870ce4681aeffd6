//! Reports as self-contained pages: tables and figures, drawn from result structs and nothing else.
//!
//! The figures are drawn here rather than by a chart crate because their colours are CSS classes:
//! one page serves light and dark.

use taxel_evaluate::evaluate::learning_curve::LearningCurve;
use taxel_evaluate::evaluate::limit::LimitResult;
use taxel_evaluate::evaluate::printed::Cells;
use taxel_evaluate::evaluate::trade::Trade;
use taxel_evaluate::run::RunResult;
use taxel_evaluate::study::directions::DirectionsResult;
use taxel_evaluate::study::equations::EquationsResult;
use taxel_evaluate::study::map::MapStudy;
use taxel_evaluate::study::recursion::Study;

mod format;
mod ticks;
mod svg;
mod chart;
mod heat_map;
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
mod html;
mod printed;
mod trade;
mod limit;
mod study;
mod study_map;
mod learning_curve;
mod recursion;

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

/// Picture of the study of centres, spread and samples, as a file of its own: light or dark like the viewer.
pub fn study_map_svg(study: &MapStudy) -> String {
    study_map::svg(study)
}

/// Picture of what is known of each electrode, as a file of its own: light or dark like the viewer.
pub fn known_svg(limit: &LimitResult) -> String {
    limit::known_svg(limit)
}

/// Picture of tables, each with its name, beside the paper's printed Table 1; a file of its own, light or dark like the
/// viewer.
pub fn printed_svg(tables: &[(&str, Cells)]) -> String {
    printed::svg(tables)
}

/// Picture of the sensor's equations as a decoder: RMSE of z against the noise, as a file of its own.
pub fn equations_svg(result: &EquationsResult) -> String {
    study::equations_svg(result)
}

/// Picture of decoding in both directions: RMSE of z against the noise, as a file of its own.
pub fn decoding_svg(result: &DirectionsResult) -> String {
    study::decoding_svg(result)
}

/// Picture of a recursion's learning curve on `subject`, as a file of its own: light or dark like the viewer.
pub fn learning_curve_svg(curve: &LearningCurve, subject: &str) -> String {
    learning_curve::svg(curve, subject)
}

/// Picture of where recursive least squares diverges, as a file of its own: light or dark like the viewer.
pub fn recursion_svg(study: &Study) -> String {
    recursion::svg(study)
}

#[cfg(test)]
mod tests;
