//! How a device is to scan for a command, and what it then sends.

use std::time::Duration;

use crate::{Error, Result};
use clap::builder::BoolishValueParser;
use clap::{Args, ValueEnum, value_parser};
use serde::Serialize;
use taxel_core::Wires;
use taxel_core::blob::Model;
use taxel_firmware::link::message::{ConfidenceSent, Configuration};
use taxel_firmware::timing::ScanPlan;
use taxel_rig::device::{Device, DeviceIdentity};
use taxel_rig::scans::Sent;

use super::super::device_arguments::ScanPeriodArgument;
use super::super::filter_arguments::FilterArguments;

#[derive(Args)]
pub struct ScanArguments {
    /// Frames to scan.
    #[arg(short = 'n', long, value_name = "N", default_value_t = 100, value_parser = value_parser!(u16).range(1..))]
    pub frames: u16,
    #[command(flatten)]
    pub timing: TimingArguments,
}

/// Times of a scan, where they are not the ones that hold already.
#[derive(Args, Serialize)]
pub struct TimingArguments {
    #[command(flatten)]
    #[serde(flatten)]
    pub period: ScanPeriodArgument,
    /// Wait after a row is driven.
    #[arg(long, value_name = "US", value_parser = value_parser!(u32).range(..=5_000))]
    settling_us: Option<u32>,
    /// Samples averaged for a reading.
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..=256))]
    oversampling: Option<u16>,
}

impl TimingArguments {
    /// This configuration with the times that are given.
    pub fn over(&self, mut c: Configuration) -> Configuration {
        c.frame_period_us = self.period.period_us.unwrap_or(c.frame_period_us);
        c.scan.settling_us = self.settling_us.unwrap_or(c.scan.settling_us);
        c.scan.oversampling = self.oversampling.unwrap_or(c.scan.oversampling);
        c
    }
}

/// What is computed of each estimate, and how many are sent.
#[derive(Args, Serialize)]
pub struct ReportArguments {
    #[command(flatten)]
    #[serde(flatten)]
    pub filter: FilterArguments,
    /// Whether a model with a tracker (train --track) follows the contact [default: on].
    #[arg(long, value_name = "on|off", value_parser = BoolishValueParser::new(), hide_possible_values = true)]
    pub track: Option<bool>,
    /// Report one of so many scans, with its estimate and its faults; all scans are decoded and filtered.
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..))]
    pub report_every: Option<u16>,
    /// Confidence that is computed and sent with each estimate: columns NAME_deviation for each output, and
    /// novelty_nats (docs/reading-model.md).
    #[arg(long, value_enum, value_name = "WHAT")]
    pub confidence: Option<Confidence>,
}

impl ReportArguments {
    /// This configuration with what is given.
    pub fn over(&self, mut c: Configuration) -> Configuration {
        c.confidence = self.confidence.map_or(c.confidence, ConfidenceSent::from);
        c.filter_time_constant_us = self.filter.filter_ms.unwrap_or(c.filter_time_constant_us);
        c.filter_lead_us = self.filter.lead_ms.unwrap_or(c.filter_lead_us);
        c.track = self.track.unwrap_or(c.track);
        c.report_every = self.report_every.unwrap_or(c.report_every);
        c
    }
}

impl ScanArguments {
    /// The configuration that the device keeps, with the times that are given.
    pub fn configuration(&self, device: &mut Device) -> taxel_rig::Result<Configuration> {
        Ok(self.timing.over(device.resume_to_scan()?))
    }
}

/// Content that a device is to send of each scan.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Wanted {
    Readings,
    Estimates,
    Both,
    Nothing,
}

impl Wanted {
    /// What is sent of each scan.
    pub fn sent(self) -> Sent {
        Sent {
            readings: matches!(self, Self::Readings | Self::Both),
            estimates: matches!(self, Self::Estimates | Self::Both),
        }
    }
}

/// Part of a model's confidence that a device is to send with each estimate.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
pub enum Confidence {
    /// No confidence.
    Nothing,
    /// The frame's novelty.
    Novelty,
    /// The frame's novelty, and a deviation for each output: twice the bytes.
    Deviations,
}

impl From<Confidence> for ConfidenceSent {
    fn from(confidence: Confidence) -> Self {
        match confidence {
            Confidence::Nothing => Self::Nothing,
            Confidence::Novelty => Self::Novelty,
            Confidence::Deviations => Self::Deviations,
        }
    }
}

/// Activates a configuration in which what is `wanted` of each scan is sent.
pub fn configure(
    device: &mut Device,
    wanted: Wanted,
    configuration: Configuration,
) -> taxel_rig::Result<()> {
    let Sent { readings: send_readings, estimates: send_estimates } = wanted.sent();
    device.configure(Configuration { send_readings, send_estimates, ..configuration })
}

/// Longest time of a sample, with any converter that the readout is written for.
const SLOWEST_SAMPLE_NS: u32 = 100_000;

/// Time within which so many frames must have come.
pub fn patience(frames: u16, configuration: &Configuration, identity: &DeviceIdentity) -> Duration {
    Duration::from_secs(2) + 4 * u32::from(frames) * longest_period(configuration, identity)
}

/// Longest time without a frame. Some are lost where the line cannot carry all.
pub fn patience_for_next(configuration: &Configuration, identity: &DeviceIdentity) -> Duration {
    let periods = 40.max(4 * u32::from(configuration.report_every));
    Duration::from_secs(3) + periods * longest_period(configuration, identity)
}

/// Longest time from scan to scan.
fn longest_period(configuration: &Configuration, identity: &DeviceIdentity) -> Duration {
    let plan = ScanPlan {
        rows: identity.rows as u16,
        columns: identity.columns as u16,
        board_columns: identity.columns as u16,
        settling_us: configuration.scan.settling_us,
        oversampling: configuration.scan.oversampling,
        pass_samples: u16::MAX,
        sample_ns: SLOWEST_SAMPLE_NS,
        reading_ns: SLOWEST_SAMPLE_NS,
        row_ns: SLOWEST_SAMPLE_NS,
        between_passes_ns: 0,
    };
    Duration::from_micros(configuration.frame_period_us.max(plan.longest_us()).into())
}

/// Names of the readings in a frame: those of the `model` that is active on the device, or else of its wires.
pub fn reading_names(identity: &DeviceIdentity, model: Option<&Model<'_>>) -> Result<Vec<String>> {
    if let Some(model) = model {
        return Ok(model.metadata().input_names.iter().map(String::from).collect());
    }
    let Wires { rows, columns } = all_wires(identity)?;
    let names = (1..=rows).flat_map(|m| (1..=columns).map(move |k| format!("r{m}c{k}_ohm")));
    Ok(names.collect())
}

/// Wires of a device that scans all readings between its first wires.
pub fn all_wires(identity: &DeviceIdentity) -> Result<Wires> {
    identity.wires().ok_or_else(|| {
        Error::Usage(
            "the active model uses only some of the readings, or another order: give its file as --model, \
             or upload a model of all readings"
                .into(),
        )
    })
}

/// Checks the number of values in a frame.
pub fn check_length(frame: u32, found: usize, expected: usize) -> Result<()> {
    if found == expected {
        return Ok(());
    }
    Err(Error::failed(format!(
        "frame {frame} has {found} values instead of {expected}; was the model replaced meanwhile?"
    )))
}
