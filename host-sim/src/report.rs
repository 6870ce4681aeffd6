//! Reports as self-contained pages: tables and figures, drawn from result structs and nothing else.
//!
//! The figures are drawn here rather than by a chart crate because their colours are CSS classes:
//! one page serves light and dark.

use taxel_data::output::Inner;

pub mod format;
pub mod ticks;
pub mod svg;
pub mod axes;
mod data;
pub mod chart;
mod figures;
mod colour;
mod voronoi;
mod face;
mod face_map;
mod plot;
mod errors;
mod frames;
mod sketch;
mod noise;
mod over_time;
mod sections;
mod quantity;
mod moving;
mod table1;
mod judged;
mod run;
mod points;
mod layouts;
mod trade;
mod limit;

pub use errors::Pictures;
pub use figures::{FOLDER as FIGURES, Page};
pub use judged::{Judged, errors_of, sections as of_judged, worth};
pub use layouts::{reason, sections as of_layouts};
pub use limit::{sections as of_limit, several as of_limits};
pub use points::{points, sections as of_sweep};
pub use run::{in_words, reasons, sections as of_run};
pub use sections::{Digits, Sections, Table, TableOf};
pub use table1::{csv as table1_csv, sections as of_table1};
pub use trade::{With as TradeWith, sections as of_trade};

/// Files of figures of these names.
pub const fn figures_named(names: &'static [&'static str]) -> Inner {
    Inner { folder: FIGURES, names, endings: &["svg", "csv"] }
}

#[cfg(test)]
mod tests;
