//! Plans: which points there are, and what is wanted of them.
//!
//! A plan is a TOML file; `docs/sweeps.md` explains every field.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use taxel_data::digest::{digest, of_debug};
use taxel_data::{BadValue, columns, input, require};
use taxel_learn::Options;
use toml::{Table, Value};

use super::axis::{Axis, latin_hypercube};
use super::bounds::Bounds;
use super::fields::{self, require_known};
use super::file::{Also, PartPrices, PlanFile, Wanted};
use super::on_device::OnDevice;
use super::point::{columns_of, group_in, not_computed};
use crate::error::{Error, Result};
use crate::experiment::{Experiment, check_name};
use crate::measurements::Measurements;
use crate::training_options::TrainingOptions;

mod points;

use points::{Document, text};

/// Fields, and lines of values of them.
type Lines = (Vec<String>, Vec<Vec<Value>>);

type Checked<T> = std::result::Result<T, BadValue>;

/// Most points of a plan.
const MOST_POINTS: usize = 100_000;
/// Field of a point that says which scene it is of, where a plan has several.
pub const SCENE: &str = "scene";
/// Field of the fold (from 0) of measured frames that a point's model is judged by, and not trained on.
pub const FOLD: &str = "data.fold";
/// Field of a point's seed, which repeats differ in.
pub const SEED: &str = "seed";

/// Whether points that differ in this `field` alone are repeats of one setting, and not a choice.
pub fn is_of_repeats(field: &str) -> bool {
    [SEED, FOLD].contains(&field)
}

/// Scene, or measurements, that fields are changed in.
#[derive(Debug, Clone, PartialEq)]
pub struct Base {
    /// Name in tables.
    pub label: String,
    /// Its fields; none of measurements.
    pub document: Table,
    /// Digest of its text, which ties models to it.
    pub digest: u64,
}

impl Base {
    /// Base of a scene called `label`, a built-in one or a file.
    ///
    /// # Errors
    /// [`Error`] for a scene that cannot be read.
    pub fn of_scene(label: &str, name_or_path: &str) -> Result<Self> {
        let text = Experiment::text(name_or_path)?;
        let document = toml::from_str(&text)
            .map_err(|cause| Error::of_scene(name_or_path, cause.to_string().trim_end()))?;
        Ok(Self { label: label.into(), document, digest: digest(text.as_bytes()) })
    }

    /// Base of measurements.
    pub fn measured(label: &str) -> Self {
        Self { label: label.into(), document: Table::new(), digest: 0 }
    }
}

/// Plan, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    pub name: String,
    /// Fields that points differ in.
    pub fields: Vec<String>,
    pub objectives: Vec<String>,
    pub bounds: Bounds,
    pub prices: Option<PartPrices>,
    /// Measurements that all points are trained on, if it is no plan of scenes.
    pub data: Option<Arc<Measurements>>,
    /// Digest of these, of the frames that they are judged by, and of all options.
    data_digest: u64,
    /// Number of test frames for the limit, if not as many as suffice.
    pub limit_frames: Option<usize>,
    pub train: bool,
    /// What is computed besides.
    pub also: Vec<Also>,
    /// Whether axes are drawn.
    pub is_drawn: bool,
    /// Program that computes it: another one may compute something else.
    pub build: String,
    bases: Vec<Base>,
    /// Usual settings by the bases' labels, unless one is a scene only with what axes give.
    usual: BTreeMap<String, Options>,
    set: Vec<(String, Value)>,
    device: Table,
    /// Values of every axis: of those that are drawn together, one line a draw.
    axes: Vec<Lines>,
}

