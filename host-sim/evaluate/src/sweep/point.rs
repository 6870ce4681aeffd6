//! Results of a point by their names, and the fields of its training.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use serde::Deserialize;
use taxel_learn::Options;
use taxel_learn::decoders::BASELINES;
use toml::Table;

use super::fields;
use super::file::Also;
use super::plan::Plan;
use crate::error::Result;
use crate::evaluate::paper_networks::Cell;
use crate::experiment::Experiment;
use crate::measurements::Measurements;
use crate::metrics::{self, Blocks, Definition};
use crate::training_options::TrainingOptions;

/// Results of a point by their names, such as `rmse_dz_mm`, and remarks on them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Results {
    pub values: BTreeMap<String, f64>,
    /// Parts of blocks of frames in errors, by their names: what tells how sure their differences are.
    pub blocks: Blocks,
    pub notes: Vec<String>,
    /// Errors of a cell of Table 1, if the plan wants it.
    pub cell: Option<Cell>,
    /// Sum of the squared errors of each output, if a fold is held out.
    pub squares: Vec<f64>,
}

impl Results {
    pub(super) fn add(&mut self, name: &str, value: Option<f64>) {
        if let Some(value) = value.filter(|value| value.is_finite()) {
            self.values.insert(name.into(), value);
        }
    }

    /// Adds the error of a group with its standard error, which `blocks` tell.
    pub(super) fn add_estimate(
        &mut self,
        name: &str,
        group: &str,
        error: f64,
        blocks: Option<&Vec<f64>>,
    ) {
        let name_of_group = format!("{name}_{group}");
        self.add(&name_of_group, Some(error));
        if let Some(blocks) = blocks {
            let error = metrics::standard_error(blocks.iter().copied());
            self.add(&format!("{name}_standard_error_{group}"), Some(error));
            self.blocks.insert(name_of_group, blocks.clone());
        }
    }
}

/// Result that belongs to no group of outputs, and its words.
#[derive(Debug)]
pub struct General {
    pub name: &'static str,
    /// Heading of a column.
    pub heading: &'static str,
    /// Unit; empty for none, or if the heading has it.
    pub unit: &'static str,
    /// Name in full, without a unit.
    pub in_full: &'static str,
    /// What stands behind the number of a bound.
    pub bounded: &'static str,
}

/// All of them, in the order of tables. Those from `centres` on only a model has.
pub static GENERAL: [General; 17] = [
    general("rows", ["rows", ""], ["rows", "rows"]),
    general("columns", ["columns", ""], ["columns", "columns"]),
    general("area_cm2", ["area", "cm²"], ["area", "cm² of area"]),
    general("cost_eur", ["cost", "€"], ["cost", "€"]),
    general("scan_ms", ["scan", "ms"], ["time of a scan", "ms for a scan"]),
    general("centres", ["K", ""], ["number of centres K", "centres"]),
    general("spread", ["spread", ""], ["spread", "of spread"]),
    general("filter_ms", ["filter", "ms"], ["time constant of the filter", "ms of the filter"]),
    general("lead_ms", ["lead", "ms"], ["time by which the filter leads", "ms of lead"]),
    general("decode_ms", ["decoding", "ms"], ["time of decoding", "ms for decoding"]),
    general(
        "frame_ms",
        ["frame", "ms"],
        ["time of a frame, from scan to estimate", "ms for a frame"],
    ),
    general("frames_per_s", ["frames/s", ""], ["frames a second", "frames/s"]),
    general("age_ms", ["age", "ms"], ["age of an estimate when it is used", "ms of age"]),
    general("instructions", ["instructions", ""], ["instructions of decoding", "instructions"]),
    general("cycles", ["cycles", ""], ["cycles of decoding", "cycles"]),
    general("blob_bytes", ["flash", "B"], ["flash of the blob", "bytes of flash"]),
    general(
        "ram_bytes",
        ["RAM", "B"],
        ["RAM for decoding, without weights", "bytes of RAM for decoding"],
    ),
];

