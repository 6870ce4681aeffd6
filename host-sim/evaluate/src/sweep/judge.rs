//! What points are worth: their scans, limits and models, and what these cost. What points share is computed once: the limit
//! of their readings, frames, what training starts from, centres, layers, weights in a number format but for their penalty,
//! and a model.

use std::borrow::Cow;
use std::panic::{AssertUnwindSafe, catch_unwind};

use taxel_core::filter::{Settings, Track};
use taxel_core::track::State;
use taxel_data::{Dataset, Silent, columns};
use taxel_learn::cost::{Cost, DecoderRam, Design};
use taxel_learn::decoders::BASELINES;
use taxel_learn::train::projection::features_at_most;
use taxel_learn::train::{Found, Kinds, Layers, Start, resolution};
use taxel_learn::{Decoder, ModelBlob, Options, PreparedModel};
use taxel_limit::{Reference, Refusal};
use taxel_simulate::{Synthesis, World};

use super::file::Also;
use super::judged::{Judged, OtherContact, rmse_of_groups};
use super::plan::{Plan, Point};
use super::point::{self, Results};
use crate::device::{Device, Wires};
use crate::error::Result;
use crate::evaluate::paper_networks::{self, Cell, Entry};
use crate::experiment::{Experiment, Table1};
use crate::metrics::{self, DecoderErrors, LimitSummary, Measure};
use crate::others::{self, OtherFrames};
use crate::subject::Subject;
use crate::touches::{Touches, Way};
use crate::training_set::TrainingSet;

/// Bytes of RAM that a filter in time takes for each output.
const FILTER_BYTES: usize = size_of::<Track>();

/// Results of a point, or the reason why there are none.
pub type Outcome = std::result::Result<Results, String>;

/// Result of a stage of the work that later stages share, or the reason why there is none.
type Stage<T> = std::result::Result<T, String>;

/// Computes the points in `group`, indices of `points` that [share](Point::shares) their limit, and hands the outcome of each
/// to `keep` as soon as it is there.
///
/// # Errors
/// [`Error`](crate::Error) if `keep` refuses an outcome.
pub fn compute(
    plan: &Plan,
    points: &[Point],
    group: &[usize],
    keep: &mut dyn FnMut(usize, Outcome) -> Result<()>,
) -> Result<()> {
    let mut limits = KnownLimit::default();
    let mut order = group.to_vec();
    order.sort_by_key(|index| (points[*index].keys, *index));
    let same = |depth: usize| {
        move |a: &usize, b: &usize| points[*a].keys[..=depth] == points[*b].keys[..=depth]
    };
    for of_frames in order.chunk_by(same(0)) {
        let first = &points[of_frames[0]];
        let subject = caught(|| subject_of(plan, first));
        let readings = after(&subject, |subject| Readings::new(plan, first, subject, &mut limits));
        if !plan.train {
            let outcome = readings.as_ref().map(|it| it.results.clone()).map_err(Clone::clone);
            of_frames.iter().try_for_each(|index| keep(*index, outcome.clone()))?;
            continue;
        }
        let frames = after(&readings, |readings| Frames::new(plan, readings));
        let mut members = vec![];
        for index in of_frames {
            let point = &points[*index];
            match after(&frames, |frames| frames.options(plan, point)) {
                Ok(options) => members.push(Member { index: *index, point, options }),
                Err(why) => keep(*index, Err(why))?,
            }
        }
        if let Ok(frames) = &frames {
            train_each(frames, &members, keep)?;
        }
    }
    Ok(())
}

/// Point whose model is trained, and the options for it.
struct Member<'p> {
    index: usize,
    point: &'p Point,
    options: Options,
}

