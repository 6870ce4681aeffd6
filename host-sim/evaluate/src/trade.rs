//! Trade between speed and accuracy: a [plan](crate::sweep) over the settings of a subject's decoder, and the choice of a
//! point by its errors and its cost.
//!
//! Errors are measured on test frames through the blob that a device would get. Instructions and cycles are predicted by
//! a formula of the firmware's own code ([`Cost`]), the time of a scan by the firmware's own plan ([`Device`]).

use taxel_core::rbf::Format;
use taxel_data::Silent;
use taxel_learn::cost::Cost;
use taxel_learn::decoders::{BASELINES, Baseline};
use taxel_learn::outliers::Outliers;
use taxel_simulate::noise::NoiseKind;
use taxel_simulate::path::Path;
use toml::{Table, Value};

use crate::device::Device;
use crate::error::{Error, Result};
use crate::metrics::{self, Blocks, DecoderErrors};
use crate::subject::Subject;
use crate::sweep::bounds::{self, Bound, Bounds, Values};
use crate::sweep::file::{Also, Wanted};
use crate::sweep::front;
use crate::sweep::judge::{self, Frames, KnownLimit};
use crate::sweep::{self, Merged, merge};
use crate::verdict::Verdict;

mod line;
mod point;

pub use line::Line;
pub use point::{FilterSettings, Point};

pub use crate::verdict::SLOT_BYTES;

/// Settings that a trade varies.
#[derive(Debug, Clone, PartialEq)]
pub struct Asked {
    /// Numbers of centres K of each network.
    pub centres: Vec<usize>,
    /// Numbers of samples averaged for each reading: white noise falls with the square root, noise with a memory hardly.
    pub samples_averaged: Vec<usize>,
    /// Steps from one column-wire that is read to the next: 1 reads all. Only scenes have others than 1.
    pub column_steps: Vec<usize>,
    pub device: Device,
    /// Group of outputs by whose errors front and choice are determined, or [`metrics::ALL`].
    pub group: String,
    /// Whether these count the largest error of the subject's own and other contacts.
    pub worst_case: bool,
    /// Largest blob on the front.
    pub most_bytes: usize,
}

impl Asked {
    /// What a sweep is asked for `subject`: its decoders, crossed with what is varied.
    pub fn wanted(&self, subject: &Subject) -> Wanted {
        let whole = |values: &[usize]| -> Value {
            let values =
                values.iter().map(|it| Value::Integer(i64::try_from(*it).unwrap_or(i64::MAX)));
            values.collect::<Vec<_>>().into()
        };
        let mut wanted = Wanted {
            objectives: vec![self.error(), "frame_ms".into()],
            also: vec![Also::Baselines],
            bounds: [("blob_bytes".into(), Bound::Most(self.most_bytes as f64))].into(),
            device: Table::try_from(self.device).unwrap_or_default(),
            ..Wanted::default()
        };
        let mut axis = |field: &str, values: Value| wanted.axes.insert(field.into(), values);
        // One network for each row, and one for the array of several rows; that alone where outputs belong to no row. Without
        // an affine tail, as in the paper, those that are asked for.
        let kinds = match subject.rows() {
            _ if !subject.options().affine_tail => vec![subject.options().each_row],
            1 => vec![false],
            _ => vec![true, false],
        };
        let formats = Format::ALL.iter().rev().map(|format| Value::from(format.name()));
        axis("training.format", formats.collect::<Vec<_>>().into());
        axis("training.each_row", kinds.into());
        axis("training.centres", whole(&self.centres));
        axis("device.samples", whole(&self.samples_averaged));
        axis("device.column_step", whole(&self.column_steps));
        if subject.moving_scene().is_some() {
            axis("device.filter", vec![false, true].into());
        }
        if subject.scene().is_some_and(|scene| !scene.others.is_empty()) {
            wanted.also.push(Also::OtherContacts);
        }
        wanted
    }

    /// Name of the result by which front and choice are determined.
    pub fn error(&self) -> String {
        error_of(&self.group, self.worst_case)
    }
}

fn error_of(group: &str, worst_case: bool) -> String {
    format!("{}_{group}", if worst_case { "worst_rmse" } else { "rmse" })
}

