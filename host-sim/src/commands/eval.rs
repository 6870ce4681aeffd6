//! Command `eval`: a model's errors on data whose outputs are known.

use std::path::{Path, PathBuf};

use crate::by_load::{LoadErrors, by_load};
use crate::evaluate::confidence::{Coverage, coverage};
use crate::evaluate::device_cost::DeviceCost;
use crate::evaluate::distribution::{Distribution, Reference};
use crate::measurements::{Log, Spread};
use crate::metrics::{self, DecoderErrors, Errors, GroupRmse, LimitSummary, Measure, NETWORK};
use crate::others::percent_novel;
use crate::over_time::{self, Decoded, OverTime, RestOverTime};
use crate::report::format::grouped;
use crate::report::{self, Judged, Pictures, Sections};
use crate::verdict::{Verdict, Warning};
use crate::{Error, Result};
use clap::Args;
use serde::Serialize;
use taxel_core::blob::Metadata;
use taxel_data::dataset::UnusedInputs;
use taxel_data::{AtRest, Clock, DataFile, Dataset, Table, output};
use taxel_learn::ModelBlob;
use taxel_learn::decoders::{CENTROID, centroid, mean};
use taxel_limit::Refusal;

use super::data_file::{DataFileArguments, TimeArgument};
use super::health::{Health, HealthArguments};
use super::readings::{model_inputs, related, table_of};
use super::rest_argument::UntouchedArguments;
use super::{Common, command_line, print};

/// Evaluate a model on a CSV file of readings and true outputs.
///
/// Readings that a device would not believe count as missing. A model trained with --reading-model tells them from the others;
/// --without shows what that costs.
#[derive(Args)]
#[command(after_help = "Examples:
  host-sim eval press.bin test.csv --html report.html
  host-sim eval relative.bin test.csv --baseline rest.csv
  host-sim eval array.bin test.csv --without 'r4c*_ohm'
  host-sim eval m.bin log.csv --missing -1 --last-share 0.2")]
pub struct Arguments {
    /// Weight blob.
    model: PathBuf,
    /// CSV file or recording (.mcap) with the model's reading and output columns.
    data: PathBuf,
    #[command(flatten)]
    untouched: UntouchedArguments,
    #[command(flatten)]
    health: HealthArguments,
    /// Write a page with the same figures as run's.
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    #[command(flatten)]
    clock: TimeArgument,
    #[command(flatten)]
    file: DataFileArguments,
}

