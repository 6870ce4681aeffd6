//! What a point is worth: its scan, its limit, its model, and what that costs.

use std::collections::BTreeMap;

use serde::Deserialize;
use taxel_core::rbf::Format;
use taxel_data::Silent;
use taxel_learn::cost::{Cost, DecoderRam, Design};
use taxel_learn::reading_model::Extent;
use taxel_limit::{Reference, Refusal};
use taxel_simulate::World;

use super::fields::nearest;
use super::plan::{Plan, Point};
use crate::error::Result;
use crate::evaluate::trade::Wires;
use crate::experiment::Experiment;
use crate::measurements::Measurements;
use crate::metrics::{self, Measure};
use crate::subject::Subject;

/// Results of a point by their names, such as `rmse_dz_mm`, and remarks on them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Results {
    pub values: BTreeMap<String, f64>,
    pub notes: Vec<String>,
}

impl Results {
    fn add(&mut self, name: &str, value: Option<f64>) {
        if let Some(value) = value.filter(|value| value.is_finite()) {
            self.values.insert(name.into(), value);
        }
    }
}

/// Results that do not belong to a group of outputs, in the order of tables.
const GENERAL: [&str; 12] = [
    "rows",
    "columns",
    "area_cm2",
    "cost_eur",
    "scan_ms",
    "decode_ms",
    "frame_ms",
    "frames_per_s",
    "age_ms",
    "cycles",
    "blob_bytes",
    "ram_bytes",
];
/// First of these that only a model has.
const MODEL_FROM: usize = 5;
/// Results of each group of outputs, in the order of tables.
const OF_GROUP: [&str; 4] = ["limit", "limit_standard_error", "rmse", "ratio_to_limit"];

/// Names of all results that points of a plan may have, whose outputs are in these groups.
pub fn columns_of(plan: &Plan, groups: &[&str]) -> Vec<String> {
    let of_groups = groups.iter().flat_map(|group| OF_GROUP.map(|name| format!("{name}_{group}")));
    let all = GENERAL.iter().map(|name| (*name).into()).chain(of_groups);
    all.filter(|name| not_computed(plan, name).is_none()).collect()
}

/// Reason why a plan does not compute the result called `name`, and what to give for it; `None` if it does, and for a
/// name that no result has.
pub fn not_computed(plan: &Plan, name: &str) -> Option<&'static str> {
    let is_of_scene = ["area_cm2", "cost_eur"].contains(&name) || name.starts_with("limit_");
    let is_of_model = ["rmse_", "ratio_to_limit_"].iter().any(|start| name.starts_with(start))
        || GENERAL[MODEL_FROM..].contains(&name);
    if plan.data.is_some() && (is_of_scene || name.starts_with("ratio_")) {
        return Some("measurements have no such result; a scene has");
    }
    let is_of_limit = name.starts_with("limit_") || name.starts_with("ratio_");
    match name {
        "cost_eur" if plan.prices.is_none() => Some("the plan has no [prices]; give them"),
        _ if is_of_limit && plan.limit_frames == Some(0) => {
            Some("the plan computes no limit; leave limit_frames = 0 out")
        }
        _ if is_of_model && !plan.train => {
            Some("the plan trains no model; leave train = false out")
        }
        _ => None,
    }
}

/// Place of a result in tables.
pub fn place_of(name: &str) -> (usize, &str, usize) {
    if let Some(place) = GENERAL.iter().position(|known| *known == name) {
        return (place, "", 0);
    }
    // The longest name that fits: `limit_standard_error_…` begins with `limit_…`.
    let prefixes = OF_GROUP
        .iter()
        .enumerate()
        .filter_map(|(place, prefix)| Some((place, name.strip_prefix(prefix)?.strip_prefix('_')?)));
    let found = prefixes.min_by_key(|(_, group)| group.len());
    found.map_or((usize::MAX, name, 0), |(place, group)| (GENERAL.len(), group, place))
}

/// Limit of a world, which points share that differ only in their training.
#[derive(Debug, Default)]
pub struct Shared(Option<(World, usize, std::result::Result<Reference, Refusal>)>);

impl Shared {
    /// Limit on the first `frames` test frames of a world.
    fn limit(&mut self, world: &World, frames: usize) -> std::result::Result<Reference, Refusal> {
        match &self.0 {
            Some((known, of, limit)) if known == world && *of == frames => limit.clone(),
            _ => {
                let limit = Reference::new(world, frames, &Silent);
                self.0 = Some((world.clone(), frames, limit.clone()));
                limit
            }
        }
    }
}