/// Point of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Digest of all that decides its result, in hexadecimal.
    pub id: String,
    /// Fields that points differ in, and their values here.
    pub values: Vec<(String, Value)>,
    /// Scene's text; of measurements, the fields of training.
    pub scene: String,
    pub on_device: OnDevice,
    /// Fold of measured frames that its model is judged by, and not trained on.
    pub fold: Option<usize>,
    /// Options of the plan's scene, whatever the axes say, for which points find what they share.
    pub usual: Options,
    /// Digest of the scene's text, whatever is changed in it.
    pub digest: u64,
    /// Digest of all but training: points with the same one share their limit.
    pub shares: u64,
    /// Digests of what points share besides: frames, what training starts from, centres, layers, weights but for their
    /// penalty, and the model.
    pub keys: [u64; 6],
}

fn in_words(values: &[(String, Value)]) -> String {
    let values = values.iter().map(|(field, value)| format!("{field} = {value}"));
    values.collect::<Vec<_>>().join(", ")
}

impl Plan {
    /// Reads a plan for the program `build`. Scenes stand beside it. `load` makes measurements of its `[data]`, for options of
    /// training and a seed, which `[set]` gives.
    ///
    /// # Errors
    /// [`Error::Data`] for a file that cannot be read, and for its content.
    pub fn read(
        path: &Path,
        build: &str,
        load: &dyn Fn(&Table, &TrainingOptions, u64) -> Result<Measurements>,
    ) -> Result<Self> {
        let origin = path.display().to_string();
        let of_plan = |cause: String| {
            Error::from(taxel_data::Error::unfit(format!("plan {origin}: {cause}")))
        };
        let text = input::read_text(path)?;
        let file = PlanFile::parse(&text).map_err(&of_plan)?;
        let beside = |name: &String| {
            let beside = path.parent().map(|folder| folder.join(name));
            let is_beside = beside.as_ref().is_some_and(|file| file.is_file());
            if is_beside { beside.unwrap_or_default().display().to_string() } else { name.clone() }
        };
        let scenes = match (file.scene, &file.data) {
            (Some(_), Some(_)) => {
                return Err(of_plan("it has scene and data: leave one of them out".into()));
            }
            (None, Some(_)) => vec![],
            (None, None) => {
                return Err(of_plan(
                    "it has no scene: give one, such as scene = \"press\", or data".into(),
                ));
            }
            (Some(scenes), None) => scenes.all(),
        };
        if scenes.is_empty() && file.data.is_none() {
            return Err(of_plan("scene is an empty list: name at least one".into()));
        }
        if let Some((_, name)) =
            scenes.iter().enumerate().find(|(at, it)| scenes[..*at].contains(it))
        {
            return Err(of_plan(format!("scene {name} is given twice: give it once")));
        }
        let bases = scenes.iter().map(|name| {
            let built_in = crate::scenes::ALL.iter().any(|(known, _)| known == name);
            let file = if built_in { name.clone() } else { beside(name) };
            Base::of_scene(name, &file)
        });
        let mut bases: Vec<Base> = bases.collect::<Result<_>>()?;
        let data = match &file.data {
            None => None,
            Some(data) => {
                let set = super::point::set(&file.wanted.set).map_err(&of_plan)?;
                let mut data = load(data, &set.training, set.seed.unwrap_or(1))?;
                // The name is in the blob, and no result must depend on it.
                bases.push(Base::measured(&std::mem::replace(&mut data.name, "data".into())));
                Some(Arc::new(data))
            }
        };
        Self::new(&file.name, (bases, data), file.wanted, build)
            .map_err(|bad| of_plan(bad.to_string()))
    }

