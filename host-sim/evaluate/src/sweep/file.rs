//! Plan as it stands in its file, before it is checked.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use taxel_data::{BadValue, require};
use toml::Table;

use super::bounds::Bounds;
use super::fields::require_known;

/// Plan as it stands in its file.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct PlanFile {
    pub name: String,
    /// Scenes: built-in ones, or files beside the plan.
    pub scene: Option<OneOrMore>,
    /// Measurements instead of a scene: a data file beside the plan, and options for it.
    pub data: Option<Table>,
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Wanted {
    /// Number of test frames for the limit, instead of as many as suffice; none for no limit.
    pub limit_frames: Option<usize>,
    /// Whether models are trained.
    pub train: bool,
    /// What is computed besides.
    pub also: Vec<Also>,
    /// Number of seeds that every point is computed with.
    pub repeats: usize,
    /// Results that are to be small.
    pub objectives: Vec<String>,
    /// Bounds on results.
    #[serde(skip_serializing_if = "Bounds::is_empty")]
    pub bounds: Bounds,
    /// Device that scans and decodes, and `samples` averaged.
    pub device: Table,
    /// Prices of the parts of a sensor.
    pub prices: Option<PartPrices>,
    /// Fields that are changed in every point.
    #[serde(skip_serializing_if = "Table::is_empty")]
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
            also: vec![],
            repeats: 1,
            objectives: vec![],
            bounds: Bounds::new(),
            device: Table::new(),
            prices: None,
            set: Table::new(),
            axes: Table::new(),
            draw: None,
        }
    }
}

/// What a plan may compute besides, since it takes its time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Also {
    /// Errors of the baselines.
    Baselines,
    /// Errors on contacts that models are not trained on.
    OtherContacts,
    /// All errors of what the scene's Table 1 compares: the network, whose centres are those of the table, the baselines, and
    /// the paper's networks that no blob holds.
    Table1,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged, expecting = "give a name, or a list of names")]
pub(super) enum OneOrMore {
    One(String),
    More(Vec<String>),
}

impl OneOrMore {
    pub fn all(self) -> Vec<String> {
        match self {
            Self::One(name) => vec![name],
            Self::More(names) => names,
        }
    }
}

/// Latin hypercube of some axes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Draw {
    pub(super) points: usize,
    pub(super) seed: u64,
    pub(super) axes: Table,
}

impl Default for Draw {
    fn default() -> Self {
        Self { points: 0, seed: 1, axes: Table::new() }
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

impl PartPrices {
    pub(super) fn check(&self) -> std::result::Result<(), BadValue> {
        let all = [
            ("prices.fixed_eur", self.fixed_eur),
            ("prices.row_eur", self.row_eur),
            ("prices.column_eur", self.column_eur),
            ("prices.cm2_eur", self.cm2_eur),
        ];
        all.into_iter().try_for_each(|(field, price)| {
            let rule = || "give a price in €, 0 or more".into();
            require(price.is_finite() && price >= 0.0, field, price, rule)
        })
    }

    /// Adds `cost_eur` to `results` that tell of a sensor's parts.
    pub(super) fn add_cost(&self, results: &mut BTreeMap<String, f64>) {
        let of = |name| results.get(name).copied();
        if let [Some(rows), Some(columns), Some(area_cm2)] = ["rows", "columns", "area_cm2"].map(of)
        {
            let of_wires = rows * self.row_eur + columns * self.column_eur;
            results.insert("cost_eur".into(), self.fixed_eur + of_wires + area_cm2 * self.cm2_eur);
        }
    }
}

/// Checks the names at the top of a plan: serde does not, where fields are flattened.
fn check_top(text: &str) -> std::result::Result<(), String> {
    const KNOWN: [&str; 14] = [
        "name",
        "scene",
        "data",
        "limit_frames",
        "train",
        "also",
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
    if table.contains_key("sensor") {
        return Err(
            "it is a scene; give a plan, which names it by its field scene (docs/sweeps.md)".into(),
        );
    }
    let known = table.keys().try_for_each(|key| require_known("field", key, &KNOWN));
    known.map_err(|bad| bad.to_string())
}