/// Computes a point of the plan.
///
/// # Errors
/// [`Error`](crate::Error) for a scene that does not hold, and for a model that cannot be trained.
pub fn compute(plan: &Plan, point: &Point, shared: &mut Shared) -> Result<Results> {
    let mut subject = match &plan.data {
        None => Subject::Scene(Box::new(Experiment::parse("of the point", &point.scene)?)),
        Some(data) => Subject::Measured(Box::new(
            measured(data, &point.scene)
                .map_err(|message| taxel_data::Error::unfit(format!("training: {message}")))?,
        )),
    };
    let mut results = Results::default();
    let wires = match &subject {
        Subject::Scene(scene) => Some(Wires::of(&scene.world)),
        Subject::Measured(data) => Wires::named(&data.training.inputs.names),
    };
    let scan_ms = point.device.scan_ms(wires, point.samples);
    results.add("rows", wires.map(|wires| wires.rows as f64));
    results.add("columns", wires.map(|wires| wires.columns as f64));
    results.add("scan_ms", scan_ms);
    let mut limit = None;
    if let Subject::Scene(scene) = &mut subject {
        let world = &mut scene.world;
        let [x_mm, y_mm, _] = world.sensor.size_mm;
        results.add("area_cm2", Some(x_mm * y_mm / 100.0));
        world.noise = point.device.averaged(world.noise, wires, point.samples);
        let frames = plan.limit_frames.unwrap_or_else(|| Reference::few_frames(world));
        if frames > 0 {
            match shared.limit(&scene.world, frames) {
                Ok(found) => limit = Some(found),
                Err(refusal) => results.notes.push(format!("no limit: {refusal}")),
            }
        }
    }
    for group in limit.iter().flat_map(Reference::limits) {
        results.add(&format!("limit_{}", group.group), Some(group.limit));
        results.add(
            &format!("limit_standard_error_{}", group.group),
            Some(group.limit_standard_error),
        );
    }
    if !plan.train {
        return Ok(results);
    }
    let own = match &subject {
        Subject::Scene(scene) => scene.measure(),
        Subject::Measured(data) => data.measure(),
    };
    let measure = Measure { limit, ..own };
    let (training, test) = subject.sets(None);
    let blob = training.blob(&subject.options(), &Silent)?;
    let model = blob.prepare().of_inputs();
    for errors in metrics::judge(&model, &test, &measure).errors {
        results.add(&format!("rmse_{}", errors.group), Some(errors.rmse));
        results.add(&format!("ratio_to_limit_{}", errors.group), errors.ratio_to_limit);
    }
    let design = Design::new(&blob);
    let cost = Cost::of_frame(&design);
    let times = point.device.times(scan_ms, &cost);
    results.add("decode_ms", Some(times.decode_ms));
    results.add("frame_ms", Some(times.frame_ms));
    results.add("frames_per_s", Some(times.frames_per_s));
    results.add("age_ms", times.age_ms);
    results.add("cycles", Some(cost.cycles as f64));
    results.add("blob_bytes", Some(blob.bytes().len() as f64));
    results.add("ram_bytes", Some(DecoderRam::new(&design).bytes() as f64));
    Ok(results)
}

/// Fields that a plan may change in the training on measurements.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MeasuredFile {
    seed: Option<u64>,
    training: Option<TrainingFile>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct TrainingFile {
    centres: Option<usize>,
    spread: Option<f64>,
    format: Option<String>,
    each_row: Option<bool>,
    features: Option<usize>,
    refine: Option<bool>,
    reading_model: Option<Extent>,
}

/// Measurements, trained on as the fields in `text` say.
///
/// # Errors
/// The reason, in serde's words.
pub fn measured(data: &Measurements, text: &str) -> std::result::Result<Measurements, String> {
    let file: MeasuredFile = toml::from_str(text).map_err(|cause| cause.message().to_owned())?;
    let mut data = data.clone();
    let (t, options) = (file.training.unwrap_or_default(), &mut data.options);
    options.seed = file.seed.unwrap_or(options.seed);
    options.centres = t.centres.unwrap_or(options.centres);
    options.spread = t.spread.unwrap_or(options.spread);
    if let Some(name) = &t.format {
        let known = Format::ALL.map(Format::name);
        let unknown = || format!("unknown format `{name}`; {}", nearest(name, &known));
        options.format = Format::from_name(name).ok_or_else(unknown)?;
    }
    options.each_row = t.each_row.unwrap_or(options.each_row);
    options.features = t.features.or(options.features);
    data.refine = t.refine.unwrap_or(data.refine);
    data.reading_model = t.reading_model.or(data.reading_model);
    Ok(data)
}