/// Trains and judges the models of all `members`, in the order of their keys.
fn train_each(
    frames: &Frames<'_>,
    members: &[Member<'_>],
    keep: &mut dyn FnMut(usize, Outcome) -> Result<()>,
) -> Result<()> {
    let same = |depth: usize| {
        move |a: &Member<'_>, b: &Member<'_>| a.point.keys[..=depth] == b.point.keys[..=depth]
    };
    for of_starts in members.chunk_by(same(1)) {
        let first = &of_starts[0];
        let starts = caught(|| Starts::new(frames, first.point, &first.options));
        for of_centres in of_starts.chunk_by(same(2)) {
            let options = &of_centres[0].options;
            let centred = after(&starts, |starts| Ok(starts.centred(options)));
            for of_layers in of_centres.chunk_by(same(3)) {
                let first = &of_layers[0];
                let mut penalties = vec![];
                for Member { options, .. } in of_layers {
                    if !penalties.contains(&options.penalty) {
                        penalties.push(options.penalty);
                    }
                }
                let found = after(&centred, |centred| {
                    let (format, own) = (first.point.usual.format, first.options);
                    centred.found(&Options { format, ..own }, &penalties)
                });
                for of_weights in of_layers.chunk_by(same(4)) {
                    let Options { format, or_f32, .. } = of_weights[0].options;
                    let trained = after(&found, |found| Ok(found.fit(format, or_f32, &Silent)));
                    for of_model in of_weights.chunk_by(same(5)) {
                        let options = &of_model[0].options;
                        let place = penalties.iter().position(|it| *it == options.penalty);
                        let model = after(&trained, |trained| {
                            let trained = trained[place.unwrap_or(0)].as_ref();
                            let trained =
                                trained.map_err(|why| crate::Error::failed(why.to_string()))?;
                            let starts = starts.as_ref().map_err(crate::Error::failed)?;
                            let chosen = starts.chosen(options);
                            let blob = frames.set.packed_to_judge(trained, &chosen)?;
                            frames.judge(&blob, options)
                        });
                        for Member { index, point, .. } in of_model {
                            let results =
                                |model: &Judged| Ok(model.results(point.on_device.filter));
                            keep(*index, after(&model, results))?;
                        }
                    }
                }
            }
        }
    }
    Ok(())
}

/// What `next` makes of the result of the stage `before`.
fn after<'t, T, U>(before: &'t Stage<T>, next: impl FnOnce(&'t T) -> Result<U>) -> Stage<U> {
    before.as_ref().map_err(Clone::clone).and_then(|before| caught(|| next(before)))
}

/// Result of a stage; a panic is a failure of its points, and not of all others.
fn caught<T>(stage: impl FnOnce() -> Result<T>) -> Stage<T> {
    match catch_unwind(AssertUnwindSafe(stage)) {
        Ok(outcome) => outcome.map_err(|error| error.to_string()),
        Err(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
            Err(format!("an error in the program: {text}"))
        }
    }
}

/// Subject of a point, whose readings are averaged as its device does.
pub fn subject_of(plan: &Plan, point: &Point) -> Result<Subject> {
    plan.check_readings(point)?;
    if let Some(data) = &plan.data {
        let data = point::measured(data, &point.scene).map_err(taxel_data::Error::unfit)?;
        let data = match point.fold {
            Some(fold) => data.without_fold(fold),
            None => data,
        };
        return Ok(Subject::Measured(Box::new(data)));
    }
    let scene = Subject::Scene(Box::new(Experiment::parse("of the point", &point.scene)?));
    let mut subject = scene.with_every_column(point.on_device.column_step).into_owned();
    if let Subject::Scene(scene) = &mut subject {
        let wires = Some(Wires::of(&scene.world));
        scene.digest = point.digest;
        scene.world.noise =
            point.on_device.device.averaged(scene.world.noise, wires, point.on_device.samples);
    }
    Ok(subject)
}

/// Limit that was computed last: points share it that differ only in their training.
#[derive(Default)]
pub struct KnownLimit(Option<(World, usize, std::result::Result<Reference, Refusal>)>);

impl KnownLimit {
    /// Limit on the first `frames` test frames of a world, or of its contacts that move as `moving` computes it.
    fn of(
        &mut self,
        (world, frames): (&World, usize),
        moving: impl FnOnce() -> std::result::Result<Reference, Refusal>,
    ) -> std::result::Result<Reference, Refusal> {
        match &self.0 {
            Some((known, of, limit)) if known == world && *of == frames => limit.clone(),
            _ => {
                let limit = match world.path {
                    Some(_) => moving(),
                    None => Reference::new(world, frames, &Silent),
                };
                self.0 = Some((world.clone(), frames, limit.clone()));
                limit
            }
        }
    }
}

/// Readings that points decode: when they are taken, and what any decoder of them can do at best.
pub struct Readings<'s> {
    subject: &'s Subject,
    device: Device,
    samples: usize,
    /// Whether frames to judge by are a fold that is held out.
    of_fold: bool,
    pub scan_ms: Option<f64>,
    measure: Measure,
    pub limit: LimitSummary,
    results: Results,
}

