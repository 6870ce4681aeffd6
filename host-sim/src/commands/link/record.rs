//! `record` and `baseline`: frames of a device, saved.

use std::path::{Path, PathBuf};

use crate::live::device::Protocol;
use crate::live::recorder::{Beside, Recorder};
use crate::live::sheet;
use crate::report::Sections;
use crate::{Error, Result};
use clap::Args;
use taxel_core::blob::Model;
use taxel_data::{Table, csv_file};
use taxel_firmware::link::message::{Configuration, EstimateReport, Report, Request, Setting};
use taxel_learn::ModelBlob;
use taxel_rig::device::{Device, DeviceIdentity};
use taxel_rig::scans::ScanEstimate;

use super::super::arguments::refuse;
use super::super::device_arguments::SensorArguments;
use super::super::health::note_faults;
use super::super::recordings::is_recording;
use super::super::scene_argument::ModelArgument;
use super::super::{Common, arguments, print};
use super::frames::{hear_scans, in_text, missing, values};
use super::scan::{
    Confidence, ReportArguments, ScanArguments, Wanted, check_length, configure, patience,
    patience_for_next, reading_names,
};

#[derive(Args)]
pub struct RecordArguments {
    /// Weight blob that is active on the device: its estimates are saved. Without it, readings are saved.
    pub model: Option<PathBuf>,
    /// Accept that MODEL was recalibrated since: a model of the same columns and scene is active.
    #[arg(long, requires = "model")]
    recalibrated: bool,
    /// Save the readings that MODEL uses, not its estimates.
    #[arg(long, requires = "model")]
    pub readings: bool,
    #[command(flatten)]
    pub sensor: SensorArguments,
    #[command(flatten)]
    pub scan: ScanArguments,
    /// Save the start of each scan too, in a column time_s: seconds since the first one. `decode --filter-ms` needs it.
    #[arg(long)]
    time: bool,
    #[command(flatten)]
    reports: ReportArguments,
    #[command(flatten)]
    pub to: arguments::OutputFile,
}

#[derive(Args)]
#[command(mut_arg("model", |it| it.help("Weight blob of the device: its readings are saved under their names in the blob")))]
pub struct BaselineArguments {
    #[command(flatten)]
    scan: ScanArguments,
    #[command(flatten)]
    of: ModelArgument,
    #[command(flatten)]
    to: arguments::OutputFile,
}

/// Share of the frames that were asked for below which the device misses some.
const MISSED: f64 = 0.98;

impl RecordArguments {
    /// Checks, before a device is asked, that the options go together, and that the file can be written.
    pub fn check(&self, protocol: Protocol) -> Result<()> {
        self.scan.timing.period.check()?;
        if protocol != Protocol::Taxel {
            let for_device = |option: &str| format!("{option} is for a Taxel device: leave it out");
            refuse(&self.reports, |_| true, for_device)?;
            refuse(&self.scan.timing, |_| true, for_device)?;
            if self.recalibrated {
                return Err(Error::Usage(for_device("--recalibrated")));
            }
        }
        if self.model.is_none() || self.readings {
            let of_estimates = |option: &str| {
                format!(
                    "{option} is for estimates, and readings are saved: give MODEL, without --readings"
                )
            };
            refuse(&self.reports, |_| true, of_estimates)?;
        }
        if !is_recording(&self.to.output) {
            let inputs: Vec<&Path> = self.model.iter().map(PathBuf::as_path).collect();
            return print::check_output(&self.to.output, &inputs);
        }
        if self.time {
            let message = "-o: a recording has the times of all scans; leave --time out";
            return Err(Error::Usage(message.into()));
        }
        Ok(())
    }

    /// Saves `lines` of columns called `names`, which began at these times in µs, as CSV.
    pub fn save(
        &self,
        names: &[String],
        starts_us: impl IntoIterator<Item = u64>,
        lines: Vec<Vec<f64>>,
    ) -> Result<()> {
        let time = self.time.then_some("time_s");
        let mut first_us = None;
        let lines = starts_us.into_iter().zip(lines).map(|(start_us, line)| {
            let since_us = start_us - *first_us.get_or_insert(start_us);
            time.map(|_| since_us as f64 / 1e6).into_iter().chain(line.into_iter().map(in_text))
        });
        let header = time.into_iter().chain(names.iter().map(String::as_str));
        Ok(csv_file::write(&self.to.output, header, lines)?)
    }
}