#[derive(Serialize)]
struct Summary {
    model_file: PathBuf,
    model_crc: String,
    data_file: PathBuf,
    /// What the model is worth, in words.
    verdict: Verdict,
    frames: usize,
    /// Number of frames with a value that counts.
    frames_evaluated: usize,
    /// Number of true outputs in the file.
    values: usize,
    /// Number of these that count: neither they nor a reading they need is missing.
    values_evaluated: usize,
    /// Faulty readings, and how many of them were filled.
    health: Health,
    /// Errors of the model, and of always predicting the mean of these outputs; between them those of the centroid, fitted to
    /// these lines, where it is known what they are at rest.
    decoders: Vec<DecoderErrors>,
    /// RMSE of the best linear decoder on frames of the model's training that it was not fitted to; empty if the model does
    /// not tell it.
    linear_at_training: Vec<GroupRmse>,
    /// Errors by the depth of the contact, or of places by the force; empty for other outputs.
    by_load: Vec<LoadErrors>,
    /// Errors and readings at rest by time; `None` if lines are in no order of time.
    over_time: Option<OverTime>,
    /// What the intervals of a model that tells deviations cover; empty without one.
    coverage: Vec<Coverage>,
    /// Share of the frames without missing readings that a model finds novel.
    percent_novel: Option<f64>,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    if let Some(html) = &arguments.html {
        let inputs: Vec<&Path> = [arguments.model.as_path(), arguments.data.as_path()]
            .into_iter()
            .chain(arguments.untouched.path())
            .collect();
        print::check_output(html, &inputs)?;
    }
    let blob = ModelBlob::read(&arguments.model)?;
    let model = blob.prepare();
    let (fields, limits) = (arguments.file.fields(), arguments.health.limits());
    let file = arguments.file.read(&arguments.data)?;
    let parsed = blob.parse();
    let metadata = parsed.metadata();
    let mut readings = model_inputs(&model, &file)?;
    let mut truth = table_of(&file, metadata.output_names.iter())?;
    let clock = Clock::of(&file, arguments.clock.time.as_deref())?;
    let log = Log { clock, lines: (0..file.lines()).collect() };
    let rest = if over_time::is_log(&log, &truth) {
        arguments.untouched.rest(&file, metadata, limits)?
    } else {
        arguments.untouched.rest_if_relative(&file, metadata, limits)?
    };
    let of_lines = (rest.as_ref(), file.lines());
    let baselines =
        arguments.untouched.baselines(metadata, &arguments.model, of_lines, fields, limits)?;
    let mut health = arguments.health.apply(&model, &mut readings, baselines.as_ref())?;
    let lines_at_rest = rest.as_ref().and_then(|rest| rest.lines.clone());
    let at_rest =
        rest.and_then(|rest| RestOverTime::new(&rest, &log.clock, &Spread::of(&readings)));
    let (model, readings) = related(model, readings, baselines.as_ref(), &mut health.is_faulty);
    let mut estimate = model.decode_table(&readings);
    let with_untold = estimate.values.clone();
    estimate.values = truth.with_places(estimate.values.into_vec()).into();
    let measure = measure_of(metadata);
    // The mean is judged on the same pairs as the model, and computed from them.
    let pairs = truth.values.iter_mut().zip(&estimate.values);
    pairs.filter(|(_, estimate)| estimate.is_nan()).for_each(|(truth, _)| *truth = f64::NAN);
    let is_empty = |line: &&[f64]| line.iter().all(|value| value.is_nan());
    let without_reading = estimate.lines().filter(is_empty).count();
    let judged = Decoded { log: &log, outputs: &truth, estimates: &estimate.values };
    let over_time = OverTime::new(None, &judged, at_rest);
    let errors = metrics::by_group(&truth, &estimate.values, &measure);
    if errors.iter().all(|group| group.count == 0) {
        return Err(Error::Unfit {
            path: arguments.data.clone(),
            message: nothing_counts(metadata.relative_inputs).into(),
        });
    }
    let assessed = model.assess(&readings.values);
    let ratios_95 = model.model().reading_model().map_or(&[][..], |it| it.ratios_95());
    let percent_novel = assessed.as_ref().map(|(_, novelty)| percent_novel(novelty));
    // A frame counts if any of its values does; what could not be decoded is missing in both.
    let frames_evaluated =
        truth.lines().filter(|line| line.iter().any(|value| !value.is_nan())).count();
    let names: Vec<&str> =
        metadata.input_names.iter().chain(metadata.output_names.iter()).collect();
    let same_file = metadata.scene_digest == file.digest(&names)? && knows(metadata, &file)?;
    let values_evaluated = errors.iter().map(|group| group.count).sum();
    let at_rest = over_time.as_ref().and_then(|log| log.rest.as_ref());
    let of_centroid = centroid_of(&readings, &truth, lines_at_rest.as_deref());
    let decoders = decoders_of(&truth, errors, of_centroid.as_deref(), &measure);
    let verdict = verdict_of(&decoders)
        .of_frames(None, frames_evaluated)
        .with(Warning::trained_on(same_file))
        .with(Warning::out_of_range(model.share_out_of_range(&readings.values)))
        .with(at_rest.filter(|_| !metadata.relative_inputs).and_then(Warning::drift));
    let summary = Summary {
        model_file: arguments.model.clone(),
        model_crc: format!("{:08x}", model.model().crc()),
        data_file: arguments.data.clone(),
        verdict,
        decoders,
        linear_at_training: metrics::linear_at_training(&parsed),
        coverage: assessed.map_or(vec![], |(deviations, _)| {
            coverage(&truth, &estimate.values, &deviations, ratios_95)
        }),
        percent_novel,
        frames: readings.len(),
        frames_evaluated,
        values: truth.values.len(),
        values_evaluated,
        health,
        by_load: by_load(&truth, &with_untold, of_centroid.as_deref(), &measure),
        over_time,
    };
    let reference = if metadata.relative_inputs { Reference::Relative } else { Reference::Median };
    let distribution = arguments
        .html
        .is_some()
        .then(|| Distribution::new(&truth, &estimate, &readings, reference));
    let more = (distribution.as_ref(), without_reading);
    let sections = sections_of(arguments, (&blob, &file), &summary, more)?;
    if let Some(html) = &arguments.html {
        let page = sections.page(&command_line::of_this_process("eval", &[], None));
        output::write_bytes(html, page.html.as_bytes())?;
    }
    print::result(common, &summary, || print::Page::of(sections.text().trim_end()))
}

/// The model's `errors`, and those of decoders that are fitted to the lines of `truth`: the centroid and the mean.
fn decoders_of(
    truth: &Table,
    errors: Vec<Errors>,
    of_centroid: Option<&[f64]>,
    measure: &Measure,
) -> Vec<DecoderErrors> {
    let of = |name: &str, estimate: &[f64]| {
        DecoderErrors::new(name, metrics::by_group(truth, estimate, measure))
    };
    let mut decoders = vec![DecoderErrors::new(NETWORK, errors)];
    decoders.extend(of_centroid.map(|estimate| of(centroid::NAME, estimate)));
    decoders.push(of(mean::NAME, &truth.means().repeat(truth.len())));
    decoders
}

/// Measure for errors of a model's outputs.
fn measure_of(metadata: &Metadata<'_>) -> Measure {
    let thickness_mm = f64::from(metadata.thickness_mm);
    Measure {
        full_scale: metadata.full_scale.iter().map(f64::from).collect(),
        thickness_mm: (thickness_mm > 0.0).then_some(thickness_mm),
        limit: None,
    }
}