impl<'s> Readings<'s> {
    /// Readings of a point's `subject`.
    pub fn new(
        plan: &Plan,
        point: &Point,
        subject: &'s Subject,
        limits: &mut KnownLimit,
    ) -> Result<Self> {
        let mut results = Results::default();
        let (wires, mut measure) = match subject {
            Subject::Scene(scene) => (Some(Wires::of(&scene.world)), scene.measure()),
            Subject::Measured(data) => (Wires::named(&data.training.inputs.names), data.measure()),
        };
        let scan_ms = point.on_device.device.scan_ms(wires, point.on_device.samples);
        results.add("rows", wires.map(|wires| wires.rows as f64));
        results.add("columns", wires.map(|wires| wires.columns as f64));
        results.add("scan_ms", scan_ms);
        let mut limit = LimitSummary::new(&Err(Refusal::Measured));
        if let Subject::Scene(scene) = subject {
            let [x_mm, y_mm, _] = scene.world.sensor.size_mm;
            results.add("area_cm2", Some(x_mm * y_mm / 100.0));
            let frames = plan
                .limit_frames
                .unwrap_or_else(|| Reference::few_frames(&scene.world).min(scene.test_frames));
            if frames > 0 {
                let found = limits.of((&scene.world, frames), || {
                    let (scene, path) = subject.moving_scene().ok_or(Refusal::Moving)?;
                    let passes = point.on_device.device.passes(point.on_device.samples);
                    let synthesis = Synthesis::new(&scene.world);
                    let touches = Touches::new(scene, synthesis, (path, passes), metrics::ALL);
                    touches.limit(scan_ms, plan.limit_frames)
                });
                limit = LimitSummary::new(&found);
                match found {
                    Ok(found) => measure.limit = Some(found),
                    Err(refusal) => results.notes.push(format!("no limit: {refusal}")),
                }
            }
        }
        for limit in measure.limit.iter().flat_map(Reference::limits) {
            let [name, error] = ["limit", "limit_standard_error"];
            results.add(&format!("{name}_{}", limit.group), Some(limit.limit));
            results.add(&format!("{error}_{}", limit.group), Some(limit.limit_standard_error));
        }
        let (device, samples, of_fold) =
            (point.on_device.device, point.on_device.samples, point.fold.is_some());
        Ok(Self { subject, device, samples, of_fold, scan_ms, measure, limit, results })
    }

    /// Test frames of contacts that move, for filters that are set for the errors of `group`.
    fn touches(&self, group: &str) -> Option<Touches<'s>> {
        let (scene, path) = self.subject.moving_scene()?;
        let passes = self.device.passes(self.samples);
        Some(Touches::new(scene, Synthesis::new(&scene.world), (path, passes), group))
    }
}

/// Frames that models are trained on and judged by.
pub struct Frames<'s> {
    readings: &'s Readings<'s>,
    set: TrainingSet<'s>,
    test: Cow<'s, Dataset>,
    touches: Option<Touches<'s>>,
    others: OtherFrames,
    /// Errors of the baselines, if the plan wants them.
    baselines: Vec<DecoderErrors>,
    /// Settings of Table 1 and the baselines in it, if the plan wants it.
    table: Option<(Table1, Vec<Entry>)>,
}

impl<'s> Frames<'s> {
    /// Frames of these `readings`.
    pub fn new(plan: &Plan, readings: &'s Readings<'s>) -> Result<Self> {
        let (set, test) = readings.subject.sets();
        set.check()?;
        let names = &set.frames.outputs.names;
        let last = columns::groups(names).last().map_or("", |(group, _)| *group).to_owned();
        let group = plan.group().map_or(last, str::to_owned);
        let touches = readings.touches(&group);
        let others =
            if plan.has(Also::OtherContacts) { others::frames(readings.subject) } else { vec![] };
        let baselines = vec![];
        let mut frames = Self { readings, set, test, touches, others, baselines, table: None };
        if plan.has(Also::Baselines) {
            frames.baselines = frames.baselines()?;
        }
        let table1 = readings.subject.scene().and_then(|scene| scene.table1.clone());
        frames.table = table1.filter(|_| plan.has(Also::Table1)).map(|settings| {
            let fitted = BASELINES.iter().filter_map(|it| it.fit(&frames.set.frames));
            (settings, fitted.map(|it| frames.entry(it.as_ref(), None)).collect())
        });
        Ok(frames)
    }

