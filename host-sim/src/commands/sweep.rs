//! Command `sweep`: all points of a plan, here or in shards on other machines.

use std::path::{Path, PathBuf};

use crate::report::format::counted;
use crate::report::{self, Sections, TableOf};
use crate::sweep::{Merged, Plan, Point, Shard, Store, work};
use crate::training_options::TrainingOptions;
use crate::{Error, Result};
use clap::{Arg, Args, value_parser};
use taxel_data::BadValue;
use taxel_data::digest::digest;

use super::merged::Files;
use super::progress::Terminal;
use super::subject_argument::PlannedData;
use super::{Common, arguments, command_line, print};

mod schedule;
mod estimate;

/// Compute every point of a plan: many scenes, devices and models, here or on many machines.
///
/// A plan (docs/sweeps.md) has a scene and axes. Every point is saved as a file in DIR/points. Points that are there
/// already are not computed again, so a sweep that was stopped continues where it was. When all points are done,
/// results.csv, results.json, results.html and two pictures are written to DIR, which is out/NAME after the plan's name
/// unless -o says otherwise.
///
/// On a cluster, every machine computes a shard (--shard, or --shards in an array of Slurm or HyperQueue, or in GNU
/// parallel), and --merge reads what all of them wrote; -o is then the file for the table of results (.csv), and the
/// others are written beside it. Results do not depend on the number of shards.
#[derive(Args)]
// A plan has its own seeds.
#[command(arg = Arg::new("seed").long("seed").value_parser(value_parser!(u64)).hide(true))]
#[command(after_help = "Examples:
  taxel sweep cluster/plans/small.toml
  taxel sweep plan.toml --list
  taxel sweep plan.toml --dry-run
  taxel sweep plan.toml --shard 3/8 -o out/plan
  taxel sweep plan.toml --merge out/plan -o results.csv")]