/// Trade of a subject: every point, and the one chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Trade {
    /// Name of the scene, or of the data.
    pub subject: String,
    /// Seed of every random draw.
    pub seed: u64,
    /// Kind of the noise that a scene adds; none for measured data, which has its own.
    pub noise_kind: Option<NoiseKind>,
    /// Level of that noise in one sample: a fraction, or in Ω for absolute noise.
    pub noise_level: f64,
    pub training_frames: usize,
    pub test_frames: usize,
    /// How test frames were chosen among measured ones, in words.
    pub test_choice: Option<String>,
    /// Path of the contacts that errors are of: newest finished estimates against the truth at that moment. `None` for still
    /// test frames.
    pub motion: Option<Path>,
    /// Outliers among measured frames; `None` for a scene.
    pub outliers: Option<Outliers>,
    pub device: Device,
    pub line: Line,
    /// Group of outputs by which front and choice are determined, or [`metrics::ALL`].
    pub group: String,
    pub unit: String,
    /// Whether these count the worst of the subject's own and other contacts.
    pub worst_case: bool,
    /// Every point that was judged.
    pub points: Vec<Point>,
    /// Points that cannot be trained, and why.
    pub left_out: Vec<String>,
    /// Bounds that [`Trade::choose`] was given.
    pub bounds: Bounds,
    /// Index of the point that [`Trade::choose`] picked.
    pub chosen: Option<usize>,
    /// Reason why no point was picked within bounds.
    pub refused: Option<String>,
    /// Results as those of any plan.
    pub merged: Merged,
}

/// Model of one point, trained once more, and what it is worth.
#[derive(Debug, Clone, PartialEq)]
pub struct Shown {
    pub point: usize,
    pub blob: Vec<u8>,
    pub verdict: Verdict,
    /// RMSE of the trade's group on other contacts, by their names.
    pub others: Vec<(String, f64)>,
    /// What is known of the least possible error, in a sentence.
    pub limit_note: String,
    /// Column-wires (from 1) as a scene's `[readout]` takes them; `None` if all are read.
    pub column_wires: Option<Vec<usize>>,
}

impl Trade {
    /// Trade of a `subject`, whose points are `merged`.
    ///
    /// # Errors
    /// [`Error`] if no point could be trained.
    pub fn new(subject: &Subject, asked: &Asked, merged: Merged) -> Result<Self> {
        let mut points: Vec<Point> = merged.points.iter().filter_map(Point::new).collect();
        // Settings are in the order of points, but for those that failed.
        for (point, setting) in points.iter_mut().zip(&merged.settings) {
            point.on_front = setting.on_front;
        }
        points.sort_by_key(Point::order);
        let left_out: Vec<String> = merged
            .failed()
            .map(|it| {
                format!(
                    "{}: {}",
                    merge::in_words(&it.values),
                    it.failed.clone().unwrap_or_default()
                )
            })
            .collect();
        if let (true, Some(cause)) = (points.is_empty(), left_out.first()) {
            return Err(Error::failed(format!("no way to decode can be trained: {cause}")));
        }
        let names = subject.output_names();
        Ok(Self {
            subject: subject.name().into(),
            seed: subject.origin().seed,
            noise_kind: subject.scene().map(|scene| scene.world.noise.kind),
            noise_level: match subject {
                Subject::Scene(scene) => scene.world.noise.total_level(),
                Subject::Measured(data) => data.noise_level().unwrap_or(0.0),
            },
            training_frames: subject.training_frames(),
            test_frames: subject.test_frames(),
            test_choice: subject.measurements().map(|data| data.test_choice.clone()),
            motion: subject.moving_scene().map(|(_, path)| path),
            outliers: subject.measurements().map(|data| data.outliers.clone()),
            device: asked.device,
            line: Line::new(subject.rows(), names.len()),
            group: asked.group.clone(),
            unit: metrics::unit_of_rmse(&asked.group).into(),
            worst_case: asked.worst_case,
            points,
            left_out,
            bounds: Bounds::new(),
            chosen: None,
            refused: None,
            merged,
        })
    }