    /// Errors of a decoder in Table 1.
    fn entry(&self, decoder: &dyn Decoder, spread: Option<f64>) -> Entry {
        let estimates = decoder.decode_all(&self.test.inputs.values, 1).values;
        Entry::new((decoder.name(), spread), &estimates, &self.test, &self.readings.measure)
    }

    /// Cell of Table 1 with the `estimates` of a network that was trained with `options`, if the plan wants it.
    fn cell(&self, estimates: &[f64], options: &Options) -> Option<Cell> {
        let (settings, baselines) = self.table.as_ref()?;
        let Options { seed, spread, .. } = *options;
        let others = paper_networks::fit(settings, seed, spread, &self.set.frames);
        let others = others.iter().map(|decoder| self.entry(decoder.as_ref(), Some(spread)));
        let name = (metrics::NETWORK, Some(spread));
        let network = Entry::new(name, estimates, &self.test, &self.readings.measure);
        let entries = baselines.iter().cloned().chain([network]).chain(others).collect();
        Some(Cell { entries, limit: self.readings.limit.clone() })
    }

    /// Errors of the baselines. On contacts that move, decoding takes them no time.
    fn baselines(&self) -> Result<Vec<DecoderErrors>> {
        let measure = &self.readings.measure;
        let fitted = BASELINES.iter().filter_map(|baseline| baseline.fit(&self.set.frames));
        let judged = fitted.map(|decoder| match &self.touches {
            Some(touches) => {
                touches.judge_at_once(decoder.as_ref(), self.readings.scan_ms, measure)
            }
            None => Ok(metrics::judge(decoder.as_ref(), &self.test, measure)),
        });
        judged.collect()
    }

    /// Options for training a point's model on these frames. Fewer columns give fewer features.
    ///
    /// # Errors
    /// [`Error`](crate::Error) for options that do not fit the frames.
    pub fn options(&self, plan: &Plan, point: &Point) -> Result<Options> {
        let mut options = point::options(plan.data.as_deref(), &point.scene)?;
        if point.on_device.column_step > 1 {
            let possible = |wanted| features_at_most(&self.set.frames, wanted).max(1);
            options.features = options.features.map(possible);
        }
        if self.table.is_some() {
            options.search = paper_networks::search();
        }
        options.check_for(&self.set.frames)?;
        Ok(options)
    }

    /// Blob of a point's model.
    ///
    /// # Errors
    /// As training.
    pub fn blob(&self, plan: &Plan, point: &Point) -> Result<ModelBlob> {
        let options = self.options(plan, point)?;
        let starts = Starts::new(self, point, &options)?;
        let centred = starts.centred(&options);
        let of_usual = Options { format: point.usual.format, ..options };
        let found = centred.found(&of_usual, &[options.penalty])?;
        let trained = found.fit(options.format, options.or_f32, &Silent).remove(0)?;
        self.set.packed(&trained, &starts.chosen(&options), &Silent)
    }

