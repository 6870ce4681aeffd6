//! What the command prints.

use std::path::Path;

use crate::report;
use crate::trade::{Shown, Trade};

use crate::commands::print::Page;

/// Page of the front, or of `all` points; the last lines say where files are.
pub fn of((trade, shown): (&Trade, Option<&Shown>), all: bool, folder: &Path) -> Page {
    let mut page = Page::of(report::of_trade(trade, shown, all).text());
    if trade.chosen.is_some() {
        page.line(format_args!("the blob: {}", folder.join("chosen.bin").display()));
    }
    page.line(format_args!("open {}", folder.join("trade.html").display()));
    page
}
