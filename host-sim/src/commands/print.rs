//! Printing of results on stdout: aligned tables for people, JSON for programs.

use std::fmt::{Display, Write as _};
use std::io::{self, ErrorKind, Write as _};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use crate::by_load::LoadErrors;
use crate::metrics::{self, DecoderErrors, Definition, Errors, NETWORK};
use crate::others::Others;
use crate::report;
use crate::verdict::Verdict;
use crate::{Error, Result};
use serde::Serialize;
use taxel_data::error::printable;
use taxel_data::output;
use taxel_learn::decoders::mean;

use super::{Common, captured, stdout};

/// Page of text for people, printed as a whole.
#[derive(Default)]
pub struct Page(String);

impl Page {
    /// Adds a line.
    pub fn line(&mut self, line: impl Display) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.0, "{line}");
    }

    /// Page of one line.
    pub fn of(line: impl Display) -> Self {
        let mut page = Self::default();
        page.line(line);
        page
    }

    /// Prints the page.
    pub fn print(self) -> Result<()> {
        show(&printable(&self.0))
    }
}

/// Whether stdout is taken by an output, so that results go to stderr.
static STDOUT_IS_TAKEN: AtomicBool = AtomicBool::new(false);

/// Checks before long work that an output can be written to `path`, and would replace none of the `inputs`. If it is
/// stdout, results go to stderr from now on.
pub fn check_output(path: &Path, inputs: &[&Path]) -> Result<()> {
    if output::is_stdout(path) {
        if stdout::was_closed() {
            return Err(taxel_data::Error::write(path, io::Error::other("stdout is closed")).into());
        }
        STDOUT_IS_TAKEN.store(true, Ordering::Relaxed);
    }
    Ok(output::check_writable(path, inputs)?)
}

/// Shows a result; a reader who has seen enough (`| head`) is no failure.
pub fn show(text: &str) -> Result<()> {
    if captured::keep_result(text) {
        return Ok(());
    }
    let (place, written) = if STDOUT_IS_TAKEN.load(Ordering::Relaxed) {
        ("stderr", io::stderr().write_all(text.as_bytes()))
    } else {
        ("stdout", io::stdout().write_all(text.as_bytes()))
    };
    match written {
        Err(cause) if cause.kind() != ErrorKind::BrokenPipe => {
            Err(Error::failed(format!("cannot write to {place}: {cause}")))
        }
        _ => Ok(()),
    }
}

/// Command that was begun last, and when.
static BEGUN: Mutex<(String, Option<Instant>)> = Mutex::new((String::new(), None));

/// Notes that `command` begins, for what [`json`] says of it.
pub fn begin(command: &str) {
    *BEGUN.lock().unwrap_or_else(PoisonError::into_inner) = (command.into(), Some(Instant::now()));
}

/// Result of a command with what all of them say (docs/json.md).
#[derive(Serialize)]
struct Document<'r, R> {
    version: &'static str,
    command: &'r str,
    /// Time since the command began; `None` in files, which are the same whenever they are written.
    #[serde(skip_serializing_if = "Option::is_none")]
    seconds: Option<f64>,
    #[serde(flatten)]
    result: &'r R,
}

/// Result as JSON for a file.
pub fn json_text(result: &impl Serialize) -> Result<String> {
    document(result, false)
}

fn document(result: &impl Serialize, timed: bool) -> Result<String> {
    let (command, begun) = BEGUN.lock().unwrap_or_else(PoisonError::into_inner).clone();
    let document = Document {
        version: env!("CARGO_PKG_VERSION"),
        command: &command,
        seconds: begun.filter(|_| timed).map(|begun| begun.elapsed().as_secs_f64()),
        result,
    };
    let text = serde_json::to_string_pretty(&document);
    Ok(text.map_err(|cause| Error::failed(format!("cannot write JSON: {cause}")))? + "\n")
}

/// Prints the result of the command as JSON.
pub fn json(result: &impl Serialize) -> Result<()> {
    show(&document(result, true)?)
}

/// Prints the result of the command: as JSON if that was asked for, else as a page.
pub fn result(common: &Common, result: &impl Serialize, page: impl FnOnce() -> Page) -> Result<()> {
    if common.json { json(result) } else { page().print() }
}

/// Adds one line a decoder and group, under a header of definitions.
pub fn errors(page: &mut Page, decoders: &[(&str, &[Errors])]) {
    let names = decoders.iter().flat_map(|(_, groups)| groups.iter().map(|e| e.group.len()));
    let width = names.max().unwrap_or(0).max(10);
    page.line(format_args!(
        "{:<8} {:<width$} {:>9}    {:>12} {:>8} {:>7} {:>9} {:>8} {:>9}",
        "decoder", "output", "RMSE", "× limit", "rel. L2", "%FS", "position", "R²", "mean rel"
    ));
    for (decoder, groups) in decoders {
        for group in *groups {
            let percent = |definition: Definition| {
                definition.of(group).map_or("-".into(), |value| format!("{value:.2} %"))
            };
            page.line(format_args!(
                "{:<8} {:<width$} {:>9} {:<2} {:>12} {:>8} {:>7} {:>9} {:>8} {:>9}",
                decoder,
                group.group,
                number(group.rmse),
                group.unit,
                ratio(group),
                percent(Definition::RelativeL2Percent),
                percent(Definition::FullScalePercent),
                percent(Definition::PositionalPercent),
                r_squared(group),
                percent(Definition::MeanRelativePercent)
            ));
        }
    }
}

