//! Command `decode`: readings to estimates, with a trained model.

use std::path::{Path, PathBuf};

use crate::live::replay::times_s;
use crate::live::sheet;
use crate::report::Sections;
use crate::{Error, Result};
use clap::Args;
use taxel_data::Clock;
use taxel_data::csv_file::{self, Column};
use taxel_data::data_file::{DataFile, FieldTexts};
use taxel_data::table::Table;
use taxel_firmware::link::message::EstimateReport;
use taxel_learn::infer::is_missing;
use taxel_learn::tracked::{Series, decode_series};
use taxel_learn::{ModelBlob, PreparedModel};
use taxel_recording::{Extras, Frame};

use super::data_file::DataFileArguments;
use super::filter_arguments::{FilterArguments, PeriodArgument};
use super::health::{Health, HealthArguments};
use super::readings::{model_inputs, related};
use super::recordings::{self, is_recording};
use super::rest_argument::UntouchedArguments;
use super::{Common, arguments, print};

/// Decode readings of a data file to CSV (one line of estimates per line) or, with the readings, to a recording (.mcap).
///
/// If a reading is missing, the outputs of its row-wire are left empty; if one network decodes the whole
/// array, all outputs of the line are. Positions are left empty while nothing touches the sensor. A model trained with
/// --reading-model estimates missing readings from the others instead.
/// A model with a tracker (`train --track`) follows the contact from line to line if the file has times.
/// Estimates are written with enough digits to restore the f32.
///
/// The last column, `status`, is the sum of a device's flags (docs/link.md): 0 is a good frame, 2 a faulty reading,
/// 4 overflow, 64 a clamped reading far outside the training range, 128 a novel frame (with --confidence). Faulty readings
/// are reported by wire and column on stderr.
#[derive(Args)]
#[command(after_help = "Examples:
  taxel decode press.bin readings.csv -o estimate.csv
  taxel decode press.bin readings.csv --confidence -o estimate.csv
  taxel decode relative.bin readings.csv --baseline rest.csv -o estimate.csv
  taxel decode m.bin log.csv --keep time_s,frame -o estimate.csv
  taxel decode m.bin log.csv --filter-ms 8 --lead-ms 5 -o estimate.csv")]