const fn general(
    name: &'static str,
    [heading, unit]: [&'static str; 2],
    [in_full, bounded]: [&'static str; 2],
) -> General {
    General { name, heading, unit, in_full, bounded }
}

/// Results of each group of outputs, in the order of tables: the limit, errors by all definitions, and of the baselines.
static OF_GROUP: LazyLock<Vec<String>> = LazyLock::new(|| {
    let errors = Definition::ALL.iter().map(|definition| definition.name);
    let errors = ["limit"].into_iter().chain(errors).chain(["worst_rmse"]);
    let with_errors = errors.flat_map(|name| [name.to_owned(), format!("{name}_standard_error")]);
    let baselines = BASELINES.iter().map(|baseline| format!("{}_rmse", baseline.name));
    with_errors.chain(baselines).collect()
});

/// Result of a group: what it is, and the group. The longest name that fits, since `limit_standard_error_…` begins with
/// `limit_…`.
fn of_group(name: &str) -> Option<(usize, &str)> {
    let group = |what: &String| name.strip_prefix(what.as_str())?.strip_prefix('_');
    let found = OF_GROUP.iter().enumerate();
    let found = found.filter_map(|(place, what)| Some((place, group(what)?)));
    found.min_by_key(|(_, group)| group.len())
}

/// Name of the standard error of an error.
pub fn standard_error_of(name: &str) -> Option<String> {
    let (place, group) = of_group(name)?;
    Some(format!("{}_standard_error_{group}", OF_GROUP[place]))
}

/// Group of outputs that a result is of.
pub fn group_in(name: &str) -> Option<&str> {
    of_group(name).map(|(_, group)| group)
}

/// Names of all results that points of a plan may have, whose outputs are in these groups.
pub fn columns_of(plan: &Plan, groups: &[&str]) -> Vec<String> {
    let all = Some(metrics::ALL).filter(|_| groups.len() > 1);
    let of_groups = groups.iter().copied().chain(all);
    let of_groups =
        of_groups.flat_map(|group| OF_GROUP.iter().map(move |name| format!("{name}_{group}")));
    let all = GENERAL.iter().map(|it| it.name.into()).chain(of_groups);
    all.filter(|name| not_computed(plan, name).is_none()).collect()
}

/// Reason why a plan does not compute the result called `name`, and what to give for it; `None` if it does, and for a
/// name that no result has.
pub fn not_computed(plan: &Plan, name: &str) -> Option<&'static str> {
    let what = of_group(name).map_or(name, |(place, _)| &OF_GROUP[place]);
    let is_of_limit = what.starts_with("limit") || what.starts_with("ratio_to_limit");
    let of_model = GENERAL.iter().skip_while(|it| it.name != "centres");
    let is_of_model = of_model.map(|it| it.name).any(|it| it == what)
        || (of_group(name).is_some() && !what.starts_with("limit"));
    let of_baseline =
        BASELINES.iter().any(|it| what.strip_suffix("_rmse").is_some_and(|name| name == it.name));
    let is_of_scene = ["area_cm2", "cost_eur"].contains(&what) || is_of_limit;
    match what {
        _ if plan.data.is_some() && is_of_scene => {
            Some("measurements have no such result; a scene has")
        }
        "cost_eur" if plan.prices.is_none() => Some("the plan has no [prices]; give them"),
        _ if is_of_limit && plan.limit_frames == Some(0) => {
            Some("the plan computes no limit; leave limit_frames = 0 out")
        }
        _ if is_of_model && !plan.train => {
            Some("the plan trains no model; leave train = false out")
        }
        _ if of_baseline && !plan.has(Also::Baselines) => {
            Some("the plan has no baselines; give also = [\"baselines\"]")
        }
        "worst_rmse" | "worst_rmse_standard_error" if !plan.has(Also::OtherContacts) => {
            Some("the plan has no other contacts; give also = [\"other_contacts\"]")
        }
        _ => None,
    }
}

/// Place of a result in tables.
pub fn place_of(name: &str) -> (usize, &str, usize) {
    if let Some(place) = GENERAL.iter().position(|known| known.name == name) {
        return (place, "", 0);
    }
    of_group(name).map_or((usize::MAX, name, 0), |(place, group)| (GENERAL.len(), group, place))
}

/// Options for training a scene's model, or one on measurements, as the fields in `text` say.
pub fn options(data: Option<&Measurements>, text: &str) -> Result<Options> {
    Ok(match data {
        None => Experiment::parse("of the point", text)?.options(),
        Some(data) => measured(data, text).map_err(taxel_data::Error::unfit)?.how.options,
    })
}

/// Fields that a plan may change in the training on measurements.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MeasuredFile {
    pub seed: Option<u64>,
    #[serde(default)]
    pub training: TrainingOptions,
}

/// What the `[set]` of a plan says of the training on measurements.
///
/// # Errors
/// The reason, in serde's words.
pub(super) fn set(set: &Table) -> std::result::Result<MeasuredFile, String> {
    let mut document = Table::new();
    for (field, value) in fields::leaves(set, &|_| false) {
        fields::set(&mut document, &field, value).map_err(|bad| bad.to_string())?;
    }
    document.remove("device");
    document.remove("data");
    document.try_into().map_err(|cause| fields::with_nearest(cause.message()))
}

/// Measurements, trained on as the fields in `text` say.
///
/// # Errors
/// The reason, in serde's words.
pub fn measured(data: &Measurements, text: &str) -> std::result::Result<Measurements, String> {
    let file: MeasuredFile = toml::from_str(text).map_err(|cause| cause.message().to_owned())?;
    let mut data = data.clone();
    data.train_with(&file.training).map_err(|bad| bad.to_string())?;
    data.how.options.seed = file.seed.unwrap_or(data.how.options.seed);
    Ok(data)
}