    /// Errors and cost of a model that was trained with `options`.
    pub fn judge(&self, blob: &ModelBlob, options: &Options) -> Result<Judged> {
        let Readings { measure, device, scan_ms, .. } = self.readings;
        let model = blob.prepare().of_inputs();
        let design = Design::new(blob);
        let cost = Cost::of_frame(&design);
        let decoded = || model.decode_lines(&self.test.inputs.values);
        let mut before = self.readings.results.clone();
        let ways = match &self.touches {
            None => {
                let estimates = decoded();
                before.cell = self.cell(&estimates, options);
                if self.readings.of_fold {
                    let outputs = &self.test.outputs;
                    before.squares =
                        outputs.squared_errors(&outputs.with_places(estimates.as_slice()));
                }
                let (errors, blocks) =
                    metrics::with_blocks(&self.test.outputs, &estimates, measure);
                let (filter, times) = (Settings::default(), device.times(*scan_ms, &cost));
                vec![Way { filter, is_tracked: false, cost, times, errors, blocks }]
            }
            Some(touches) => {
                before.cell = self.table.as_ref().and_then(|_| self.cell(&decoded(), options));
                touches.judge((blob, &model), cost, (device, *scan_ms), measure)?.ways
            }
        };
        for decoder in &self.baselines {
            for (group, rmse) in rmse_of_groups(&decoder.errors) {
                before.add(&format!("{}_rmse_{group}", decoder.decoder), Some(rmse));
            }
        }
        let centres = design.networks.iter().map(|network| network.shape.centres).max();
        before.add("centres", centres.map(|centres| centres as f64));
        before.add("spread", Some(blob.spread()));
        before.add("blob_bytes", Some(blob.bytes().len() as f64));
        let filter_bytes = match blob.parse().tracker() {
            Some(_) => size_of::<State>(),
            None => FILTER_BYTES * self.test.outputs.names.len(),
        };
        Ok(Judged {
            others: self.others(&model),
            ram_bytes: [0, filter_bytes].map(|bytes| DecoderRam::new(&design).bytes() + bytes),
            before,
            ways,
        })
    }

    /// What a `model` makes of other contacts.
    fn others(&self, model: &PreparedModel<'_>) -> Vec<OtherContact> {
        let measure = Measure { limit: None, ..self.readings.measure.clone() };
        let of = |(name, frames): &(String, Dataset)| {
            let estimates = model.decode_lines(&frames.inputs.values);
            let (errors, blocks) = metrics::with_blocks(&frames.outputs, &estimates, &measure);
            OtherContact { name: name.clone(), rmse: rmse_of_groups(&errors), blocks }
        };
        self.others.iter().map(of).collect()
    }

    /// Errors of the `model` of a still subject, and of the baselines.
    pub fn decoders(&self, judged: &Judged, filter: bool) -> Vec<DecoderErrors> {
        let Way { errors, blocks, .. } = judged.way(filter);
        let network = DecoderErrors::new(metrics::NETWORK, errors.clone());
        let network = DecoderErrors { blocks: blocks.clone(), ..network };
        std::iter::once(network).chain(self.baselines.iter().cloned()).collect()
    }
}

/// What training starts from, for points that differ in their centres, spreads, penalties and formats alone.
pub struct Starts<'s> {
    set: &'s TrainingSet<'s>,
    /// Features that are chosen.
    kinds: Option<Kinds>,
    all: Vec<Start>,
}

impl<'s> Starts<'s> {
    /// Starts for training a point's model on these `frames`. Features are chosen for the network of the plan's scene.
    pub fn new(frames: &'s Frames<'s>, point: &Point, options: &Options) -> Result<Self> {
        let Options { centres, spread, penalty, .. } = point.usual.for_each_row(options.each_row);
        let mut options = Options { centres, spread, penalty, ..*options };
        let set = &frames.set;
        resolution::check(&set.frames)?;
        let _ = set.choose(&mut options, &Silent);
        Ok(Self { set, kinds: options.kinds, all: Start::all(&set.frames, &options)? })
    }

    /// These `options` with the features that are chosen.
    fn chosen(&self, options: &Options) -> Options {
        Options { kinds: self.kinds, ..*options }
    }

    /// Starts with K-means centres for `options`, whatever their spread.
    pub fn centred(&self, options: &Options) -> Centred<'_> {
        Centred { starts: self, layers: self.all.iter().map(|it| it.layers(options)).collect() }
    }
}

/// K-means centres, for points that differ in their spreads, penalties and formats alone.
pub struct Centred<'s> {
    starts: &'s Starts<'s>,
    layers: Vec<Layers>,
}

impl Centred<'_> {
    /// Layers for `options`, to which weights will be fitted with each of `penalties`.
    pub fn found(&self, options: &Options, penalties: &[Option<f64>]) -> Result<Found<'_>> {
        let Starts { set, all, .. } = self.starts;
        let options = self.starts.chosen(options);
        set.found(all, self.layers.clone(), &options, penalties, &Silent)
    }
}
