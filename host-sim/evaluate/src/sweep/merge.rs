//! Results of a whole plan, whoever computed them: all points, the best of them, and what the axes do.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use super::bounds::{self, Bounds};
use super::effects::{Effect, Settings};
use super::file::PartPrices;
use super::front::{self, Offer, front};
use super::plan::{Plan, Point, SCENE, is_of_repeats};
use super::point::{place_of, standard_error_of};
use super::store::{Found, Record, Store};
use crate::error::{Error, Result};
use crate::metrics::{Blocks, standard_error};

/// Results of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Merged {
    pub plan: String,
    /// Program that computed them.
    pub build: String,
    /// Fields that points differ in.
    pub fields: Vec<String>,
    /// Names of all results, in the order of tables.
    pub columns: Vec<String>,
    pub objectives: Vec<String>,
    pub bounds: Bounds,
    /// Points with a result, in the plan's order.
    pub points: Vec<PointResult>,
    /// Identities of points without a result.
    pub missing: Vec<String>,
    /// Settings: points that differ at most in their seed or fold, put together.
    pub settings: Vec<Setting>,
    pub effects: Vec<Effect>,
}

/// Result of a point, with the fields that this plan's points differ in.
#[derive(Debug, Clone, PartialEq)]
pub struct PointResult {
    pub id: String,
    pub values: BTreeMap<String, Value>,
    pub results: BTreeMap<String, f64>,
    /// Parts of blocks of frames in errors.
    pub blocks: Blocks,
    /// Remarks on them.
    pub notes: Vec<String>,
    /// Reason why there are none.
    pub failed: Option<String>,
}

impl PointResult {
    fn new(point: &Point, record: Record, prices: Option<&PartPrices>) -> Self {
        let value = |value: &toml::Value| serde_json::to_value(value).unwrap_or(Value::Null);
        let values = point.values.iter().map(|(field, it)| (field.clone(), value(it))).collect();
        let Record { id, mut results, blocks, notes, failed, .. } = record;
        if let Some(prices) = prices {
            prices.add_cost(&mut results);
        }
        Self { id, values, results, blocks, notes, failed }
    }
}

/// Points that differ at most in their seed or fold.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Fields, without seed and fold.
    pub values: BTreeMap<String, Value>,
    /// Number of points with results.
    pub repeats: usize,
    /// Means of their results.
    pub results: BTreeMap<String, f64>,
    /// Standard deviations between them; nothing without repeats.
    pub deviations: BTreeMap<String, f64>,
    /// Means of the parts of blocks of frames in errors.
    pub blocks: Blocks,
    /// Whether the means are within all bounds.
    pub is_within: bool,
    /// Whether no other setting within the bounds is as good in all objectives and better in one. Errors that their test
    /// frames do not tell apart are equal, and then the cheaper setting is on the front.
    pub on_front: bool,
    /// Scene of its first point, for settings on the front.
    pub scene: Option<String>,
}

impl Setting {
    /// Setting in words.
    pub fn in_words(&self) -> String {
        in_words(&self.values)
    }
}

/// Fields and their values in words.
pub fn in_words(values: &BTreeMap<String, Value>) -> String {
    let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    let fields = values.iter().map(|(field, value)| format!("{field} = {}", text(value)));
    fields.collect::<Vec<_>>().join(", ")
}

impl Merged {
    /// Reads the results of all `points` of a plan from a folder.
    ///
    /// # Errors
    /// [`Error::Usage`] that names every file that cannot be used.
    pub fn read(plan: &Plan, points: &[Point], store: &Store) -> Result<Self> {
        const NAMED: usize = 10;
        let (mut records, mut unusable) = (Vec::new(), Vec::new());
        for point in points {
            records.push(match store.find(plan, point)? {
                Found::Whole(record) => Some(*record),
                Found::Missing => None,
                Found::Unusable(why) => {
                    unusable.push(format!("{}: {why}", store.path(&point.id).display()));
                    None
                }
            });
        }
        if unusable.is_empty() {
            return Ok(Self::new(plan, points, records));
        }
        let more = unusable.len().saturating_sub(NAMED);
        let more = if more > 0 { format!("\nand {more} more") } else { String::new() };
        unusable.truncate(NAMED);
        Err(Error::Usage(format!(
            "{}{more}\nremove what is named here, and run the sweep again: it computes what is missing",
            unusable.join("\n")
        )))
    }

