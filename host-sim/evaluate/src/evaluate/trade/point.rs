//! Points: ways to decode, with their errors and their cost.

use serde::Serialize;
use taxel_core::filter::Settings;
use taxel_core::rbf::Format;
use taxel_learn::cost::Cost;

use super::choice::Offer;
use super::device::Times;
use super::readings::in_words;
use super::worst::OtherError;
use crate::metrics::{self, Errors};

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn by_name<S: serde::Serializer>(
    format: &Format,
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    serializer.serialize_str(format.name())
}

/// Settings of a filter in time, as a device is configured with them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
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
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Point {
    /// Number format.
    #[serde(serialize_with = "by_name")]
    pub format: Format,
    /// Whether each row is decoded by a network of its own, instead of all by one behind a projection.
    pub each_row: bool,
    /// Number of centres K of each network.
    pub centres: usize,
    /// Width σ on scaled inputs.
    pub spread: f64,
    /// Index of the [readings](super::Trade::readings) that are decoded.
    pub readings: usize,
    /// Number of column-wires that are read; `None` if the readings are not those of wires.
    pub columns: Option<usize>,
    /// Number of samples averaged for each reading.
    pub samples_averaged: usize,
    /// Filter in time behind the decoder; `None` without one.
    pub filter: Option<FilterSettings>,
    /// Errors on the test frames, or on [contacts that move](super::Trade::motion), by group.
    pub errors: Vec<Errors>,
    /// Errors on still contacts that the model was not trained on, without a filter; empty for measurements.
    pub others: Vec<OtherError>,
    /// Ratio of the RMSE to the smallest of all points, by group.
    pub ratio_to_best: Vec<f64>,
    /// Cost of one frame on a Cortex-M4F.
    #[serde(flatten)]
    pub frame: Cost,
    /// Times of one frame on the plan's device.
    #[serde(flatten)]
    pub times: Times,
    pub blob_bytes: usize,
    /// Size of decoder, frame, estimate and working memory.
    pub ram_bytes: usize,
    /// Whether the point is on the Pareto front: no other point is at least as good in the time of a frame and the RMSE
    /// of the chosen group, and better in one.
    pub on_front: bool,
}

impl Point {
    /// RMSE of a group, in its unit, or of [all](metrics::rmse_of) of them.
    pub fn rmse(&self, group: &str) -> f64 {
        metrics::rmse_of(&self.errors, group).unwrap_or(f64::NAN)
    }

    /// Ratio of the RMSE of a group to the limit, where that is known.
    pub fn ratio_to_limit(&self, group: &str) -> Option<f64> {
        self.errors.iter().find(|e| e.group == group)?.ratio_to_limit
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
        format!("{}, K = {}{readings}{filter}", self.way(), self.centres)
    }

    /// What the point has to offer by the error of a group.
    pub(super) fn offer(&self, group: &str, worst_case: bool) -> Offer {
        Offer {
            rmse: self.counted_rmse(group, worst_case),
            cycles: self.frame.cycles,
            blob_bytes: self.blob_bytes,
            times: self.times,
        }
    }
}
