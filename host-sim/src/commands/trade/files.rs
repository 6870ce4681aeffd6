//! Files that the command writes.

use std::path::Path;

use crate::Result;
use crate::report::{self, Sections};
use crate::trade::{Shown, Trade};
use taxel_data::output::FileSet;

use super::super::{Common, print};

/// All files that the command may write.
pub const FILES: FileSet = FileSet {
    files: &["trade.csv", "trade.json", "trade.html", "chosen.bin"],
    inner: report::figures_named(&["error-by-time"]),
};

/// Writes them to `folder`: a trade and the model that is shown, their sections, and the command that the user typed.
pub fn write(
    folder: &Path,
    (trade, shown): (&Trade, Option<&Shown>),
    (sections, command): (&Sections, &str),
    common: &Common,
) -> Result<()> {
    let csv = report::points(&trade.merged).csv();
    let json = print::file_of(common, sections);
    let page = sections.page(command);
    let mut files = vec![("trade.csv", csv.as_bytes()), ("trade.json", json.as_bytes())];
    files.extend(page.files("trade.html"));
    let chosen = shown.filter(|_| trade.chosen.is_some());
    files.extend(chosen.map(|shown| ("chosen.bin", shown.blob.as_slice())));
    Ok(FILES.write(folder, &files)?)
}
