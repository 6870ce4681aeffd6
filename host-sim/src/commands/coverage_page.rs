//! Table of the errors that a model's intervals cover.

use crate::evaluate::confidence::{Coverage, Covered};

use super::print;

/// Adds one line a group: all errors, and those of the surest and of the least sure quarter.
pub fn add(page: &mut print::Page, coverage: &[Coverage]) {
    let widest = coverage.iter().map(|group| group.group.len()).max().unwrap_or(0).max(10);
    page.line(format_args!(
        "{:<widest$} {:>24}   {:>24}   {:>24}",
        "", "all outputs", "surest quarter", "least sure quarter"
    ));
    let header = format!("{:>8} {:>7} {:>7}", "RMSE", "in 68 %", "in 95 %");
    page.line(format_args!("{:<widest$} {header}   {header}   {header}", "output"));
    for group in coverage {
        let of = |covered: Covered| {
            format!(
                "{:>8.4} {:>5.1} % {:>5.1} %",
                covered.rmse, covered.percent_within_68, covered.percent_within_95
            )
        };
        page.line(format_args!(
            "{:<widest$} {}   {}   {}",
            group.group,
            of(group.all),
            of(group.surest_quarter),
            of(group.least_sure_quarter)
        ));
    }
}
