//! Actions `configure` and `settings`: what a device keeps over restarts.

use crate::Result;
use clap::{Args, ValueEnum, value_parser};
use serde::Serialize;
use taxel_firmware::link::message::{ConfidenceSent, Configuration, Kept, Setting};
use taxel_rig::device::{CircuitConstants, Device};

use super::super::filter_arguments::milliseconds;
use super::super::{Common, print};
use super::scan::{Confidence, TimingArguments, Wanted};

#[derive(Args)]
#[command(arg_required_else_help = true)]
pub struct ConfigureArguments {
    #[command(flatten)]
    timing: TimingArguments,
    /// Reports that are sent of each scan.
    #[arg(long, value_enum, value_name = "WHAT")]
    send: Option<Wanted>,
    /// What is computed and sent of the model's confidence with each estimate (docs/reading-model.md).
    #[arg(long, value_enum, value_name = "WHAT")]
    confidence: Option<Confidence>,
    /// Reading below which a short circuit is assumed.
    #[arg(long, value_name = "OHM")]
    shorted_below_ohm: Option<f32>,
    /// Reading above which a broken wire is assumed.
    #[arg(long, value_name = "OHM")]
    open_above_ohm: Option<f32>,
    /// Relative change against the baseline that counts as contact.
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    contact_threshold: Option<f32>,
    /// Filter outputs in time, with this time constant in ms; 0 filters nothing (docs/filter.md).
    #[arg(long, value_name = "MS", value_parser = milliseconds, allow_negative_numbers = true)]
    filter_ms: Option<u32>,
    /// Time in ms by which the filter extrapolates outputs: their age when they are used.
    #[arg(long, value_name = "MS", value_parser = milliseconds, allow_negative_numbers = true)]
    lead_ms: Option<u32>,
    /// Scans of which one is reported, with its estimate and its faults; all are decoded and filtered.
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..))]
    report_every: Option<u16>,
}

impl ConfigureArguments {
    /// This configuration with the fields that are given.
    fn changed(&self, c: Configuration) -> Configuration {
        let mut c = self.timing.over(c);
        if let Some(send) = self.send {
            (c.send_readings, c.send_estimates) = (send.sent().readings, send.sent().estimates);
        }
        c.confidence = self.confidence.map_or(c.confidence, ConfidenceSent::from);
        c.shorted_below_ohm = self.shorted_below_ohm.unwrap_or(c.shorted_below_ohm);
        c.open_above_ohm = self.open_above_ohm.unwrap_or(c.open_above_ohm);
        c.contact_threshold = self.contact_threshold.unwrap_or(c.contact_threshold);
        c.filter_time_constant_us = self.filter_ms.unwrap_or(c.filter_time_constant_us);
        c.filter_lead_us = self.lead_ms.unwrap_or(c.filter_lead_us);
        c.report_every = self.report_every.unwrap_or(c.report_every);
        c
    }
}

