//! Command `eval`: a model's errors on data whose outputs are known.

use std::path::{Path, PathBuf};

use crate::by_load::by_load;
use crate::evaluate::confidence::coverage;
use crate::evaluate::device_cost::DeviceCost;
use crate::evaluate::distribution::{Distribution, Reference};
use crate::measurements::{Log, Spread};
use crate::metrics::{self, DecoderErrors, LimitSummary, Measure, NETWORK};
use crate::others::percent_novel;
use crate::over_time::{self, Decoded, OverTime, RestOverTime};
use crate::report::format::grouped;
use crate::report::{self, Judged, Pictures, Sections};
use crate::verdict::{Verdict, Warning};
use crate::{Error, Result};
use clap::Args;
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
/// Readings that a device would reject count as missing. A model trained with --reading-model estimates them from the
/// others; --without shows what that costs.
#[derive(Args)]
#[command(after_help = "Examples:
  taxel eval press.bin test.csv --html report.html
  taxel eval relative.bin test.csv --baseline rest.csv
  taxel eval array.bin test.csv --without 'r4c*_ohm'
  taxel eval m.bin log.csv --missing -1 --last-share 0.2")]
pub struct Arguments {
    /// Weight blob.
    model: PathBuf,
    /// CSV file or recording (.mcap) that has the columns of the model's readings and outputs.
    data: PathBuf,
    #[command(flatten)]
    untouched: UntouchedArguments,
    #[command(flatten)]
    health: HealthArguments,
    /// Write a page with the same figures as that of `run`.
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    #[command(flatten)]
    clock: TimeArgument,
    #[command(flatten)]
    file: DataFileArguments,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<print::Outcome> {
    if let Some(html) = &arguments.html {
        let untouched = arguments.untouched.path().unwrap_or(&arguments.data);
        print::check_output(html, &[&*arguments.model, &arguments.data, untouched])?;
    }
    let blob = ModelBlob::read(&arguments.model)?;
    if blob.parse().tracker().is_some() {
        common.remark(
            "note: each line is judged by itself, without the model's tracker: `run` judges it",
        );
    }
    let mut file = arguments.file.read(&arguments.data, common)?;
    let mut sections = judged(arguments, &blob, &mut file, common)?;
    if let Some(html) = &arguments.html {
        sections.is_alone = true;
        let page = sections.page(&command_line::of_this_process("eval", &[], None));
        output::write_bytes(html, page.html.as_bytes())?;
    }
    Ok(print::sections(common, &sections))
}

/// What the model in `blob` is worth on the lines of `file`.
fn judged(
    arguments: &Arguments,
    blob: &ModelBlob,
    file: &mut DataFile,
    common: &Common,
) -> Result<Sections> {
    let model = blob.prepare();
    let (fields, limits) = (arguments.file.fields(), arguments.health.limits());
    let parsed = blob.parse();
    let metadata = parsed.metadata();
    let is_known = knows(metadata, file)?;
    let mut readings = model_inputs(&model, file)?;
    let truth = table_of(file, metadata.output_names.iter())?;
    let clock = Clock::of(file, arguments.clock.time.as_deref())?;
    let log = Log { clock, lines: (0..file.lines()).collect() };
    let rest = if over_time::is_log(&log, &truth) {
        arguments.untouched.rest(file, metadata, limits, common)?
    } else {
        arguments.untouched.rest_if_relative(file, metadata, limits, common)?
    };
    arguments.untouched.rest.forget_places(file, metadata.output_names.iter(), common)?;
    let mut truth = table_of(file, metadata.output_names.iter())?;
    let of_lines = (rest.as_ref(), file.lines());
    let baselines = arguments.untouched.baselines(
        metadata,
        &arguments.model,
        of_lines,
        fields,
        limits,
        common,
    )?;
    let mut health = arguments.health.apply(&model, &mut readings, baselines.as_ref(), common)?;
    let lines_at_rest = rest.as_ref().and_then(|rest| rest.lines.clone());
    let at_rest =
        rest.and_then(|rest| RestOverTime::new(&rest, &log.clock, &Spread::of(&readings)));
    let (model, readings) =
        related(model, readings, baselines.as_ref(), &mut health.is_faulty, common);
    let mut estimate = model.decode_table(&readings);
    let with_untold = estimate.values.clone();
    estimate.values = truth.with_places(estimate.values.into_vec()).into_owned().into();
    let measure = measure_of(metadata);
    // The mean is judged on the same pairs as the model, and computed from them.
    let pairs = truth.values.iter_mut().zip(estimate.values.iter());
    pairs.filter(|(_, estimate)| estimate.is_nan()).for_each(|(truth, _)| *truth = f64::NAN);
    let is_empty = |line: &&[f64]| line.iter().all(|value| value.is_nan());
    let without_reading = estimate.lines().filter(is_empty).count();
    let judged = Decoded { log: &log, outputs: &truth, estimates: &estimate.values };
    let over_time = OverTime::new(None, &judged, at_rest);
    let network = DecoderErrors::of_estimate(NETWORK, &truth, &estimate.values, &measure);
    if network.errors.iter().all(|group| group.count == 0) {
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
    let values_evaluated = network.errors.iter().map(|group| group.count).sum();
    let at_rest = over_time.as_ref().and_then(|log| log.rest.as_ref());
    let of_centroid = centroid_of(&readings, &truth, lines_at_rest.as_deref());
    let decoders = decoders_of(&truth, network, of_centroid.as_deref(), &measure);
    let verdict = verdict_of(&decoders)
        .of_frames(None, frames_evaluated)
        .with(Warning::trained_on(is_known))
        .with(at_rest.filter(|_| !metadata.relative_inputs).and_then(Warning::drift));
    let coverage = assessed.map_or(vec![], |(deviations, _)| {
        coverage(&truth, &estimate.values, &deviations, ratios_95)
    });
    let by_load = by_load(&truth, &with_untold, of_centroid.as_deref(), &measure);
    let linear_at_training = metrics::linear_at_training(&parsed);
    let reference = if metadata.relative_inputs { Reference::Relative } else { Reference::Median };
    let distribution = arguments
        .html
        .is_some()
        .then(|| Distribution::new(&truth, &estimate, &readings, reference));
    let counts = [frames_evaluated, without_reading, values_evaluated, truth.values.len()];
    let mut made = made(arguments, (blob, file), &health, counts)?;
    let clamped = model.share_out_of_range(&readings.values);
    let label = "Inputs beyond the trained range, clamped";
    made.fact("inputs_clamped_percent", label, "%", (1e4 * clamped).round() / 100.0);
    let judged = Judged {
        verdict: &verdict,
        device: &DeviceCost::new(blob),
        decoders: &decoders,
        linear_at_training: &linear_at_training,
        limit: &LimitSummary::new(&Err(Refusal::Measured)),
        by_load: &by_load,
        by_row: &[],
        others: None,
        over_time: over_time.as_ref(),
        moving: None,
        coverage: &coverage,
        percent_novel,
        frames: frames_evaluated,
        pictures: distribution.as_ref().map(|distribution| Pictures {
            distribution,
            frames: frames_evaluated,
            sensor: None,
        }),
        table1: None,
    };
    Ok(report::of_judged(&judged, made))
}

/// The model's `errors`, and those of decoders that are fitted to the lines of `truth`: the centroid and the mean.
fn decoders_of(
    truth: &Table,
    network: DecoderErrors,
    of_centroid: Option<&[f64]>,
    measure: &Measure,
) -> Vec<DecoderErrors> {
    let of =
        |name: &str, estimate: &[f64]| DecoderErrors::of_estimate(name, truth, estimate, measure);
    let mut decoders = vec![network];
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
        noise: None,
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
    let names: Vec<&str> =
        metadata.input_names.iter().chain(metadata.output_names.iter()).collect();
    if metadata.scene_digest != file.digest(&names)? {
        return Ok(false);
    }
    let inputs = file.columns(metadata.input_names.iter())?;
    let outputs = file.columns(metadata.output_names.iter())?;
    let usable = |line: &&[f64]| {
        inputs.iter().all(|column| !line[*column].is_nan())
            && outputs.iter().any(|column| !line[*column].is_nan())
    };
    let others = file.lines_left_out().filter(usable).count();
    Ok(metadata.training_frames as usize > others + others / ONE_IN)
}

/// What was judged, and by what. `counts` are of frames that count and that lack a reading, of true outputs that count
/// and of all.
fn made(
    arguments: &Arguments,
    (blob, file): (&ModelBlob, &DataFile),
    health: &Health,
    counts: [usize; 4],
) -> Result<Sections> {
    let [frames_evaluated, without_reading, values_evaluated, values] = counts;
    let (model, frames) = (blob.parse(), file.lines());
    let metadata = model.metadata();
    let name_of = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let [of_model, of_data] = [&arguments.model, &arguments.data].map(|path| name_of(path));
    let mut made = Sections::new(format!("{of_model} on {of_data}"));
    made.fact("model_file", "Model", "", arguments.model.display().to_string());
    made.fact("model_crc", "CRC-32", "", format!("{:08x}", model.crc()));
    let training = grouped(metadata.training_frames as usize);
    made.line("Trained on", format!("“{}”, {training} frames", metadata.name));
    made.fact("data_file", "Data", "", arguments.data.display().to_string());
    made.fact("frames", "Frames", "", frames);
    made.fact("frames_evaluated", "Frames evaluated", "", frames_evaluated);
    made.fact("values", "True outputs", "", values);
    made.fact("values_evaluated", "True outputs evaluated", "", values_evaluated);
    made.value("health", health);
    let lines = [
        (without_reading, "lack a reading"),
        (frames - frames_evaluated - without_reading, "lack all outputs"),
        (file.lines_left_out().count(), "are not chosen by the options"),
    ];
    made.line("Lines left out", report::reasons(&lines));
    let readings = [
        (health.readings_missing, "missing"),
        (health.readings_shorted, "shorted"),
        (health.readings_open, "open"),
        (health.readings_filled, "of these filled from the others"),
    ];
    made.line("Faulty readings", report::reasons(&readings));
    let unused = UnusedInputs::among(file, file.columns(metadata.input_names.iter())?);
    made.line("Inputs without information", report::in_words(&unused));
    Ok(made)
}