    /// Results of a plan's `points`, those that there are.
    pub fn new(plan: &Plan, points: &[Point], records: Vec<Option<Record>>) -> Self {
        let (mut results, mut scenes, mut missing) = (Vec::new(), Vec::new(), Vec::new());
        for (point, record) in points.iter().zip(records) {
            match record {
                None => missing.push(point.id.clone()),
                Some(record) => {
                    results.push(PointResult::new(point, record, plan.prices.as_ref()));
                    scenes.push(point.scene.as_str());
                }
            }
        }
        let names: BTreeSet<&String> =
            results.iter().flat_map(|point| point.results.keys()).collect();
        let mut columns: Vec<String> = names.into_iter().cloned().collect();
        columns.sort_by(|a, b| place_of(a).cmp(&place_of(b)));
        let (mut settings, first): (Vec<Setting>, Vec<usize>) =
            settings(&results).into_iter().unzip();
        mark(&mut settings, &plan.objectives, &plan.bounds);
        for (setting, point) in settings.iter_mut().zip(first) {
            setting.scene = setting.on_front.then(|| scenes[point].to_owned());
        }
        let fields: Vec<String> =
            plan.fields.iter().filter(|field| !is_of_repeats(field)).cloned().collect();
        let all = Settings {
            fields: &fields,
            is_drawn: plan.is_drawn,
            values: settings.iter().map(|it| &it.values).collect(),
        };
        let result = |name: &String| {
            settings.iter().map(|it| it.results.get(name).copied()).collect::<Vec<_>>()
        };
        let effects =
            plan.objectives.iter().flat_map(|name| all.effects(name, &result(name))).collect();
        Self {
            plan: plan.name.clone(),
            build: plan.build.clone(),
            fields: plan.fields.clone(),
            columns,
            objectives: plan.objectives.clone(),
            bounds: plan.bounds.clone(),
            points: results,
            missing,
            settings,
            effects,
        }
    }

    /// Layouts in the order of their scenes, each with the setting that has the smallest first objective within the bounds; of
    /// those whose errors count as equal, that with the smallest last one. A plan of one scene does not name it: that is the
    /// `first`.
    pub fn best_of_layouts<'m>(&'m self, first: &'m str) -> Vec<(&'m str, Option<&'m Setting>)> {
        let layout = |setting: &'m Setting| layout_of(&setting.values, first);
        let of = |name: Option<&String>, setting: &Setting| {
            let result = name.and_then(|name| setting.results.get(name));
            result.copied().unwrap_or(f64::INFINITY)
        };
        let [error, cost] = [self.objectives.first(), self.objectives.last()];
        // The decoders of a layout follow each other.
        let layouts = self
            .settings
            .chunk_by(|a, b| layout_of(&a.values, first) == layout_of(&b.values, first));
        let best = |own: &'m [Setting]| {
            let within: Vec<&Setting> = own.iter().filter(|it| it.is_within).collect();
            let by_cost = |a: &&&Setting, b: &&&Setting| of(cost, a).total_cmp(&of(cost, b));
            let name = error.map_or("", String::as_str);
            (
                layout(&own[0]),
                front::best(name, &within, |it| (of(error, it), &it.blocks), by_cost).copied(),
            )
        };
        layouts.map(best).collect()
    }

    /// Settings on the front, from the cheapest by the last objective on.
    pub fn front(&self) -> Vec<&Setting> {
        let mut front: Vec<&Setting> =
            self.settings.iter().filter(|setting| setting.on_front).collect();
        let last = |setting: &Setting| {
            let result = self.objectives.last().and_then(|name| setting.results.get(name));
            result.copied().unwrap_or(f64::NAN)
        };
        front.sort_by(|a, b| last(a).total_cmp(&last(b)));
        front
    }

    /// Sentence for results none of which is within the bounds: it names the setting that misses the worst of them least.
    pub fn none_within(&self) -> Option<String> {
        let results = self.settings.iter().map(|setting| &setting.results);
        let of =
            bounds::none_within(&self.bounds, &results, |place| self.settings[place].in_words());
        of.map(|of| format!("no setting is {of}"))
    }

    /// Checks that some setting is within the bounds.
    ///
    /// # Errors
    /// [`Error::Usage`] with [the sentence](Self::none_within) if there is none.
    pub fn check_bounds(&self) -> Result<()> {
        self.none_within().map_or(Ok(()), |none| Err(Error::Usage(none)))
    }

    /// Fields whose axes have an effect that is known, in the plan's order.
    pub fn fields_with_effects(&self) -> impl Iterator<Item = &String> {
        let has_effect =
            |field: &&String| self.effects.iter().any(|effect| effect.field == **field);
        self.fields.iter().filter(has_effect)
    }

    /// Effect of the axis of this field on a result.
    pub fn effect(&self, field: &str, result: &str) -> Option<&Effect> {
        self.effects.iter().find(|effect| effect.field == field && effect.result == result)
    }

    /// Remarks on points, with their reasons, such as `no limit: …`, and the number of points that have each.
    pub fn notes(&self) -> BTreeMap<&str, usize> {
        let mut notes = BTreeMap::new();
        for note in self.points.iter().flat_map(|point| &point.notes) {
            *notes.entry(note.as_str()).or_default() += 1;
        }
        notes
    }

    /// Points that could not be computed.
    pub fn failed(&self) -> impl Iterator<Item = &PointResult> {
        self.points.iter().filter(|point| point.failed.is_some())
    }
}

