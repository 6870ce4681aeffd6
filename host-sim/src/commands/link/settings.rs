//! Actions `configure` and `settings`: what a device keeps over restarts.

use crate::Result;
use crate::report::Sections;
use clap::{Args, ValueEnum};
use taxel_firmware::link::message::{ConfidenceSent, Configuration, Setting};
use taxel_rig::device::{CircuitConstants, Device};

use super::super::{Common, print};
use super::scan::{ReportArguments, TimingArguments, Wanted};

#[derive(Args)]
#[command(arg_required_else_help = true)]
pub struct ConfigureArguments {
    #[command(flatten)]
    timing: TimingArguments,
    /// Reports that are sent of each scan.
    #[arg(long, value_enum, value_name = "WHAT")]
    send: Option<Wanted>,
    /// Reading below which a short circuit is assumed.
    #[arg(long, value_name = "OHM")]
    shorted_below_ohm: Option<f32>,
    /// Reading above which a broken wire is assumed.
    #[arg(long, value_name = "OHM")]
    open_above_ohm: Option<f32>,
    /// Relative change against the baseline that counts as contact.
    #[arg(long, value_name = "SHARE")]
    contact_threshold: Option<f32>,
    /// Load of an event: of the force, a tracked contact's depth, or else the largest output; 0 is off.
    #[arg(long, value_name = "LOAD")]
    load_threshold: Option<f32>,
    /// Speed over the sensor from which a tracked contact slips; 0 is off.
    #[arg(long, value_name = "MM_PER_S")]
    slip_mm_per_s: Option<f32>,
    #[command(flatten)]
    reports: ReportArguments,
}

impl ConfigureArguments {
    /// This configuration with the fields that are given.
    fn changed(&self, c: Configuration) -> Configuration {
        let mut c = self.reports.over(self.timing.over(c));
        if let Some(send) = self.send {
            (c.send_readings, c.send_estimates) = (send.sent().readings, send.sent().estimates);
        }
        c.shorted_below_ohm = self.shorted_below_ohm.unwrap_or(c.shorted_below_ohm);
        c.open_above_ohm = self.open_above_ohm.unwrap_or(c.open_above_ohm);
        c.contact_threshold = self.contact_threshold.unwrap_or(c.contact_threshold);
        c.load_threshold = self.load_threshold.unwrap_or(c.load_threshold);
        c.slip_mm_per_s = self.slip_mm_per_s.unwrap_or(c.slip_mm_per_s);
        c
    }
}

#[derive(Args)]
pub struct SettingsArguments {
    /// Setting to erase: the next restart uses the image's own.
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

pub fn configure(
    device: &mut Device,
    action: &ConfigureArguments,
    common: &Common,
) -> Result<print::Outcome> {
    // What another host has left behind is not kept.
    let configuration = action.changed(device.resume()?);
    device.configure(configuration)?;
    device.keep(Setting::Configuration)?;
    show(device, common)
}

pub fn settings(
    device: &mut Device,
    action: &SettingsArguments,
    common: &Common,
) -> Result<print::Outcome> {
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
fn show(device: &mut Device, common: &Common) -> Result<print::Outcome> {
    let constants = match device.constants() {
        Err(taxel_rig::Error::Refused(_)) => None,
        constants => Some(constants?),
    };
    let (c, kept) = (device.configuration()?, device.kept()?);
    let mut result = Sections::new("Settings of the device");
    result.value("configuration", &c);
    result.value("constants", &constants);
    result.value("kept", &kept);
    let whether = match kept.configuration {
        Some(kept) if kept == c => "kept",
        Some(_) => "another one is kept",
        None => "none is kept",
    };
    result.line("configuration", whether);
    result.line(
        "scans",
        format!(
            "a scan every {} µs, {} µs settling, {} samples a reading",
            c.frame_period_us, c.scan.settling_us, c.scan.oversampling
        ),
    );
    let [time_constant_ms, lead_ms] =
        [c.filter_time_constant_us, c.filter_lead_us].map(|us| f64::from(us) / 1e3);
    let filter = if c.filter().is_on() {
        format!("outputs with a time constant of {time_constant_ms} ms, a lead of {lead_ms} ms")
    } else {
        "nothing".into()
    };
    result.line("filtered in time", filter);
    let yes = |sent: bool| if sent { "yes" } else { "no" };
    result.line(
        "tracked if the model has a tracker",
        format!("{}, with a lead of {lead_ms} ms", yes(c.track)),
    );
    result.line(
        "sent of each scan",
        format!(
            "readings {}, estimates {}{}, of confidence {}",
            yes(c.send_readings),
            yes(c.send_estimates),
            if c.report_every > 1 {
                format!(" (one of {})", c.report_every)
            } else {
                String::new()
            },
            match c.confidence {
                ConfidenceSent::Nothing => "nothing",
                ConfidenceSent::Novelty => "novelty",
                ConfidenceSent::Deviations => "novelty and deviations",
            }
        ),
    );
    result.line(
        "limits",
        format!(
            "shorted below {} Ω, open above {} Ω, contact from {}",
            c.shorted_below_ohm, c.open_above_ohm, c.contact_threshold
        ),
    );
    let from = |threshold: f32, unit: &str| match threshold {
        0.0 => "off".into(),
        threshold => format!("from {threshold}{unit}"),
    };
    let [load, slip] = [from(c.load_threshold, ""), from(c.slip_mm_per_s, " mm/s")];
    result.line("events", format!("load {load}, slip {slip}"));
    if let Some(constants) = &constants {
        let whether = if kept.constants { "kept" } else { "none are kept" };
        result.line("constants", whether);
        constants_lines(&mut result, constants);
    }
    match &kept.baseline {
        Some(b) => result.line(
            "baseline",
            format!("kept: mean of {} frames of {} × {} readings", b.frames, b.rows, b.columns),
        ),
        None => result.line("baseline", "none is kept"),
    }
    result.line("writes left", format!("{} until the next restart", kept.writes_left));
    Ok(print::sections(common, &result))
}

/// Adds the circuit's constants.
pub fn constants_lines(result: &mut Sections, constants: &CircuitConstants) {
    let CircuitConstants { drive_v, reference_v, .. } = constants;
    result.line("drive", format!("{drive_v:.5} V of {reference_v:.4} V"));
    let lists = [
        ("row source, Ω", &constants.row_source_ohm, 4),
        ("feedback, Ω", &constants.feedback_ohm, 2),
        ("series, Ω", &constants.series_ohm, 3),
    ];
    for (name, ohm, digits) in lists {
        let numbers: Vec<String> = ohm.iter().map(|ohm| format!("{ohm:.digits$}")).collect();
        result.line(name, numbers.join(" "));
    }
}
