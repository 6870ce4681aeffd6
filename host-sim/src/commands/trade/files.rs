//! Files that the command writes.

use std::path::Path;

use crate::trade::{Shown, Trade};
use crate::{Result, report};
use taxel_data::output::FileSet;

use super::super::print;

/// All files that the command may write.
pub const FILES: FileSet = FileSet {
    files: &["trade.csv", "trade.json", "trade.html", "chosen.bin"],
    inner: report::figures_named(&["error-by-time"]),
};

/// Writes them to `folder`; `command` is what the user typed.
pub fn write(folder: &Path, (trade, shown): (&Trade, Option<&Shown>), command: &str) -> Result<()> {
    let csv = trade.merged.csv();
    let json = print::json_text(trade)?;
    let page = report::of_trade(trade, shown, false).page(command);
    let mut files = vec![
        ("trade.csv", csv.as_bytes()),
        ("trade.json", json.as_bytes()),
        ("trade.html", page.html.as_bytes()),
    ];
    files.extend(page.figures.iter().map(|(path, text)| (path.as_str(), text.as_bytes())));
    let chosen = shown.filter(|_| trade.chosen.is_some());
    files.extend(chosen.map(|shown| ("chosen.bin", shown.blob.as_slice())));
    Ok(FILES.write(folder, &files)?)
}
