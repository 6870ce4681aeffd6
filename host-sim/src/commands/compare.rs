//! Command `compare`: layouts side by side, by their least possible error, the best decoder, and what both cost.

use std::collections::BTreeSet;
use std::path::Path;

use crate::sweep::bounds::Bound;
use crate::sweep::fields::require_known;
use crate::sweep::file::Wanted;
use crate::sweep::plan::{Base, SEED};
use crate::sweep::{Merged, Plan, layouts, work};
use crate::training_options::{Training, TrainingOptions};
use crate::{Error, Result, report};
use clap::Args;
use toml::Value;

use super::decoder_arguments::{DecoderArguments, ReadoutOption, of_field};
use super::merged::Files;
use super::progress::Terminal;
use super::subject_argument::fields_of;
use super::{Common, arguments, command_line, print};

/// Compare layouts of a sensor: the least possible error, the best decoder, its scan and its cost.
///
/// A scene may have lists where a value is expected, such as `pitch_mm = [3, 4, 5]`: every combination of listed values
/// is then a layout. For every layout, the most accurate decoder within the bound is chosen, or the fastest of those
/// whose errors do not differ significantly.
///
/// -o writes compare.csv, compare.json, a page compare.html and pictures. Each decoder is saved in points/ there as soon
/// as it is evaluated: a comparison that was stopped continues where it was.
#[derive(Args)]
#[command(after_help = "Examples:
  taxel compare thin.toml thick.toml
  taxel compare layouts.toml --centres 32,64,128 --average 1,4 --max-latency-ms 10 -o out/layouts")]
pub struct Arguments {
    /// Scenes: built-in ones (paper, press, contact, moving, shear), or scene files (.toml).
    #[arg(required = true)]
    scenes: Vec<String>,
    #[command(flatten)]
    tried: DecoderArguments,
    /// Train nothing: compute only the least possible error and the scan.
    #[arg(long, conflicts_with = "max_latency_ms")]
    limit_only: bool,
    #[command(flatten)]
    to: arguments::OutputFolder,
    #[command(flatten)]
    training: TrainingOptions,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<print::Outcome> {
    let files = arguments
        .to
        .output
        .as_ref()
        .map(|folder| Files::of(&folder.join("compare.csv")))
        .transpose()?;
    let inputs: Vec<&Path> = arguments.scenes.iter().map(Path::new).collect();
    files.as_ref().map_or(Ok(()), |files| files.check(&inputs))?;
    let bases = arguments.scenes.iter().map(|scene| layouts::of_scene(scene));
    let bases: Vec<Base> = bases.collect::<Result<Vec<_>>>()?.concat();
    let labels: BTreeSet<&str> = bases.iter().map(|base| base.label.as_str()).collect();
    if labels.len() < bases.len() {
        return Err(Error::Usage("a scene is given twice; give each once".into()));
    }
    if arguments.limit_only {
        let message =
            |option: &str| format!("{option}: --limit-only trains nothing; give one of them");
        arguments::refuse(&arguments.training, |_| true, message)?;
    }
    check(&arguments.training)?;
    let first = bases.first().map_or(String::new(), |base| base.label.clone());
    let build = super::sweep::build()?;
    let plan = Plan::new("compare", (bases, None), wanted(arguments, common)?, &build);
    let mut plan = plan.map_err(of_field)?;
    if let Some(group) = &arguments.tried.group {
        let groups = plan.groups();
        let known: Vec<&str> = groups.iter().map(String::as_str).collect();
        require_known("--group", group, &known).map_err(arguments::of_option)?;
        let error = if plan.train { "rmse" } else { "limit" };
        plan.objectives[0] = format!("{error}_{group}");
    }
    let points = plan.points()?;
    if plan.groups().is_empty() {
        let message = "the scenes have no common output whose error could be compared: give others";
        return Err(Error::Usage(message.into()));
    }
    let merged = match &arguments.to.output {
        Some(folder) => super::sweep::all(&plan, &points, folder, common)?,
        None => {
            Merged::new(&plan, &points, work::in_memory(&plan, &points, &Terminal::new(common))?)
        }
    };
    if let Some(failed) = merged.failed().next().filter(|_| merged.settings.is_empty()) {
        return Err(Error::Usage(report::reason(failed, &first)));
    }
    let sections = report::of_layouts(&merged, &first);
    let mut written = vec![];
    if let Some(files) = &files {
        let command = command_line::of_this_process("compare", &["-o", "--output"], common.seed);
        files.write(&merged, &sections, &command, common)?;
        written.push(format!("\nwritten: {}", files.names()));
    }
    Ok(print::sections_above(common, &sections, &written).and(merged.check_bounds()))
}

/// Checks what holds for all layouts, so that a refusal names an option, and not a field of the plan.
fn check(training: &TrainingOptions) -> Result<()> {
    let check_one = |centres| {
        let one = TrainingOptions { centres: Some(vec![centres]), ..training.clone() };
        // The number of frames is that of each scene.
        one.over(&Training::default())?.options.check(usize::MAX)
    };
    let centres = training.centres.clone().unwrap_or(vec![1]);
    let checked = centres.into_iter().try_for_each(check_one);
    checked.map_err(|bad| arguments::of_option(arguments::named(bad, training)))
}

/// What is wanted of the layouts.
fn wanted(arguments: &Arguments, common: &Common) -> Result<Wanted> {
    let whole = |value: usize| Value::Integer(i64::try_from(value).unwrap_or(i64::MAX));
    let mut wanted = Wanted { train: !arguments.limit_only, ..Wanted::default() };
    wanted.limit_frames = arguments.tried.limit.frames();
    wanted.set = fields_of(&arguments.training)?;
    wanted.set.remove("training.centres");
    let centres = arguments.training.centres.as_deref().unwrap_or_default();
    let axes = [("training.centres", centres), ("device.samples", &arguments.tried.average)];
    for (field, values) in axes.into_iter().filter(|(_, values)| !values.is_empty()) {
        let values = values.iter().map(|value| whole(*value)).collect();
        wanted.axes.insert(field.into(), Value::Array(values));
    }
    if let ReadoutOption::Spi = arguments.tried.readout {
        wanted.device.insert("readout".into(), "spi".into());
    }
    wanted.set.extend(common.seed_in_scene()?.map(|seed| (SEED.into(), seed)));
    wanted
        .bounds
        .extend(arguments.tried.max_latency_ms.map(|most| ("frame_ms".into(), Bound::Most(most))));
    Ok(wanted)
}