    /// Picks the point within `bounds`, if any are given, among those that beat the baselines. A blob fits a slot
    /// ([`SLOT_BYTES`]) unless another bound is given.
    ///
    /// It is the cheapest one within the bound on the error; without such a bound, the cheapest of those that are as good as the
    /// one with the smallest error. The cheapest takes the least time for scan and decoding; among equals, the fewest cycles,
    /// then the least flash.
    ///
    /// # Errors
    /// The reason why there is none.
    pub fn choose(&mut self, bounds: &Bounds) -> std::result::Result<(), String> {
        self.bounds = bounds.clone();
        let chosen = self.choice();
        self.refused = chosen.as_ref().err().cloned();
        self.chosen = chosen.clone().unwrap_or_default();
        chosen.map(|_| ())
    }

    fn choice(&self) -> std::result::Result<Option<usize>, String> {
        if self.bounds.is_empty() {
            return Ok(None);
        }
        let mut bounds = self.bounds.clone();
        bounds.entry("blob_bytes".into()).or_insert(Bound::Most(SLOT_BYTES as f64));
        let within: Vec<usize> = (0..self.points.len())
            .filter(|i| bounds::are_within(&bounds, &self.points[*i].results))
            .collect();
        let Some(best) = self.best(&within) else {
            let results = self.points.iter().map(|point| &point.results);
            let none = bounds::none_within(&bounds, &results, |place| self.points[place].name());
            return Err(format!("no point is {}", none.unwrap_or_default()));
        };
        let Some((decoder, least)) = self.better_baseline(best) else { return Ok(Some(best)) };
        let kept: Vec<usize> =
            within.into_iter().filter(|i| self.better_baseline(*i).is_none()).collect();
        let beaten = || {
            format!(
                "no model within the bounds is worth its cost: the baseline {decoder} has an error of {least:.4} {}, \
                 which is smaller",
                format!("{} ({})", self.unit, self.group).trim_start()
            )
        };
        self.best(&kept).map(Some).ok_or_else(beaten)
    }

    /// The cheapest of some points, with a bound on the error, or else of those that are as good as the best.
    fn best(&self, among: &[usize]) -> Option<usize> {
        let key = |i: usize| {
            let Point { cycles, blob_bytes, times, .. } = &self.points[i];
            [times.frame_ms, *cycles as f64, *blob_bytes as f64, self.counted_rmse(i)]
        };
        let by_cost = |a: &&usize, b: &&usize| {
            let ordered = key(**a).into_iter().zip(key(**b)).map(|(a, b)| a.total_cmp(&b));
            ordered.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
        };
        if self.bounds.contains_key(&self.error()) {
            return among.iter().min_by(by_cost).copied();
        }
        front::best(&self.error(), among, |i| self.estimate(*i), by_cost).copied()
    }

    /// RMSE that a point is chosen by, with its blocks.
    fn estimate(&self, point: usize) -> (f64, &Blocks) {
        (self.counted_rmse(point), &self.points[point].blocks)
    }

    /// Name of the result by which front and choice are determined.
    pub fn error(&self) -> String {
        error_of(&self.group, self.worst_case)
    }

    /// RMSE of the group that a point is chosen by.
    pub fn counted_rmse(&self, point: usize) -> f64 {
        self.points[point].result(&self.error()).unwrap_or(f64::NAN)
    }

    /// Baseline with the least error of the group, and that error, if it is smaller than that of a point which decodes the
    /// same readings.
    pub fn better_baseline(&self, point: usize) -> Option<(&'static str, f64)> {
        let point = &self.points[point];
        let of = |it: &Baseline| {
            Some((it.name, point.result(&format!("{}_rmse_{}", it.name, self.group))?))
        };
        let least = BASELINES.iter().filter_map(of).min_by(|(_, a), (_, b)| a.total_cmp(b));
        least.filter(|(_, least)| *least < point.rmse(&self.group))
    }

    /// Errors of the group to compare points with that decode the same readings as this one, by name.
    pub fn references(&self, point: &Point) -> Vec<(&'static str, f64)> {
        let baselines = BASELINES.iter().rev();
        let baselines = baselines.map(|it| (it.in_words, format!("{}_rmse", it.name)));
        let references = baselines.chain([("least possible", "limit".to_owned())]);
        let of = |(name, result)| Some((name, point.result(&format!("{result}_{}", self.group))?));
        references.filter_map(of).collect()
    }