    /// Plan of these scenes, or of measurements: then there is one base, with their name and no fields.
    ///
    /// # Errors
    /// [`BadValue`] for a field that no scene has, and for a plan that asks for nothing, or too much.
    pub fn new(
        name: &str,
        (bases, data): (Vec<Base>, Option<Arc<Measurements>>),
        wanted: Wanted,
        build: &str,
    ) -> Checked<Self> {
        check_name(name)?;
        let allowed = (1..=MOST_POINTS).contains(&wanted.repeats);
        require(allowed, "repeats", wanted.repeats, || format!("give 1 to {MOST_POINTS}"))?;
        wanted.prices.iter().try_for_each(PartPrices::check)?;
        require(wanted.limit_frames != Some(1), "limit_frames", 1, || {
            "give at least 2, or 0 for no limit".into()
        })?;
        if let (Some(frames), Some(_)) = (wanted.limit_frames, &data) {
            let rule = "the limit of measurements is not known: leave it out";
            return Err(BadValue::new("limit_frames", frames, rule));
        }
        let axes = axes(&bases, &wanted)?;
        let mut plan = Self {
            name: name.into(),
            fields: axes.iter().flat_map(|(fields, _)| fields.clone()).collect(),
            objectives: wanted.objectives,
            bounds: wanted.bounds,
            prices: wanted.prices,
            data_digest: data.as_deref().map_or(0, digest_of),
            data,
            limit_frames: wanted.limit_frames,
            train: wanted.train,
            also: wanted.also,
            is_drawn: wanted.draw.is_some(),
            build: build.into(),
            bases,
            usual: BTreeMap::new(),
            set: fields::leaves(&wanted.set, &|_| false),
            device: wanted.device,
            axes,
        };
        let count =
            plan.axes.iter().try_fold(1_usize, |all, (_, lines)| all.checked_mul(lines.len()));
        let count = count.filter(|count| *count <= MOST_POINTS);
        require(count.is_some(), "axes", "all values crossed", || {
            format!("they are more than {MOST_POINTS} points; give fewer values, or draw some")
        })?;
        let is_axis = |field: &&String| plan.fields.contains(field);
        let is_first_seed = |field: &String| field == SEED && wanted.repeats > 1;
        let mut set = plan.set.iter().map(|(field, _)| field);
        if let Some(field) = set.find(|field| is_axis(field) && !is_first_seed(field)) {
            return Err(BadValue::new("set", field, "it is an axis as well; give it once"));
        }
        plan.check_fields()?;
        plan.check_table1()?;
        let usual = |base: &Base| Some((base.label.clone(), plan.usual_of(base)?));
        plan.usual = plan.bases.iter().filter_map(usual).collect();
        plan.choose_objectives()?;
        Ok(plan)
    }

    /// Checks the fields of the first point with every value of every axis in turn.
    fn check_fields(&self) -> Checked<()> {
        let check = |places: &[usize]| {
            let document = self.document_at(places)?;
            match self.check_scene(&text(&document.scene)?) {
                Ok(()) => {
                    self.fold(document.data)?;
                    OnDevice::new(document.device).map(drop)
                }
                Err(message) => {
                    Err(self.blamed(&document, &message, &|scene| self.check_scene(scene)))
                }
            }
        };
        let first = vec![0; self.axes.len()];
        check(&first)?;
        for (axis, (_, lines)) in self.axes.iter().enumerate() {
            for line in 1..lines.len().min(100) {
                let mut places = first.clone();
                places[axis] = line;
                check(&places)?;
            }
        }
        Ok(())
    }

    /// Checks that every scene has a Table 1, if it is wanted.
    fn check_table1(&self) -> Checked<()> {
        let is_axis = self.fields.iter().any(|field| field.starts_with("table1."));
        if !self.has(Also::Table1) || is_axis {
            return Ok(());
        }
        let rule = |what: &str| {
            BadValue::new("also", "table1", format!("{what} no [table1]: leave it out"))
        };
        if self.data.is_some() {
            return Err(rule("measurements have"));
        }
        for base in &self.bases {
            if !self.changed(Some(base), vec![])?.scene.contains_key("table1") {
                return Err(rule(&format!("{} has", base.label)));
            }
        }
        Ok(())
    }