pub fn record(
    device: &mut Device,
    action: &RecordArguments,
    common: &Common,
) -> Result<print::Outcome> {
    let model = action.model.as_ref().map(|path| ModelBlob::read(path)).transpose()?;
    let identity = device.identify()?;
    let blob = model.as_ref();
    let model = blob.map(ModelBlob::parse);
    if let Some(model) = &model {
        let is_it = if action.recalibrated {
            identity.is_made_of(model)
        } else {
            identity.has_in_force(model.crc())
        };
        check_active(model, is_it, &identity)?;
    }
    let (wanted, mut names) = match &model {
        Some(model) if !action.readings => {
            let names = model.metadata().output_names.iter().map(String::from).collect();
            let wanted =
                if is_recording(&action.to.output) { Wanted::Both } else { Wanted::Estimates };
            (wanted, names)
        }
        _ => (Wanted::Readings, reading_names(&identity, model.as_ref())?),
    };
    let confidence = action.reports.confidence.unwrap_or(Confidence::Nothing);
    let outputs = names.len();
    if let Some(model) = &model {
        names.extend(confidence_names(model, confidence, &names)?);
    }
    let own = Configuration { confidence: confidence.into(), ..action.scan.configuration(device)? };
    let configuration = action.reports.over(own);
    let every = configuration.report_every;
    let patience = patience_for_next(&configuration, &identity);
    let mut recorder = is_recording(&action.to.output)
        .then(|| recorder(&action.to.output, &identity, &names[..outputs], blob))
        .transpose()?;
    let scans = device.while_paused(|device| -> Result<_> {
        configure(device, wanted, configuration)?;
        let count = action.scan.frames.into();
        hear_scans(device, count, patience, wanted, names.len(), common, |scan| match &mut recorder
        {
            Some(recorder) => recorder.write_scan(scan),
            None => Ok(()),
        })
    })?;
    let lines: Vec<Vec<f64>> = scans.iter().map(values).collect();
    let missing = missing(lines.iter().flat_map(|line| &line[..outputs]), wanted)?;
    if wanted == Wanted::Readings {
        let readings = Table { names: names.clone(), values: lines.concat().into() };
        note_faults(&readings, configuration.limits(), common);
    }
    match recorder {
        Some(recorder) => drop(recorder.finish()?),
        None => action.save(&names, scans.iter().map(|scan| scan.start_us), lines)?,
    }
    let ends = scans.last().zip(scans.first());
    let steps = ends.map_or(0, |(last, first)| last.number.wrapping_sub(first.number));
    let frames_lost = u64::from(steps / u32::from(every) + 1).saturating_sub(scans.len() as u64);
    let elapsed_us = ends.map_or(0, |(last, first)| last.start_us - first.start_us);
    let frames_per_s = (elapsed_us > 0).then(|| f64::from(steps) / (elapsed_us as f64 * 1e-6));
    let estimates = scans.iter().filter_map(|scan| scan.estimate.as_ref());
    let is_novel = |it: &&ScanEstimate| it.flags & EstimateReport::NOVEL != 0;
    let frames_novel = estimates.filter(is_novel).count();
    let events = scans.iter().flat_map(|scan| scan.events.clone()).collect();
    let frames = scans.len();
    let saved = Saved { frames, frames_per_s, frames_lost, missing, frames_novel, events };
    Ok(saved.outcome(&action.to.output, Some(configuration.frame_period_us), common))
}

/// A recording of what a device sends: of the model in `blob`, or of all its readings, called `names`.
fn recorder(
    path: &Path,
    identity: &DeviceIdentity,
    names: &[String],
    blob: Option<&ModelBlob>,
) -> Result<Recorder> {
    let layout = if let Some(blob) = blob {
        sheet::of_model(blob.parse().metadata(), None)
    } else {
        let readings = sheet::columns(names.iter().map(String::as_str), []);
        sheet::layout(&identity.board, readings, vec![], None)
    };
    let beside = Beside {
        blob: blob.map(|blob| blob.bytes().to_vec()),
        source: format!("{}, firmware {}", identity.board, identity.firmware),
        ..Beside::default()
    };
    Recorder::start(path, &layout, beside)
}

/// Checks that a model `is_active` on the device.
fn check_active(model: &Model<'_>, is_active: bool, identity: &DeviceIdentity) -> Result<()> {
    if is_active {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "MODEL {:08x}: {} is active on the device; `upload` this one, or name that one",
        model.crc(),
        identity.model.map_or("none".into(), |found| format!("{:08x}", found.crc_32))
    )))
}