#[derive(Args)]
pub struct SettingsArguments {
    /// Setting to be forgotten: the next restart activates the image's.
    #[arg(long, value_enum, value_name = "SETTING")]
    forget: Option<Forget>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Forget {
    Configuration,
    Constants,
    Baseline,
    All,
}

#[derive(Serialize)]
struct Settings {
    configuration: Configuration,
    /// Active constants of the circuit; none if the device has no such circuit.
    constants: Option<CircuitConstants>,
    kept: Kept,
}

pub fn configure(device: &mut Device, action: &ConfigureArguments, common: &Common) -> Result<()> {
    // What another host has left behind is not kept.
    let configuration = action.changed(device.resume()?);
    device.configure(configuration)?;
    device.keep(Setting::Configuration)?;
    show(device, common)
}

pub fn settings(device: &mut Device, action: &SettingsArguments, common: &Common) -> Result<()> {
    let forget: &[Setting] = match action.forget {
        None => &[],
        Some(Forget::Configuration) => &[Setting::Configuration],
        Some(Forget::Constants) => &[Setting::Constants],
        Some(Forget::Baseline) => &[Setting::Baseline],
        Some(Forget::All) => &Setting::ALL,
    };
    for setting in forget {
        device.forget(*setting)?;
    }
    show(device, common)
}

/// Shows what is active, and what is kept.
fn show(device: &mut Device, common: &Common) -> Result<()> {
    let constants = match device.constants() {
        Err(taxel_rig::Error::Refused(_)) => None,
        constants => Some(constants?),
    };
    let settings =
        Settings { configuration: device.configuration()?, constants, kept: device.kept()? };
    if common.json {
        return print::json(&settings);
    }
    let mut page = print::Page::default();
    let (c, kept) = (&settings.configuration, &settings.kept);
    let whether = match kept.configuration {
        Some(kept) if kept == *c => "kept",
        Some(_) => "another one is kept",
        None => "none is kept",
    };
    page.line(format_args!("{:<17} {whether}", "configuration"));
    page.line(format_args!(
        "{:<17} a scan every {} µs, {} µs settling, {} samples a reading",
        "", c.frame_period_us, c.scan.settling_us, c.scan.oversampling
    ));
    let filter = if c.filter().is_on() {
        let [time_constant_ms, lead_ms] =
            [c.filter_time_constant_us, c.filter_lead_us].map(|us| f64::from(us) / 1e3);
        format!("outputs with a time constant of {time_constant_ms} ms, a lead of {lead_ms} ms")
    } else {
        "nothing".into()
    };
    page.line(format_args!("{:<17} {filter}", "filtered in time"));
    let yes = |sent: bool| if sent { "yes" } else { "no" };
    page.line(format_args!(
        "{:<17} readings {}, estimates {}{}, of confidence {}",
        "sent of each scan",
        yes(c.send_readings),
        yes(c.send_estimates),
        if c.report_every > 1 { format!(" (one of {})", c.report_every) } else { String::new() },
        match c.confidence {
            ConfidenceSent::Nothing => "nothing",
            ConfidenceSent::Novelty => "novelty",
            ConfidenceSent::Deviations => "novelty and deviations",
        }
    ));
    page.line(format_args!(
        "{:<17} shorted below {} Ω, open above {} Ω, contact from {}",
        "limits", c.shorted_below_ohm, c.open_above_ohm, c.contact_threshold
    ));
    if let Some(constants) = &settings.constants {
        let whether = if kept.constants { "kept" } else { "none are kept" };
        page.line(format_args!("{:<17} {whether}", "constants"));
        constants_lines(&mut page, constants);
    }
    match &kept.baseline {
        Some(b) => page.line(format_args!(
            "{:<17} kept: mean of {} frames of {} × {} readings",
            "baseline", b.frames, b.rows, b.columns
        )),
        None => page.line(format_args!("{:<17} none is kept", "baseline")),
    }
    page.line(format_args!("{:<17} {} until the next restart", "writes left", kept.writes_left));
    page.print()
}

/// Adds the circuit's constants.
pub fn constants_lines(page: &mut print::Page, constants: &CircuitConstants) {
    page.line(format_args!(
        "{:<17} drive {:.5} V of {:.4} V",
        "", constants.drive_v, constants.reference_v
    ));
    let lists = [
        ("row source, Ω", &constants.row_source_ohm, 4),
        ("feedback, Ω", &constants.feedback_ohm, 2),
        ("series, Ω", &constants.series_ohm, 3),
    ];
    for (name, ohm, digits) in lists {
        for (i, part) in ohm.chunks(9).enumerate() {
            let name = if i == 0 { name } else { "" };
            let numbers: Vec<String> = part.iter().map(|ohm| format!("{ohm:.digits$}")).collect();
            page.line(format_args!("{name:<17} {}", numbers.join(" ")));
        }
    }
}