/// Adds the verdict on a model, and its warnings. `judged_on` names the frames that it was judged on.
pub fn verdict(page: &mut Page, judged_on: Option<&str>, verdict: &Verdict) {
    page.line("");
    match judged_on {
        Some(frames) => wrapped(page, &format!("{frames}: {}", verdict.sentence)),
        None => wrapped(page, &verdict.sentence),
    }
    for warning in &verdict.warnings {
        wrapped(page, &warning.to_string());
    }
}

/// Adds text in lines of at most 110 characters.
pub fn wrapped(page: &mut Page, text: &str) {
    page.line(report::wrapped(text, 110).trim_end());
}

/// Adds a table of RMSE by the depth or force of the contact, if there is one; of the centroid below the model's.
pub fn by_load(page: &mut Page, ranges: &[LoadErrors]) {
    let Some(first) = ranges.first() else { return };
    let groups =
        first.errors.iter().map(|e| format!(" {:>19}", format!("{}, {}", e.group, e.unit)));
    let groups: String = groups.collect();
    page.line(format_args!(
        "\nRMSE by true {}\n{:<16} {:>7}{groups}",
        first.load, "range", "frames"
    ));
    for range in ranges {
        let mut line = |head: &str, frames: &str, errors: &[Errors]| {
            let errors = errors.iter().map(|e| format!(" {:>19}", number(e.rmse)));
            page.line(format_args!("{head:<16} {frames:>7}{}", errors.collect::<String>()));
        };
        line(&range.range(), &range.frames.to_string(), &range.errors);
        if !range.centroid.is_empty() {
            line("  centroid", "", &range.centroid);
        }
    }
}

/// Adds errors on contacts that a model was not trained on, below those on its `own`.
pub fn others(page: &mut Page, others: &Others, decoders: &[DecoderErrors]) {
    let [own, own_mean] = [NETWORK, mean::NAME].map(|name| metrics::of_decoder(decoders, name));
    let groups = own.iter().map(|e| format!(" {:>23}", format!("{}, {}", e.group, e.unit)));
    page.line(format_args!(
        "\n{:<24}{}{:>9}",
        "other contacts",
        groups.collect::<String>(),
        "novel"
    ));
    let heads = format!(" {:>8} {:>6} {:>7}", "RMSE", "R²", "mean").repeat(own.len());
    page.line(format_args!("{:<24}{heads}", ""));
    let mut line = |name: &str, errors: &[Errors], mean: &[Errors], novel: Option<f64>| {
        let of_group = |(errors, mean): (&Errors, &Errors)| {
            let r_squared = errors.r_squared.map_or("-".into(), |it| format!("{it:.2}"));
            format!(" {:>8} {r_squared:>6} {:>7}", number(errors.rmse), number(mean.rmse))
        };
        let groups: String = errors.iter().zip(mean).map(of_group).collect();
        let novel = novel.map_or("-".into(), |percent| format!("{percent:.1} %"));
        page.line(format_args!("{name:<24}{groups}{novel:>9}"));
    };
    line("as trained", own, own_mean, others.own_percent_novel);
    for contact in &others.contacts {
        line(&contact.name, &contact.errors, &contact.mean, contact.percent_novel);
    }
    page.line(format_args!(
        "mean: RMSE of always predicting the mean of training; novel: frames that a confidence notices; {} frames each",
        others.frames
    ));
}

/// Ratio of an error to the limit with its standard error; a dash where there is no limit.
pub fn ratio(errors: &Errors) -> String {
    match (errors.ratio_to_limit, errors.ratio_standard_error) {
        (Some(ratio), Some(error)) => format!("{ratio:.2} ± {error:.2}"),
        _ => "-".into(),
    }
}

/// R² with four decimals, or in powers of ten where it is far below 0; a dash where there is none.
pub fn r_squared(errors: &Errors) -> String {
    match errors.r_squared {
        None => "-".into(),
        Some(value) if value < -999.0 => format!("{value:.1e}"),
        // Adding 0 after rounding turns −0 into 0.
        Some(value) => format!("{:.4}", (value * 1e4).round() / 1e4 + 0.0),
    }
}

/// Text of an error with four decimals, or in powers of ten where these would say nothing.
fn number(value: f64) -> String {
    if value == 0.0 || (1e-3..1e5).contains(&value) {
        format!("{value:.4}")
    } else {
        format!("{value:.3e}")
    }
}

/// Explains the columns of [`errors`].
pub fn errors_legend(page: &mut Page) {
    page.line(
        "rel. L2 = ‖e‖/‖Δ‖; %FS = mean|e|/full scale; position = mean|e|/(H − Δz);\n\
         mean rel = mean(|e|/|Δ|) where |Δ| > 10 % FS;\n\
         × limit = RMSE/least possible RMSE, on the frames of the limit;\n\
         full scale (FS): the largest deformation that the scene allows, or a measured column's range",
    );
}
