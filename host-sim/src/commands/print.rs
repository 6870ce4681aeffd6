//! Results on stdout: aligned tables for people, JSON for programs.

use host_sim::evaluate::metrics::{Definition, Errors};
use host_sim::{Error, Result};
use serde::Serialize;

/// Prints `value` as JSON.
pub fn json(value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value)
        .map_err(|cause| Error::Failed(format!("cannot write JSON: {cause}")))?;
    println!("{text}");
    Ok(())
}

/// Prints one line a decoder and group, under a header of definitions.
pub fn errors(decoders: &[(&str, &[Errors])]) {
    println!(
        "{:<8} {:<10} {:>9}    {:>8} {:>7} {:>9} {:>8} {:>9}",
        "decoder", "output", "RMSE", "rel. L2", "%FS", "position", "R²", "mean rel"
    );
    for (decoder, groups) in decoders {
        for group in *groups {
            let percent = |definition: Definition| {
                definition.of(group).map_or("-".into(), |value| format!("{value:.2} %"))
            };
            println!(
                "{:<8} {:<10} {:>9.4} {:<2} {:>8} {:>7} {:>9} {:>8} {:>9}",
                decoder,
                group.group,
                group.rmse,
                group.unit,
                percent(Definition::RelativeL2Percent),
                percent(Definition::FullScalePercent),
                percent(Definition::PositionalPercent),
                group.r_squared.map_or("-".into(), |value| format!("{value:.4}")),
                percent(Definition::MeanRelativePercent),
            );
        }
    }
}

/// Explains the columns of [`errors`] in one line.
pub fn errors_legend() {
    println!(
        "rel. L2 = ‖e‖/‖Δ‖; %FS = mean|e|/full scale; position = mean|e|/(H − Δz); \
         mean rel = mean(|e|/|Δ|) where |Δ| > 10 % FS"
    );
}