pub struct Arguments {
    /// Weight blob.
    model: PathBuf,
    /// CSV file or recording (.mcap) that has the columns of the model's readings, in any order.
    readings: PathBuf,
    #[command(flatten)]
    to: arguments::OutputFile,
    /// Columns of the file of readings that are copied unchanged in front of the estimates, such as the time.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    keep: Vec<String>,
    /// Also write a column NAME_deviation for each output NAME, and novelty_nats, for a model trained with --reading-model
    /// full: 68 % of errors are within one deviation, and a frame with a novelty above 0 is novel (docs/reading-model.md).
    #[arg(long)]
    confidence: bool,
    #[command(flatten)]
    untouched: UntouchedArguments,
    #[command(flatten)]
    health: HealthArguments,
    #[command(flatten)]
    filter: FilterArguments,
    #[command(flatten)]
    period: PeriodArgument,
    #[command(flatten)]
    file: DataFileArguments,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<print::Outcome> {
    let output = &*arguments.to.output;
    let baseline = arguments.untouched.path().unwrap_or(&arguments.readings);
    let read = [&*arguments.model, &arguments.readings, baseline];
    print::check_output(output, &read)?;
    if is_recording(output) && !arguments.keep.is_empty() {
        let message =
            "--keep: a recording has columns of its own; write a CSV file, or leave the option out";
        return Err(Error::Usage(message.into()));
    }
    let blob = ModelBlob::read(&arguments.model)?;
    let model = blob.prepare();
    let (fields, limits) = (arguments.file.fields(), arguments.health.limits());
    let file = if arguments.keep.is_empty() {
        arguments.file.read(&arguments.readings, common)?
    } else {
        arguments.file.read_with_text(&arguments.readings, common)?
    };
    let parsed = blob.parse();
    let metadata = parsed.metadata();
    let rest = arguments.untouched.rest_if_relative(&file, metadata, limits, common)?;
    let log = (rest.as_ref(), file.lines());
    let settings = arguments.filter.settings();
    let is_tracked = parsed.tracker().is_some() && !settings.is_on();
    let (baselines, baseline) = if is_tracked && !metadata.relative_inputs {
        (None, arguments.untouched.baseline.read(metadata, (fields, limits), common)?)
    } else {
        let model = &arguments.model;
        (arguments.untouched.baselines(metadata, model, log, fields, limits, common)?, None)
    };
    let mut readings = model_inputs(&model, &file)?;
    let scanned = is_recording(output)
        .then(|| Ok::<_, Error>((clock_us(&file)?, readings.values.clone())))
        .transpose()?;
    let mut health = arguments.health.apply(&model, &mut readings, baselines.as_ref(), common)?;
    let (model, readings) =
        related(model, readings, baselines.as_ref(), &mut health.is_faulty, common);
    remark_on_range(&model, &readings, common);
    let has_times = arguments.filter.lead_ms.is_some() || arguments.period.period_ms.is_some();
    let is_series = is_tracked || settings.is_on();
    if has_times && !is_series {
        let rule = "--lead-ms and --period-ms are for a filter or a tracker, and MODEL has no tracker: give --filter-ms as well";
        return Err(Error::Usage(rule.into()));
    }
    let estimate = match is_series.then(|| arguments.period.of_file(&file)) {
        Some(Ok(start_us)) => {
            let (start_us, baseline) = (&start_us[..], baseline.as_deref());
            let series = Series { start_us, faulty: &health.faulty, baseline };
            if is_tracked {
                common.remark("note: the model's tracker follows the contact");
            }
            decode_series(&model, &readings, series, settings)
        }
        Some(Err(cause)) if !is_tracked => return Err(cause),
        Some(Err(cause)) => {
            common.remark(format_args!("note: no contact is tracked: {cause}"));
            model.decode_table(&readings)
        }
        None => model.decode_table(&readings),
    };
    let keep = kept(arguments, &file, &estimate)?;
    let assessed = arguments.confidence.then(|| model.assess(&readings.values)).flatten();
    if arguments.confidence && assessed.is_none() {
        let message = "it estimates no confidence: train it with --reading-model full".into();
        return Err(Error::Unfit { path: arguments.model.clone(), message });
    }
    let novelty = assessed.as_ref().map(|(_, novelty)| &novelty[..]);
    let flags = flags(&model, &readings, &estimate, &health, novelty);
    match scanned {
        Some((start_us, scanned)) => {
            record(output, &blob, (&start_us, &scanned), &estimate, assessed.as_ref())?;
        }
        None => write(output, &keep, &estimate, assessed.as_ref(), &flags)?,
    }
    let inputs = model.model_inputs(&readings.values);
    let frames = inputs.chunks_exact(readings.names.len());
    let incomplete = frames.filter(|frame| frame.iter().any(|v| is_missing(*v))).count();
    let clamped = flags.iter().filter(|flags| *flags & EstimateReport::CLAMPED != 0).count();
    let lost = if model.model().whole_frames() {
        "frames with a missing reading, and without outputs"
    } else {
        "frames with a missing reading, and without outputs of its row-wire"
    };
    let mut result = Sections::new("Decoded frames");
    result.fact("model_crc", "CRC-32 of the model", "", format!("{:08x}", model.model().crc()));
    result.fact("frames", "frames", "", estimate.len());
    result.fact("frames_with_missing_readings", lost, "", incomplete);
    result.fact("frames_clamped", "frames with a clamped reading", "", clamped);
    result.value("health", &health);
    let novel = assessed.map(|(_, frames)| novel(&frames));
    result.fact("frames_novel", "novel frames, unlike those of training", "", novel);
    result.fact("file", "file", "", output.display().to_string());
    Ok(print::sections(common, &result))
}

/// Column of novelty, and what follows an output's name in the name of its deviation.
const NOVELTY: &str = "novelty_nats";
/// Share of inputs beyond the trained range above which it is said.
const MOST_CLAMPED: f64 = 0.01;
const DEVIATION: &str = "_deviation";

/// Whether a row's outputs are no numbers though no reading is missing. `of_places` says which outputs are
/// places: there is none without a touch.
fn overflows(inputs: &[f64], outputs: &[f64], of_places: &[bool]) -> bool {
    let mut others = outputs.iter().zip(of_places).filter(|(_, is_place)| !**is_place);
    others.any(|(output, _)| output.is_nan()) && !inputs.iter().any(|input| is_missing(*input))
}

/// Number of frames that are unlike those of training; one that misses a reading cannot be told, and is NaN.
fn novel(novelty: &[f64]) -> usize {
    novelty.iter().filter(|n| **n > 0.0).count()
}

/// What a device would flag in each frame.
fn flags(
    model: &PreparedModel<'_>,
    readings: &Table,
    estimate: &Table,
    health: &Health,
    novelty: Option<&[f64]>,
) -> Vec<u8> {
    let clamps = model.clamps(&readings.values);
    let inputs = model.model_inputs(&readings.values);
    let shape = model.model().shape();
    let whole_array = model.model().whole_frames();
    let of_row = |count: usize, rows: usize| if whole_array { count * rows } else { count };
    let (in_row, out_row) = (of_row(shape.inputs, shape.rows), of_row(shape.outputs, shape.rows));
    let of_fronts = model.model().fronts();
    let mut of_places: Vec<bool> =
        of_fronts.flat_map(|front| vec![front.of_places().is_some(); front.outputs]).collect();
    of_places.resize(out_row, false);
    let lines = inputs.chunks_exact(readings.names.len()).zip(estimate.lines());
    let of_line = |(line, (inputs, outputs)): (usize, (&[f64], &[f64]))| {
        let mut rows = inputs.chunks_exact(in_row).zip(outputs.chunks_exact(out_row));
        let overflow = rows.any(|(inputs, outputs)| overflows(inputs, outputs, &of_places));
        let is_novel = novelty.is_some_and(|novelty| novelty[line] > 0.0);
        let flags = [
            (health.is_faulty[line], EstimateReport::FAULTY_READING),
            (overflow, EstimateReport::OVERFLOW),
            (clamps[line], EstimateReport::CLAMPED),
            (is_novel, EstimateReport::NOVEL),
        ];
        flags.into_iter().filter(|(set, _)| *set).map(|(_, flag)| flag).sum::<u8>()
    };
    lines.enumerate().map(of_line).collect()
}

/// Name of the column of flags: `status`, or with underlines behind it if the model has an output of that name.
fn status_name(names: &[&str]) -> String {
    let mut name = String::from("status");
    while names.contains(&&*name) {
        name.push('_');
    }
    name
}

/// Writes the columns to `keep`, the estimates, what was `assessed` of them (deviations and the novelty of each
/// frame), and each frame's `flags`.
fn write(
    path: &Path,
    keep: &[(&str, FieldTexts<'_>)],
    estimate: &Table,
    assessed: Option<&(Vec<f64>, Vec<f64>)>,
    flags: &[u8],
) -> Result<()> {
    let outputs = estimate.names.len();
    let names = estimate.names.iter().map(String::as_str).chain(keep.iter().map(|(name, _)| *name));
    let status = status_name(&names.collect::<Vec<_>>());
    let flags = flags.iter().map(|flags| f64::from(*flags));
    let kept = keep.iter().map(|(name, texts)| Column::texts(name, *texts));
    let estimated = estimate.names.iter().map(|name| Column::f32(name));
    let lines = estimate.lines();
    let Some((deviations, novelty)) = assessed else {
        let lines = lines.zip(flags);
        let lines = lines.map(|(values, flags)| values.iter().copied().chain([flags]));
        let columns = kept.chain(estimated).chain([Column::f64(&status)]);
        return Ok(csv_file::write_columns(path, columns, lines)?);
    };
    let names: Vec<String> =
        estimate.names.iter().map(|name| format!("{name}{DEVIATION}")).collect();
    let columns = kept.chain(estimated).chain(names.iter().map(|name| Column::f32(name)));
    let columns = columns.chain([Column::f64(NOVELTY), Column::f64(&status)]);
    let lines = lines.zip(deviations.chunks_exact(outputs)).zip(novelty.iter().zip(flags));
    let lines = lines.map(|((values, deviations), (novelty, flags))| {
        let values = values.iter().chain(deviations).copied();
        values.chain([*novelty, flags])
    });
    Ok(csv_file::write_columns(path, columns, lines)?)
}

/// Time of each line of `file` in µs since the first.
fn clock_us(file: &DataFile) -> Result<Vec<u64>> {
    let times_s = times_s(&Clock::of(file, None)?, None);
    let since_first = times_s.iter().map(|time_s| (time_s - times_s[0]) * 1e6);
    Ok(since_first.map(|time_us| time_us.round() as u64).collect())
}

/// Writes a recording of readings (frames × inputs) with the times of their scans, of the estimates, and of their
/// deviations.
fn record(
    path: &Path,
    blob: &ModelBlob,
    (start_us, readings): (&[u64], &[f64]),
    estimate: &Table,
    assessed: Option<&(Vec<f64>, Vec<f64>)>,
) -> Result<()> {
    let model = blob.parse();
    let layout = sheet::of_model(model.metadata(), None);
    let extras = Extras { blob: Some(blob.bytes().to_vec()), ..Extras::default() };
    let (inputs, outputs) = (layout.readings.len(), estimate.names.len());
    let floats = |line: &[f64]| line.iter().map(|value| *value as f32).collect::<Vec<f32>>();
    let frame = |number: usize| {
        let deviations =
            assessed.map(|(all, _)| floats(&all[number * outputs..(number + 1) * outputs]));
        let outputs = floats(&estimate.values[number * outputs..(number + 1) * outputs]);
        Frame {
            time_us: start_us[number],
            number: number as u32,
            readings: floats(&readings[number * inputs..(number + 1) * inputs]),
            outputs: Some(outputs),
            deviations,
            ..Frame::default()
        }
    };
    recordings::write(path, &layout, &extras, (0..estimate.len()).map(frame))
}

/// Columns of `file` to write in front of the `outputs`: names, and fields as they are written.
fn kept<'k>(
    Arguments { keep, confidence, .. }: &'k Arguments,
    file: &'k DataFile,
    outputs: &Table,
) -> Result<Vec<(&'k str, FieldTexts<'k>)>> {
    let names = || keep.iter().map(|name| name.trim());
    let is_written = |name: &str| {
        let is_output = |name: &str| outputs.names.iter().any(|output| output == name);
        let of_confidence = name == NOVELTY || name.strip_suffix(DEVIATION).is_some_and(is_output);
        is_output(name) || *confidence && of_confidence
    };
    if let Some(name) = names().find(|name| is_written(name)) {
        let message = format!(
            "--keep {name}: a column of that name is written for the model already; rename this one"
        );
        return Err(Error::Usage(message));
    }
    let repeated = |place: usize| names().take(place).any(|name| name == keep[place].trim());
    if let Some(place) = (0..keep.len()).find(|place| repeated(*place)) {
        return Err(Error::Usage(format!("--keep {}: name each column once", keep[place])));
    }
    let column = |name| Ok((name, file.texts(file.column_of_any(name)?)));
    names().map(column).collect::<taxel_data::Result<_>>().map_err(|error| match error {
        taxel_data::Error::File { path, problem } => {
            Error::Unfit { path, message: format!("{problem} (--keep)") }
        }
        other => other.into(),
    })
}

/// Remarks on stderr if many readings lie outside the range that the model was trained on.
fn remark_on_range(model: &PreparedModel<'_>, readings: &Table, common: &Common) {
    let share = model.share_out_of_range(&readings.values);
    if share > MOST_CLAMPED {
        common.remark(format_args!(
            "note: {:.1} % of the network's inputs lie outside the range that it was trained on, and are clamped",
            100.0 * share
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_reading_is_no_overflow_and_makes_no_frame_novel() {
        let nan = f64::NAN;
        let overflows =
            |inputs: [f64; 2], output| overflows(&inputs, &[output, nan], &[false, true]);
        assert!(overflows([50.0, 51.0], nan) && !overflows([50.0, nan], nan));
        assert!(!overflows([50.0, 51.0], 0.1), "a place is none without a touch");
        assert_eq!(novel(&[nan, 0.5, -0.5, 0.0]), 1);
    }
}
