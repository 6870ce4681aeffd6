//! Reports as self-contained pages: tables and figures, drawn from result structs and nothing else.
//!
//! The figures are drawn here rather than by a chart crate because their colours are CSS classes:
//! one page serves light and dark.

use taxel_data::output::Inner;
use taxel_evaluate::evaluate::trade::Trade;
use taxel_evaluate::run::RunResult;
use taxel_evaluate::sweep::Merged;

pub mod format;
pub mod ticks;
pub mod svg;
pub mod axes;
mod data;
pub mod chart;
mod figures;
mod colour;
mod voronoi;
mod view;
mod face;
mod face_map;
mod plot;
mod errors;
mod frames;
mod sketch;
mod tables;
mod sweep;
mod over_time;
mod moving;
mod html;
mod trade;
mod limit;
mod points;
mod sections;

pub use figures::{FOLDER as FIGURES, Page};
pub use limit::{sections as of_limit, several as of_limits};
pub use points::{evenly, result_text, setting_cells, setting_heads};
pub use sections::Sections;
pub use view::{Made, View, in_words};

use figures::Figures;

/// Files of figures of these names.
pub const fn figures_named(names: &'static [&'static str]) -> Inner {
    Inner { folder: FIGURES, names, endings: &["svg", "csv"] }
}

/// Page for `result`: no script, nothing that is loaded, the same bytes for the same result.
pub fn html(result: &RunResult, made: &Made) -> Page {
    html::page(&View::of_run(result, made), Figures::in_files(""))
}

/// Page for a model, whatever its result is from: as [`html`], without files beside it.
pub fn view_html(view: &View<'_>) -> String {
    html::page(view, Figures::default()).html
}

/// Page for a trade between speed and accuracy, with the `command` that computed it.
pub fn trade_html(trade: &Trade, command: &str) -> Page {
    trade::html(trade, command)
}

/// Page for the results of a sweep or a comparison, whose files begin with `stem`, with the `command` that made them.
pub fn sweep_html(merged: &Merged, stem: &str, command: &str) -> Page {
    points::html(merged, stem, command)
}

#[cfg(test)]
mod tests;