    /// First point of each choice of readings.
    pub fn readings(&self) -> Vec<&Point> {
        let mut readings: Vec<&Point> = vec![];
        for point in &self.points {
            if !readings.iter().any(|known| known.reads_like(point)) {
                readings.push(point);
            }
        }
        readings
    }

    /// Points of the front from fast to slow.
    pub fn front(&self) -> Vec<usize> {
        let mut front: Vec<usize> =
            (0..self.points.len()).filter(|i| self.points[*i].on_front).collect();
        let key = |i: usize| (self.points[i].times.frame_ms, self.counted_rmse(i));
        front.sort_by(|a, b| {
            let ((time_a, error_a), (time_b, error_b)) = (key(*a), key(*b));
            time_a.total_cmp(&time_b).then(error_b.total_cmp(&error_a))
        });
        front
    }

    /// Fastest point with the smallest error, or with one that test frames do not tell from it.
    pub fn most_accurate(&self) -> Option<usize> {
        let by_time = |a: &&usize, b: &&usize| {
            let [a, b] = [a, b].map(|i| self.points[**i].times.frame_ms);
            a.total_cmp(&b)
        };
        front::best(&self.error(), &self.front(), |i| self.estimate(*i), by_time).copied()
    }

    /// Fastest point of the front whose error is at most so many times the smallest.
    pub fn fastest_within(&self, factor: f64) -> Option<usize> {
        let least = self.counted_rmse(self.most_accurate()?);
        self.front().into_iter().find(|i| self.counted_rmse(*i) <= factor * least)
    }

    /// Point of the front that lies farthest below the line between its ends, in the logarithms of time and error; `None` where
    /// none does.
    pub fn knee(&self) -> Option<usize> {
        let front = self.front();
        let at = |i: usize| {
            let (ms, rmse) = (self.points[i].times.frame_ms, self.counted_rmse(i));
            [ms.ln(), rmse.ln()]
        };
        let ([x0, y0], [x1, y1]) = (at(*front.first()?), at(*front.last()?));
        let below = |i: usize| {
            let [x, y] = at(i);
            (y0 - y) / (y0 - y1) - (x - x0) / (x1 - x0)
        };
        let depths = front.into_iter().map(|i| (i, below(i))).filter(|(_, depth)| *depth > 0.0);
        depths.max_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(i, _)| i)
    }

    /// Model of the chosen point, or else of the most accurate one, and what it is worth. It is trained once more: points keep
    /// their results alone.
    ///
    /// # Errors
    /// As training.
    pub fn shown(
        &self,
        subject: &Subject,
        plan: &sweep::Plan,
        points: &[sweep::Point],
    ) -> Result<Option<Shown>> {
        let Some(shown) = self.chosen.or_else(|| self.most_accurate()) else { return Ok(None) };
        let id = &self.points[shown].id;
        let Some(point) = points.iter().find(|point| point.id == *id) else { return Ok(None) };
        let mut of_point = judge::subject_of(plan, point)?;
        // The blob tells what the file is called.
        if let (Subject::Measured(data), Subject::Measured(own)) = (&mut of_point, subject) {
            data.name.clone_from(&own.name);
        }
        let readings = judge::Readings::new(plan, point, &of_point, &mut KnownLimit::default())?;
        let frames = Frames::new(plan, &readings)?;
        let blob = frames.blob(plan, point)?;
        let judged = frames.judge(&blob, &frames.options(plan, point)?)?;
        let decoders: Vec<DecoderErrors> = frames.decoders(&judged, point.on_device.filter);
        let verdict = Verdict::new(&decoders, &readings.limit)
            .of_blob(&blob, self.training_frames)
            .of_frames(self.outliers.as_ref(), self.test_frames);
        let others = judged.others.iter();
        let others = others.filter_map(|it| Some((it.name.clone(), it.rmse(&self.group)?)));
        let sensor = of_point.scene().map(|scene| &scene.world.sensor);
        let chosen = sensor.filter(|sensor| sensor.read_columns.is_some());
        Ok(Some(Shown {
            point: shown,
            blob: blob.bytes().to_vec(),
            verdict,
            others: others.collect(),
            limit_note: readings.limit.note(),
            column_wires: chosen.map(|it| it.column_numbers().map(|wire| wire + 1).collect()),
        }))
    }

    /// What tells the readings of this point from those of others, such as `6 columns, 4 samples`; empty if nothing does.
    pub fn distinction(&self, of: &Point) -> String {
        let differ = |by: &dyn Fn(&Point) -> bool| self.points.iter().any(by);
        let columns = of.columns.filter(|_| differ(&|other| other.columns != of.columns));
        let samples = differ(&|other| other.samples_averaged != of.samples_averaged);
        let samples = samples.then_some(of.samples_averaged);
        point::in_words(columns, samples).trim_start_matches(", ").into()
    }

    /// What the board's line carries, and what helps if that is less than the frames a second that were asked for.
    pub fn line_note(&self) -> String {
        let Line { baud, estimate_bytes, estimates_per_s } = self.line;
        let carries = format!(
            "The board's serial line carries at most {estimates_per_s:.0} estimates a second: {estimate_bytes} bytes each, \
             at {baud} baud."
        );
        match self.bounds.get("frames_per_s") {
            Some(Bound::Least { least: asked }) if *asked > estimates_per_s => format!(
                "{carries} For {asked} a second decode fewer outputs (axes of a scene's [outputs], or --outputs '*_dz_mm' of a CSV file), or use the estimates on the device."
            ),
            _ => carries,
        }
    }
}