    /// Checks that a scene has only fields that it may have, with values of their kinds; the reason is in serde's words.
    fn check_scene(&self, scene: &str) -> std::result::Result<(), String> {
        match &self.data {
            None => Experiment::check_fields(scene),
            Some(data) => super::point::measured(data, scene).map(drop),
        }
    }

    /// Checks that a scene's values hold as well, and options of training those for measurements.
    fn check_values(&self, scene: &str) -> std::result::Result<(), String> {
        let data = self.data.as_deref();
        let options = super::point::options(data, scene);
        let options = options.map_err(|why| why.to_string().replace("scene of the point: ", ""))?;
        let checked = data.map_or(Ok(()), |data| options.check(data.training.frames()));
        checked.map_err(|bad| bad.to_string())
    }

    /// Error for what is wrong with a point's fields, by who gave them: the scene, [set] or the axes; `check` tells it.
    fn blamed(
        &self,
        document: &Document,
        message: &str,
        check: &dyn Fn(&str) -> std::result::Result<(), String>,
    ) -> BadValue {
        let base = self.base_of(&document.values);
        let is_wrong = |scene: &Table| {
            text(scene).is_ok_and(|scene| check(&scene).is_err_and(|it| it == message))
        };
        let is_list = message.contains("invalid type: sequence");
        let (field, shown, advice) = match base {
            Some(base) if is_wrong(&base.document) => (
                "scene",
                base.label.clone(),
                "; `compare` takes a scene with lists, and in a plan they belong in [axes]",
            ),
            _ if self.changed(base, vec![]).is_ok_and(|it| is_wrong(&it.scene)) => {
                ("set", in_words(&self.set), "; several values belong in [axes]")
            }
            _ => ("axes", in_words(&document.values), ""),
        };
        BadValue::new(
            field,
            shown,
            fields::with_nearest(message) + if is_list { advice } else { "" },
        )
    }

    /// Groups of outputs that all scenes have, such as `dz_mm`; none where only some points of the plan can be.
    pub fn groups(&self) -> Vec<String> {
        let of = |names: Vec<String>| -> Vec<String> {
            columns::groups(&names).into_iter().map(|(group, _)| group.to_owned()).collect()
        };
        if let Some(data) = &self.data {
            return of(data.training.outputs.names.clone());
        }
        let names = (0..self.bases.len()).filter_map(|base| self.output_names(base));
        let common = |mut all: Vec<String>, more: Vec<String>| {
            all.retain(|group| more.contains(group));
            all
        };
        names.map(of).reduce(common).unwrap_or_default()
    }

    /// Outputs of the first point of a base, or, if its scene is impossible, of the base.
    fn output_names(&self, base: usize) -> Option<Vec<String>> {
        let parse = |table: &Table| Experiment::parse(&self.name, &text(table).ok()?).ok();
        let mut first = vec![0; self.axes.len()];
        // Several scenes are the first axis.
        if let (Some(of_scene), true) = (first.first_mut(), self.bases.len() > 1) {
            *of_scene = base;
        }
        let base = &self.bases[base];
        let [first, changed] = [self.document_at(&first), self.changed(Some(base), vec![])];
        let scenes = [first.ok()?.scene, changed.ok()?.scene];
        let scene = scenes.iter().chain([&base.document]).find_map(parse)?;
        Some(scene.world.output_names())
    }

    /// Checks objectives and bounds, and chooses objectives where none are given.
    fn choose_objectives(&mut self) -> Checked<()> {
        let groups = self.groups();
        if self.objectives.is_empty() {
            let error = if self.train { "rmse" } else { "limit" };
            let of_last = groups.last().map(|group| format!("{error}_{group}"));
            let time = if self.train { "frame_ms" } else { "scan_ms" };
            let of_last = of_last.filter(|name| not_computed(self, name).is_none());
            self.objectives = of_last.into_iter().chain([time.into()]).collect();
        }
        if groups.is_empty() {
            return Ok(());
        }
        let groups: Vec<&str> = groups.iter().map(String::as_str).collect();
        let known = columns_of(self, &groups);
        let known: Vec<&str> = known.iter().map(String::as_str).collect();
        let objectives = self.objectives.iter().map(|name| ("objectives", name));
        for (field, name) in objectives.chain(self.bounds.keys().map(|name| ("bounds", name))) {
            if let Some(why) = not_computed(self, name) {
                return Err(BadValue::new(field, name, why));
            }
            require_known(field, name, &known)?;
        }
        Ok(())
    }

