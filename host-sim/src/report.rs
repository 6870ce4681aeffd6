//! A run as one self-contained page: tables and figures, drawn from [`RunResult`] and nothing else.
//!
//! The figures are drawn here rather than by a chart crate because their colours are CSS classes:
//! one page serves light and dark.

use crate::run::RunResult;

mod chart;
mod figures;
mod format;
mod heat_map;
mod html;
mod svg;
mod tables;
mod ticks;

/// The page for `result`: no script, no file beside it, the same bytes for the same result.
#[must_use]
pub fn html(result: &RunResult) -> String {
    html::page(result)
}

#[cfg(test)]
mod tests;