/// Names of the columns for what is `wanted` of the model's confidence, beside those of its `outputs`.
fn confidence_names(
    model: &Model<'_>,
    wanted: Confidence,
    outputs: &[String],
) -> Result<Vec<String>> {
    if wanted == Confidence::Nothing {
        return Ok(Vec::new());
    }
    if !model.assesses() {
        return Err(Error::Usage(
            "--confidence: MODEL has none; leave the option out, or train with --reading-model full".into(),
        ));
    }
    let mut names = Vec::new();
    if wanted == Confidence::Deviations {
        names.extend(outputs.iter().map(|name| format!("{name}_deviation")));
    }
    names.push("novelty_nats".into());
    Ok(names)
}

pub fn baseline(
    device: &mut Device,
    action: &BaselineArguments,
    common: &Common,
) -> Result<print::Outcome> {
    action.scan.timing.period.check()?;
    let inputs: Vec<&Path> = action.of.model.iter().map(PathBuf::as_path).collect();
    print::check_output(&action.to.output, &inputs)?;
    let identity = device.identify()?;
    let model = action.of.model.as_ref().map(|path| ModelBlob::read(path)).transpose()?;
    let model = model.as_ref().map(ModelBlob::parse);
    if let Some(model) = &model {
        check_active(model, identity.is_made_of(model), &identity)?;
    }
    let names = reading_names(&identity, model.as_ref())?;
    let frames = action.scan.frames;
    let request = Request::CaptureBaseline { frames };
    let configuration = action.scan.configuration(device)?;
    let patience = patience(frames, &configuration, &identity);
    let answer = device.while_paused(|device| {
        configure(device, Wanted::Nothing, configuration)?;
        device.ask(&request, patience, |report| match report {
            Report::Baseline { readings_ohm } => {
                Some(readings_ohm.iter().map(f64::from).collect::<Vec<_>>())
            }
            _ => None,
        })
    })?;
    let readings = answer.map_err(taxel_rig::Error::Refused)?;
    check_length(0, readings.len(), names.len())?;
    let values_missing = missing(readings.iter(), Wanted::Readings)?;
    device.keep(Setting::Baseline)?;
    let lines = std::iter::once(readings.iter().copied().map(in_text));
    csv_file::write(&action.to.output, names.iter().map(String::as_str), lines)?;
    let saved = Saved {
        frames: frames.into(),
        frames_per_s: None,
        frames_lost: 0,
        missing: values_missing,
        frames_novel: 0,
        events: vec![],
    };
    Ok(saved.outcome(&action.to.output, None, common))
}

/// Frames that were saved.
pub struct Saved {
    pub frames: usize,
    /// Frames a second that the device scanned: fewer than it was asked for if it misses some. `None` for a baseline.
    pub frames_per_s: Option<f64>,
    /// Frame numbers missing between the first frame and the last: lost on the line.
    pub frames_lost: u64,
    /// Readings or outputs that are empty.
    pub missing: usize,
    /// Frames that are unlike those of training, as far as the device was to tell.
    pub frames_novel: usize,
    /// Events of touch that the device told, in words.
    pub events: Vec<String>,
}

impl Saved {
    /// Says what is in a `file`, of frames that were asked for every `period_us`.
    pub fn outcome(&self, file: &Path, period_us: Option<u32>, common: &Common) -> print::Outcome {
        let mut result = Sections::new("Frames of the device");
        result.fact("frames", "frames", "", self.frames);
        result.fact("frames_per_s", "scanned", "frames a second", self.frames_per_s);
        result.fact("frames_lost", "frames lost on the line", "", self.frames_lost);
        result.fact("values_missing", "missing values", "", self.missing);
        result.fact("frames_novel", "frames unlike those of training", "", self.frames_novel);
        result.value("events", &self.events);
        if let Some(last) = self.events.last() {
            result.line("events", format!("{}, the last: {last}", self.events.len()));
        }
        result.fact("file", "file", "", file.display().to_string());
        if let Some(period_us) = period_us
            && let asked = 1e6 / f64::from(period_us.max(1))
            && self.frames_per_s.is_some_and(|rate| rate < MISSED * asked)
        {
            result.warnings.push(format!(
                "{asked:.1} frames a second were requested: scanning and decoding take longer than --period-us {period_us}, at \
                 least in every 16th frame"
            ));
        }
        print::sections(common, &result)
    }
}