/// What the model is worth beside `decoders` that are fitted to the very lines it is judged on.
fn verdict_of(decoders: &[DecoderErrors]) -> Verdict {
    let mut verdict = Verdict::new(decoders, &LimitSummary::new(&Err(Refusal::Measured)));
    if decoders.iter().any(|it| it.decoder == centroid::NAME) {
        verdict.sentence += " The centroid's scale is fitted to these lines, the model is not.";
    }
    verdict
}

/// Estimates of the centroid, whose scale is fitted to these lines, as the mean is: a model keeps none.
fn centroid_of(
    readings: &Table,
    truth: &Table,
    lines_at_rest: Option<&[usize]>,
) -> Option<Vec<f64>> {
    let frames = Dataset {
        inputs: readings.clone(),
        outputs: truth.clone(),
        at_rest: Some(AtRest::of(&readings.pick(lines_at_rest?))),
        ..Dataset::empty(vec![], vec![], 1, 0)
    };
    Some(CENTROID.fit(&frames)?.decode_all(&readings.values, 1).values)
}

/// Reason why no line can be judged, and what helps.
fn nothing_counts(relative_inputs: bool) -> &'static str {
    if relative_inputs {
        "no line has both the model's inputs and a true output: fill readings in, or train without those that have no \
         baseline (--inputs)"
    } else {
        "no line has both the model's readings and a true output: fill them in, or see --limits, and train --reading-model"
    }
}

/// Whether a model that was trained on lines of `file` knows some of those that are kept: it was trained on more lines than
/// all others that have all readings and an output.
fn knows(metadata: &Metadata<'_>, file: &DataFile) -> Result<bool> {
    /// Outliers and rounded shares make a difference of one line in so many.
    const ONE_IN: usize = 100;
    let inputs = file.columns(metadata.input_names.iter())?;
    let outputs = file.columns(metadata.output_names.iter())?;
    let usable = |line: &&[f64]| {
        inputs.iter().all(|column| !line[*column].is_nan())
            && outputs.iter().any(|column| !line[*column].is_nan())
    };
    let others = file.lines_left_out().filter(usable).count();
    Ok(metadata.training_frames as usize > others + others / ONE_IN)
}

/// Result for people; with figures of a `distribution`.
fn sections_of(
    arguments: &Arguments,
    (blob, file): (&ModelBlob, &DataFile),
    summary: &Summary,
    (distribution, without_reading): (Option<&Distribution>, usize),
) -> Result<Sections> {
    let limit = LimitSummary::new(&Err(Refusal::Measured));
    let model = blob.parse();
    let name_of = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let [model_file, data_file] = [&arguments.model, &arguments.data].map(|path| name_of(path));
    let unused = UnusedInputs::among(file, file.columns(model.metadata().input_names.iter())?);
    let (frames, health) = (summary.frames, &summary.health);
    let without_output = frames - summary.frames_evaluated - without_reading;
    let counted = |counts: &[(usize, &str)]| {
        let counts = counts.iter().filter(|(count, _)| *count > 0);
        counts.map(|(count, what)| format!("{} {what}", grouped(*count))).collect::<Vec<_>>()
    };
    let lines = counted(&[
        (without_reading, "lack a reading"),
        (without_output, "lack all outputs"),
        (file.lines_left_out().count(), "are not chosen by the options"),
    ]);
    let readings = counted(&[
        (health.readings_missing, "missing"),
        (health.readings_shorted, "shorted"),
        (health.readings_open, "open"),
        (health.readings_filled, "of these filled from the others"),
    ]);
    let details = vec![
        ("Data", format!("{data_file}: {} frames", grouped(frames))),
        (
            "Values",
            format!(
                "{} of {} true outputs count",
                grouped(summary.values_evaluated),
                grouped(summary.values)
            ),
        ),
        (
            "Model",
            format!(
                "{model_file}, trained on “{}”, {} frames",
                model.metadata().name,
                grouped(model.metadata().training_frames as usize)
            ),
        ),
        ("Blob", format!("{} bytes, CRC-32 {:08x}", grouped(blob.bytes().len()), model.crc())),
        ("Lines left out", lines.join("; ")),
        ("Faulty readings", readings.join("; ")),
        ("Inputs that tell nothing", report::in_words(&unused)),
    ];
    let judged = Judged {
        title: format!("{model_file} on {data_file}"),
        details,
        verdict: &summary.verdict,
        device: &DeviceCost::new(blob),
        decoders: &summary.decoders,
        linear_at_training: &summary.linear_at_training,
        limit: &limit,
        by_load: &summary.by_load,
        by_row: &[],
        others: None,
        over_time: summary.over_time.as_ref(),
        moving: None,
        coverage: &summary.coverage,
        percent_novel: summary.percent_novel,
        frames: summary.frames_evaluated,
        pictures: distribution.map(|distribution| Pictures {
            distribution,
            frames: summary.frames_evaluated,
            sensor: None,
        }),
        table1: None,
    };
    let mut sections = report::of_judged(&judged);
    sections.is_alone = true;
    Ok(sections)
}