pub struct Arguments {
    /// Plan (.toml).
    plan: PathBuf,
    #[command(flatten)]
    to: arguments::OutputFolder,
    /// Print identity and fields of every point, and compute nothing.
    #[arg(long, conflicts_with_all = ["merge", "dry_run", "output"])]
    list: bool,
    /// Compute only this part of the points, such as 3/8: the third of eight.
    #[arg(long, value_name = "I/N", conflicts_with_all = ["merge", "dry_run"])]
    shard: Option<Shard>,
    /// Compute only one of so many parts: the one that the scheduler names (`SLURM_ARRAY_TASK_ID`, `HQ_TASK_ID` or
    /// `PARALLEL_SEQ`, from 1) [default, in an array of Slurm: its number of tasks].
    #[arg(long, value_name = "N", conflicts_with_all = ["shard", "merge", "dry_run"])]
    shards: Option<usize>,
    /// Write the results in this folder of a sweep as a table, a page and pictures.
    #[arg(long, value_name = "DIR", conflicts_with = "dry_run", value_parser = arguments::folder())]
    merge: Option<PathBuf>,
    /// Compute a few points, and estimate the time and memory that all would take.
    #[arg(long, conflicts_with = "output")]
    dry_run: bool,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<print::Outcome> {
    if common.seed.is_some() {
        let message = "--seed: a plan has its own seeds; give `repeats`, or `seed` in [set]";
        return Err(Error::Usage(message.into()));
    }
    let of_plan = |bad: BadValue| {
        Error::from(taxel_data::Error::unfit(format!("plan {}: {bad}", arguments.plan.display())))
    };
    let load = |data: &toml::Table, training: &TrainingOptions, seed| {
        let data = PlannedData::read(data, &arguments.plan)?.load(training, seed, common);
        data.map_err(|error| match error {
            Error::Data(taxel_data::Error::Setting(bad)) => of_plan(bad),
            error => error,
        })
    };
    let plan = Plan::read(&arguments.plan, &build()?, &load)?;
    let points = plan.points().map_err(of_plan)?;
    if arguments.dry_run {
        return estimate::execute(&plan, &points, common);
    }
    if let Some(folder) = &arguments.merge {
        let table = arguments.to.output.clone().unwrap_or_else(|| folder.join(RESULTS));
        return merge(&plan, &points, folder, &table, arguments, common);
    }
    let shard = schedule::shard(arguments.shard, arguments.shards, common)?;
    if arguments.list {
        return Ok(list(&plan, &points, shard, common));
    }
    let folder = arguments.to.output.clone().unwrap_or_else(|| Path::new("out").join(&plan.name));
    let table = folder.join(RESULTS);
    if shard.is_none() {
        Files::of(&table)?.check(&[&arguments.plan])?;
    }
    let worked = work(&plan, &points, shard.unwrap_or(Shard::WHOLE), &folder, common)?;
    match shard {
        None => merge(&plan, &points, &folder, &table, arguments, common),
        Some(shard) => {
            worked
                .failed
                .iter()
                .for_each(|failed| common.remark(format_args!("warning: {failed}")));
            let mut sections = Sections::new(format!("Shard {shard} of the sweep {}", plan.name));
            sections.value("plan", &plan.name);
            sections.value("shard", &shard.to_string());
            sections.fact("points", "points", "", worked.computed + worked.skipped);
            sections.fact("computed", "computed", "", worked.computed);
            sections.fact("there_already", "there already", "", worked.skipped);
            sections.fact("failed", "failed", "", worked.failed.len());
            Ok(print::sections(common, &sections))
        }
    }
}

/// Results of all points of a plan, each of which is kept in `folder` as soon as it is done; those that are there already
/// are not computed again.
pub fn all(plan: &Plan, points: &[Point], folder: &Path, common: &Common) -> Result<Merged> {
    work(plan, points, Shard::WHOLE, folder, common)?;
    Merged::read(plan, points, &store(folder))
}

/// Computes a shard's points into `folder`, and remarks on files that are replaced.
fn work(
    plan: &Plan,
    points: &[Point],
    shard: Shard,
    folder: &Path,
    common: &Common,
) -> Result<work::Worked> {
    let groups = shard.groups(points);
    let worked = work::run(plan, points, &groups, &store(folder), &Terminal::new(common))?;
    for replaced in &worked.replaced {
        common.remark(format_args!("note: {replaced}; it is computed again"));
    }
    Ok(worked)
}

/// Table of results in the folder of a sweep.
const RESULTS: &str = "results.csv";

fn store(folder: &Path) -> Store {
    Store::new(&folder.join("points"))
}

/// Version of this program, and a digest of it: another one may compute something else.
pub fn build() -> Result<String> {
    let failed = |cause| Error::failed(format!("cannot read the program's own file: {cause}"));
    let bytes = std::env::current_exe().and_then(std::fs::read).map_err(failed)?;
    Ok(format!("taxel {} {:016x}", env!("CARGO_PKG_VERSION"), digest(&bytes)))
}

/// Prints the points of the plan, or of a shard.
fn list(plan: &Plan, points: &[Point], shard: Option<Shard>, common: &Common) -> print::Outcome {
    let shown: Vec<&Point> = match shard {
        None => points.iter().collect(),
        Some(shard) => shard.groups(points).concat().into_iter().map(|i| &points[i]).collect(),
    };
    if !common.json {
        let mut page = print::Page::default();
        shown
            .iter()
            .for_each(|point| page.line(format_args!("{}  {}", point.id, plan.in_words(point))));
        return page.outcome();
    }
    let mut sections = Sections::default();
    sections.value("plan", &plan.name);
    let value = |point: &Point, field: &String| {
        let value = point.values.iter().find(|(known, _)| known == field);
        value.and_then(|(_, value)| serde_json::to_value(value).ok()).unwrap_or_default()
    };
    let mut table = TableOf::new(&shown, "Points.").values("id", |point| point.id.as_str().into());
    for field in &plan.fields {
        table = table.values(field, |point| value(point, field));
    }
    sections.rows("points", table);
    print::sections(common, &sections)
}

/// Writes the results of all points that are there, and names those that are not.
fn merge(
    plan: &Plan,
    points: &[Point],
    folder: &Path,
    table: &Path,
    arguments: &Arguments,
    common: &Common,
) -> Result<print::Outcome> {
    const NAMED: usize = 10;
    let files = Files::of(table)?;
    files.check(&[&arguments.plan])?;
    let store = store(folder);
    let merged = Merged::read(plan, points, &store)?;
    if merged.points.is_empty() {
        return Err(Error::failed(format!(
            "{} has no results of this plan from this program, and nothing is written; give the folder that its shards wrote to",
            folder.display()
        )));
    }
    let others = store.others(points);
    if !others.is_empty() {
        let first = others.iter().take(NAMED).map(String::as_str).collect::<Vec<_>>().join(", ");
        common.remark(format_args!(
            "note: {} in {}, which belong to no point of this plan and program, are left out: {first}{}",
            counted(others.len(), "file"),
            folder.join("points").display(),
            if others.len() > NAMED { ", …" } else { "" }
        ));
    }
    for failed in merged.failed().take(NAMED) {
        let why = failed.failed.as_deref().unwrap_or_default();
        common.remark(format_args!("warning: point {} failed: {why}", failed.id));
    }
    if merged.points.iter().all(|point| point.failed.is_some()) && !merged.points.is_empty() {
        return Err(Error::failed("every point failed; the warnings say why"));
    }
    let command = command_line::of_this_process("sweep", &[], None);
    let sections = report::of_sweep(&merged, files.stem());
    files.write(&merged, &sections, &command, common)?;
    let written = format!("\nwritten: {}", files.names());
    let outcome = print::sections_above(common, &sections, &[written]);
    let missing = merged.missing.len();
    if missing == 0 {
        return Ok(outcome.and(merged.check_bounds()));
    }
    let first =
        merged.missing.iter().take(NAMED).map(String::as_str).collect::<Vec<_>>().join(", ");
    Ok(outcome.and(Err(Error::failed(format!(
        "{missing} of {} points are missing, and the files have only the others: {first}{}; run their shards, then merge again",
        points.len(),
        if missing > NAMED { ", …" } else { "" }
    )))))
}