/// Name of the layout of a point or a setting with these fields; of one alone it is that of the `first`.
pub fn layout_of<'l>(values: &'l BTreeMap<String, Value>, first: &'l str) -> &'l str {
    values.get(SCENE).and_then(Value::as_str).unwrap_or(first)
}

fn without_repeats(values: &BTreeMap<String, Value>) -> BTreeMap<String, Value> {
    values
        .iter()
        .filter(|(field, _)| !is_of_repeats(field))
        .map(|(field, value)| (field.clone(), value.clone()))
        .collect()
}

/// Settings in the order of their first points, whose places stand beside them; points that failed are in none.
fn settings(points: &[PointResult]) -> Vec<(Setting, usize)> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut places: BTreeMap<String, usize> = BTreeMap::new();
    for (point, result) in points.iter().enumerate().filter(|(_, it)| it.failed.is_none()) {
        let key = format!("{:?}", without_repeats(&result.values));
        let place = *places.entry(key).or_insert(groups.len());
        match groups.get_mut(place) {
            Some(group) => group.push(point),
            None => groups.push(vec![point]),
        }
    }
    let setting = |members: Vec<usize>| {
        let group: Vec<&PointResult> = members.iter().map(|point| &points[*point]).collect();
        let names: BTreeSet<&String> =
            group.iter().flat_map(|point| point.results.keys()).collect();
        let (mut results, mut deviations) = (BTreeMap::new(), BTreeMap::new());
        for name in names {
            let values: Vec<f64> =
                group.iter().filter_map(|point| point.results.get(name).copied()).collect();
            let count = values.len() as f64;
            let mean = values.iter().sum::<f64>() / count;
            if name.contains("_standard_error_") {
                // That of the mean of independent results.
                let squares: f64 = values.iter().map(|error| error.powi(2)).sum();
                results.insert(name.clone(), squares.sqrt() / count);
                continue;
            }
            results.insert(name.clone(), mean);
            if values.len() > 1 {
                let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
                deviations.insert(name.clone(), (squares / (count - 1.0)).sqrt());
            }
        }
        let blocks = mean_blocks(&group);
        for (name, parts) in &blocks {
            if let Some(name) = standard_error_of(name) {
                results.insert(name, standard_error(parts.iter().copied()));
            }
        }
        let setting = Setting {
            blocks,
            values: without_repeats(&group[0].values),
            repeats: group.len(),
            results,
            deviations,
            is_within: false,
            on_front: false,
            scene: None,
        };
        (setting, members[0])
    };
    groups.into_iter().map(setting).collect()
}

/// Means of the blocks of points that differ in their seed or fold.
fn mean_blocks(points: &[&PointResult]) -> Blocks {
    let mut means = points[0].blocks.clone();
    means.retain(|name, parts| {
        let same = |point: &&PointResult| {
            point.blocks.get(name).is_some_and(|other| other.len() == parts.len())
        };
        let are_same = points.iter().all(same);
        let mean = |block: usize| {
            let sum: f64 = points.iter().filter_map(|it| it.blocks.get(name)?.get(block)).sum();
            sum / points.len() as f64
        };
        *parts = (0..parts.len()).map(mean).collect();
        are_same
    });
    means
}

/// Marks the settings within the bounds, and the Pareto front of these.
fn mark(settings: &mut [Setting], objectives: &[String], bounds: &Bounds) {
    for setting in settings.iter_mut() {
        setting.is_within = bounds::are_within(bounds, &setting.results);
    }
    let offered = settings.iter().enumerate().filter_map(|(place, setting)| {
        let values = objectives.iter().map(|name| setting.results.get(name).copied());
        let values = values.collect::<Option<Vec<f64>>>().filter(|_| setting.is_within)?;
        Some((place, Offer { values, blocks: &setting.blocks }))
    });
    let (places, offers): (Vec<usize>, Vec<Offer<'_>>) = offered.unzip();
    let front = front(objectives, &offers);
    for place in front {
        settings[places[place]].on_front = true;
    }
}
