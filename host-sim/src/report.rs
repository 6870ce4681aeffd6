//! Reports as self-contained pages: tables and figures, drawn from result structs and nothing else.
//!
//! The figures are drawn here rather than by a chart crate because their colours are CSS classes:
//! one page serves light and dark.

use taxel_data::output::Inner;
use taxel_evaluate::run::RunResult;

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
pub use points::{result_text, sections as of_points};
pub use sections::{Digits, Sections, TableOf, wrapped};
pub use trade::sections as of_trade;
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

#[cfg(test)]
mod tests;
