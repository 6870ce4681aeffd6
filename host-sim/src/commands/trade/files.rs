//! Files that the command writes.

use std::fmt::Write as _;
use std::path::Path;

use crate::evaluate::trade::Trade;
use crate::metrics::Errors;
use crate::{Result, report};
use taxel_data::output::FileSet;

use super::super::print;

/// All files that the command may write.
pub const FILES: FileSet = FileSet {
    files: &["trade.csv", "trade.json", "trade.html", "chosen.bin"],
    inner: report::figures_named(&["error-by-time"]),
};

/// Writes them to `folder`; `command` is what the user typed.
pub fn write(folder: &Path, trade: &Trade, command: &str) -> Result<()> {
    let csv = csv_of(trade);
    let json = print::json_text(trade)?;
    let page = report::of_trade(trade, false).page(command);
    let mut files = vec![
        ("trade.csv", csv.as_bytes()),
        ("trade.json", json.as_bytes()),
        ("trade.html", page.html.as_bytes()),
    ];
    files.extend(page.figures.iter().map(|(path, text)| (path.as_str(), text.as_bytes())));
    files.extend(trade.chosen.map(|point| ("chosen.bin", trade.blob(point))));
    Ok(FILES.write(folder, &files)?)
}

/// Table of all points.
fn csv_of(trade: &Trade) -> String {
    let rmse = trade
        .groups()
        .map(|(group, _)| format!("{group}_rmse,{group}_ratio_to_best,{group}_ratio_to_limit"));
    let mut csv = format!(
        "format,each_row,centres,spread,columns,samples_averaged,filter_ms,lead_ms,{},instructions,cycles,scan_ms,decode_ms,frame_ms,frames_per_s,age_ms,blob_bytes,ram_bytes,\
         on_front,chosen\n",
        rmse.collect::<Vec<_>>().join(",")
    );
    for (i, p) in trade.points.iter().enumerate() {
        let errors = p.errors.iter().zip(&p.ratio_to_best);
        let to_limit = |e: &Errors| e.ratio_to_limit.map_or(String::new(), |r| r.to_string());
        let errors = errors.map(|(e, ratio)| format!("{},{ratio},{}", e.rmse, to_limit(e)));
        let errors = errors.collect::<Vec<_>>();
        let _ = writeln!(
            csv,
            "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
            p.format.name(),
            p.each_row,
            p.centres,
            p.spread,
            p.columns.map_or(String::new(), |columns| columns.to_string()),
            p.samples_averaged,
            p.filter.map_or(String::new(), |filter| filter.time_constant_ms.to_string()),
            p.filter.map_or(String::new(), |filter| filter.lead_ms.to_string()),
            errors.join(","),
            p.frame.instructions,
            p.frame.cycles,
            p.times.scan_ms.map_or(String::new(), |ms| ms.to_string()),
            p.times.decode_ms,
            p.times.frame_ms,
            p.times.frames_per_s,
            p.times.age_ms.map_or(String::new(), |ms| ms.to_string()),
            p.blob_bytes,
            p.ram_bytes,
            p.on_front,
            trade.chosen == Some(i)
        );
    }
    csv
}