    /// Whether the plan computes this besides.
    pub fn has(&self, also: Also) -> bool {
        self.also.contains(&also)
    }

    /// Group of outputs that the first objective is of.
    pub fn group(&self) -> Option<&str> {
        self.objectives.first().and_then(|name| group_in(name))
    }

    /// Point in words: its values, or the only scene.
    pub fn in_words(&self, point: &Point) -> String {
        match (point.values.is_empty(), self.bases.first()) {
            (true, Some(base)) => base.label.clone(),
            _ => in_words(&point.values),
        }
    }
}

/// Digest of all that decides what measurements give: of the frames and the options, whatever the file of the test frames is called.
fn digest_of(data: &Measurements) -> u64 {
    of_debug(&Measurements { test_choice: String::new(), ..data.clone() })
}

/// All axes: scenes, draws, seeds, and those that are crossed.
fn axes(bases: &[Base], wanted: &Wanted) -> Checked<Vec<Lines>> {
    let is_value = |value: &Value| value.get("from").is_some() || value.get("to").is_some();
    let of = |table: &Table| {
        let leaves = fields::leaves(table, &is_value).into_iter();
        leaves.map(|(field, value)| Axis::new(&field, value)).collect::<Checked<Vec<Axis>>>()
    };
    let single = |field: &str, values: Vec<Value>| {
        (vec![field.to_owned()], values.into_iter().map(|value| vec![value]).collect())
    };
    // What stands there would name points, and change none.
    let drawn = wanted.draw.as_ref().map(|draw| &draw.axes);
    for table in [&wanted.set, &wanted.axes].into_iter().chain(drawn) {
        require(!table.contains_key(SCENE), SCENE, "a field", || {
            "give scenes at the top of the plan, before its sections: scene = [\"a.toml\", \"b.toml\"]".into()
        })?;
    }
    let mut axes = Vec::new();
    if bases.len() > 1 {
        let labels = bases.iter().map(|base| Value::from(base.label.as_str())).collect();
        axes.push(single(SCENE, labels));
    }
    if let Some(draw) = &wanted.draw {
        let drawn = of(&draw.axes)?;
        require(!drawn.is_empty(), "draw.axes", "nothing", || "give at least one axis".into())?;
        let allowed = (1..=MOST_POINTS).contains(&draw.points);
        require(allowed, "draw.points", draw.points, || format!("give 1 to {MOST_POINTS}"))?;
        let lines = latin_hypercube(&drawn, draw.points, draw.seed);
        axes.push((drawn.into_iter().map(|axis| axis.field).collect(), lines));
    }
    if wanted.repeats > 1 {
        let seed = |table: &Table| table.get(SEED).and_then(Value::as_integer);
        let first = seed(&wanted.set).or_else(|| seed(&bases.first()?.document)).unwrap_or(1);
        let seeds = (first..).take(wanted.repeats).map(Value::Integer).collect();
        axes.push(single(SEED, seeds));
    }
    for axis in of(&wanted.axes)? {
        axes.push(single(&axis.field, axis.all()?));
    }
    let fields: Vec<&String> = axes.iter().flat_map(|(fields, _)| fields).collect();
    let twice = fields.iter().enumerate().find(|(at, field)| fields[..*at].contains(field));
    match twice {
        Some((_, field)) => Err(BadValue::new("axes", field, "it is an axis twice; give it once")),
        None => Ok(axes),
    }
}