/// What stands in the way of bounds on time or error that no point can meet, by the time of its scan and its least possible
/// error, before anything is trained; `None` if nothing does.
///
/// # Errors
/// [`Error`] for a scene that does not hold.
pub fn impossible(
    plan: &sweep::Plan,
    points: &[sweep::Point],
    bounds: &Bounds,
    asked: &Asked,
) -> Result<Option<String>> {
    /// Standard errors by which an error must lie below the limit to be called impossible.
    const CERTAIN: f64 = 3.0;
    let mut known = bounds.clone();
    known.retain(|name, _| {
        *name == asked.error() || ["frame_ms", "frames_per_s"].contains(&name.as_str())
    });
    let mut plan = plan.clone();
    if !known.contains_key(&asked.error()) {
        plan.limit_frames = Some(0);
    }
    let (mut limits, mut best) = (KnownLimit::default(), vec![]);
    for of_readings in points.chunk_by(|a, b| a.shares == b.shares) {
        let point = &of_readings[0];
        let subject = judge::subject_of(&plan, point)?;
        if subject.moving_scene().is_some() {
            plan.limit_frames = Some(0); // It takes as long as training.
        }
        let readings = judge::Readings::new(&plan, point, &subject, &mut limits)?;
        let least = readings.limit.groups.iter().find(|limit| limit.group == asked.group);
        let rmse = least.map_or(0.0, |it| it.limit - CERTAIN * it.limit_standard_error);
        let nothing = Cost { instructions: 0, cycles: 0 };
        let times = point.on_device.device.times(readings.scan_ms, &nothing);
        best.push(Values::from([
            (asked.error(), rmse),
            ("frame_ms".into(), times.frame_ms),
            ("frames_per_s".into(), times.frames_per_s),
        ]));
    }
    let nearest = bounds::nearest(&known, best.iter());
    Ok(nearest.map(|(_, results)| {
        let bounds = bounds::in_words(&known);
        format!("no point can be within {bounds}; the nearest is {results}, even if decoding took no time; nothing was trained or written")
    }))
}

/// Computes all points in memory and makes a trade of them.
///
/// # Errors
/// [`Error`] if no point could be trained.
pub fn compute(
    subject: &Subject,
    asked: &Asked,
    (plan, points): (&sweep::Plan, &[sweep::Point]),
) -> Result<Trade> {
    let records = sweep::work::in_memory(plan, points, &Silent)?;
    Trade::new(subject, asked, Merged::new(plan, points, records))
}
