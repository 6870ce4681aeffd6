//! Points: ways to decode, with their errors and their cost.

use std::collections::BTreeMap;

use serde_json::Value;
use taxel_core::filter::Settings;
use taxel_core::rbf::Format;

use crate::device::{Times, Wires};
use crate::metrics::Blocks;
use crate::sweep::merge::PointResult;

/// Settings of a filter in time, as a device is configured with them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilterSettings {
    pub time_constant_ms: f64,
    /// Time by which outputs are extrapolated.
    pub lead_ms: f64,
}

impl From<Settings> for FilterSettings {
    fn from(settings: Settings) -> Self {
        let [time_constant_ms, lead_ms] =
            [settings.time_constant_us, settings.lead_us].map(|us| f64::from(us) / 1000.0);
        Self { time_constant_ms, lead_ms }
    }
}

/// Way to decode, with its cost and its errors.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Identity of its settings.
    pub id: String,
    /// Settings, by the fields of the plan.
    pub values: BTreeMap<String, Value>,
    /// Number format.
    pub format: Format,
    /// Whether each row is decoded by a network of its own, instead of all by one behind a projection.
    pub each_row: bool,
    /// Number of centres K of each network.
    pub centres: usize,
    /// Steps from one column-wire that is read to the next.
    pub column_step: usize,
    /// Number of column-wires that are read; `None` if the readings are not those of wires.
    pub columns: Option<usize>,
    /// Number of samples averaged for each reading.
    pub samples_averaged: usize,
    /// Filter in time behind the decoder; `None` without one.
    pub filter: Option<FilterSettings>,
    /// Whether the model's tracker stands behind the decoder, in place of a filter.
    pub is_tracked: bool,
    /// Times of one frame on the plan's device.
    pub times: Times,
    /// Cycles of decoding a frame on a Cortex-M4F.
    pub cycles: u64,
    pub blob_bytes: usize,
    /// Size of decoder, frame, estimate and working memory.
    pub ram_bytes: usize,
    /// Whether the point is on the Pareto front.
    pub on_front: bool,
    /// All results, by the names that sweeps give them (docs/sweeps.md).
    pub results: BTreeMap<String, f64>,
    /// Parts of blocks of frames in errors.
    pub blocks: Blocks,
}

impl Point {
    /// Point of a plan's result; `None` of one that failed.
    pub fn new(point: &PointResult) -> Option<Self> {
        let result = |name: &str| point.results.get(name).copied();
        let count = |name: &str| Some(result(name)? as usize);
        let setting = |name: &str| point.values.get(name);
        let whole = |name: &str| setting(name)?.as_u64().map(|it| it as usize);
        let filter = setting("device.filter").and_then(Value::as_bool).unwrap_or(false);
        let (time_constant_ms, lead_ms) = (result("filter_ms"), result("lead_ms"));
        Some(Self {
            id: point.id.clone(),
            values: point.values.clone(),
            format: Format::from_name(setting("training.format")?.as_str()?)?,
            each_row: setting("training.each_row")?.as_bool()?,
            centres: count("centres")?,
            column_step: whole("device.column_step")?,
            columns: count("columns"),
            samples_averaged: whole("device.samples")?,
            filter: time_constant_ms
                .zip(lead_ms)
                .filter(|(ms, _)| filter && *ms > 0.0)
                .map(|(time_constant_ms, lead_ms)| FilterSettings { time_constant_ms, lead_ms }),
            is_tracked: result("tracked").is_some(),
            times: Times {
                scan_ms: result("scan_ms"),
                decode_ms: result("decode_ms")?,
                frame_ms: result("frame_ms")?,
                frames_per_s: result("frames_per_s")?,
                age_ms: result("age_ms"),
            },
            cycles: result("cycles")? as u64,
            blob_bytes: count("blob_bytes")?,
            ram_bytes: count("ram_bytes")?,
            on_front: false,
            results: point.results.clone(),
            blocks: point.blocks.clone(),
        })
    }

    /// Place among points: by readings, networks, centres, format and filter.
    pub(super) fn order(&self) -> impl Ord + use<> {
        let network = (!self.each_row, self.centres);
        let format = Format::ALL.iter().rev().position(|format| *format == self.format);
        (
            self.column_step,
            self.samples_averaged,
            network,
            format,
            self.filter.is_some() || self.is_tracked,
        )
    }

    /// Result with this name, if it is known.
    pub fn result(&self, name: &str) -> Option<f64> {
        self.results.get(name).copied()
    }

    /// RMSE of a group, in its unit, or of [all](crate::metrics::rmse_of) of them.
    pub fn rmse(&self, group: &str) -> f64 {
        self.result(&format!("rmse_{group}")).unwrap_or(f64::NAN)
    }

    /// Result of a group with its standard error, where both are known.
    pub fn estimate(&self, name: &str, group: &str) -> Option<[f64; 2]> {
        let error = self.result(&format!("{name}_standard_error_{group}"))?;
        Some([self.result(&format!("{name}_{group}"))?, error])
    }

    /// Wires that a scan reads; `None` if the readings are not those of wires.
    pub fn wires(&self) -> Option<Wires> {
        Some(Wires { rows: self.result("rows")? as usize, columns: self.columns? })
    }

    /// Whether both decode the same readings.
    pub(super) fn reads_like(&self, other: &Self) -> bool {
        (self.column_step, self.samples_averaged) == (other.column_step, other.samples_averaged)
    }

    /// Number format of the point, and whether it decodes the whole array at once.
    pub fn way(&self) -> String {
        format!("{}{}", self.format.name(), if self.each_row { "" } else { " array" })
    }

    /// Settings of the point in a few words.
    pub fn name(&self) -> String {
        let samples = Some(self.samples_averaged).filter(|samples| *samples > 1);
        let readings = in_words(self.columns, samples);
        let filter = self.filter.map_or(String::new(), |filter| {
            format!(", filter of {:.1} ms", filter.time_constant_ms)
        });
        let tracked = if self.is_tracked { ", tracked" } else { "" };
        format!("{}, K = {}{readings}{filter}{tracked}", self.way(), self.centres)
    }
}

/// Numbers of columns and samples in words, as far as they are told, each behind a comma.
pub(super) fn in_words(columns: Option<usize>, samples: Option<usize>) -> String {
    let counted = |number: Option<usize>, name| match number {
        None => String::new(),
        Some(1) => format!(", 1 {name}"),
        Some(number) => format!(", {number} {name}s"),
    };
    counted(columns, "column") + &counted(samples, "sample")
}
