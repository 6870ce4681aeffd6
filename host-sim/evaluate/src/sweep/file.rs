//! Plan as it stands in its file, before it is checked.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use toml::Table;

use super::fields::require_known;

/// Plan as it stands in its file.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct PlanFile {
    pub name: String,
    /// Scenes: built-in ones, or files beside the plan.
    pub scene: Option<OneOrMore>,
    /// Measurements instead of a scene: a data file beside the plan, and the options that `train` takes for it.
    pub data: Vec<String>,
    #[serde(flatten)]
    pub wanted: Wanted,
}

impl PlanFile {
    /// Plan in a file's text.
    ///
    /// # Errors
    /// The reason, in serde's words.
    pub fn parse(text: &str) -> std::result::Result<Self, String> {
        check_top(text)?;
        toml::from_str(text).map_err(|cause| cause.to_string().trim_end().into())
    }
}

/// What is wanted of the points, and which there are.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default)]
pub struct Wanted {
    /// Number of test frames for the limit, instead of as many as suffice; none for no limit.
    pub limit_frames: Option<usize>,
    /// Whether models are trained.
    pub train: bool,
    /// Number of seeds that every point is computed with.
    pub repeats: usize,
    /// Results that are to be small.
    pub objectives: Vec<String>,
    /// Bounds on results.
    pub bounds: BTreeMap<String, Bound>,
    /// Device that scans and decodes, and `samples` averaged.
    pub device: Table,
    /// Prices of the parts of a sensor.
    pub prices: Option<PartPrices>,
    /// Fields that are changed in every point.
    pub set: Table,
    /// Axes that are crossed.
    pub axes: Table,
    /// Axes that are drawn together.
    pub draw: Option<Draw>,
}

impl Default for Wanted {
    fn default() -> Self {
        Self {
            limit_frames: None,
            train: true,
            repeats: 1,
            objectives: vec![],
            bounds: BTreeMap::new(),
            device: Table::new(),
            prices: None,
            set: Table::new(),
            axes: Table::new(),
            draw: None,
        }
    }
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub(super) enum OneOrMore {
    One(String),
    More(Vec<String>),
}

/// Latin hypercube of some axes.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Draw {
    pub(super) points: usize,
    #[serde(default = "one")]
    pub(super) seed: u64,
    pub(super) axes: Table,
}

fn one() -> u64 {
    1
}

/// Bound on a result: the most, or the least.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Bound {
    Most(f64),
    Least { least: f64 },
}

impl Bound {
    /// Whether a result is within the bound.
    pub fn allows(self, value: f64) -> bool {
        match self {
            Self::Most(most) => value <= most,
            Self::Least { least } => value >= least,
        }
    }
}

/// Prices of the parts of a sensor, in €.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PartPrices {
    pub fixed_eur: f64,
    /// Price of a row-wire with what drives it.
    pub row_eur: f64,
    /// Price of a column-wire with what samples it.
    pub column_eur: f64,
    /// Price of a cm² of the mat.
    pub cm2_eur: f64,
}

/// Checks the names at the top of a plan: serde does not, where fields are flattened.
fn check_top(text: &str) -> std::result::Result<(), String> {
    const KNOWN: [&str; 13] = [
        "name",
        "scene",
        "data",
        "limit_frames",
        "train",
        "repeats",
        "objectives",
        "bounds",
        "device",
        "prices",
        "set",
        "axes",
        "draw",
    ];
    let Ok(table) = toml::from_str::<Table>(text) else { return Ok(()) };
    let known = table.keys().try_for_each(|key| require_known("field", key, &KNOWN));
    known.map_err(|bad| bad.to_string())
}
