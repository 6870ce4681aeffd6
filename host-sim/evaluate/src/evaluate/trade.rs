//! Trade between speed and accuracy: every setting of a subject's decoder, its errors and its cost.
//!
//! Errors are measured on test frames through the blob that a device would get. Instructions and cycles are predicted by
//! a formula of the firmware's own code ([`Cost`](taxel_learn::cost::Cost)), the time of a scan by the firmware's own plan ([`Device`]).

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde::Serialize;
use taxel_data::BadValue;
use taxel_data::progress::Progress;
use taxel_learn::outliers::Outliers;
use taxel_learn::{ModelBlob, Options};
use taxel_limit::Refusal;
use taxel_simulate::noise::NoiseKind;
use taxel_simulate::path::Path;

use crate::error::{Error, NoPoint, Result};
use crate::metrics::{self, DecoderErrors, LimitSummary, Measure};
use crate::subject::Subject;
use crate::verdict::{Verdict, Warning};

mod progress;
mod device;
mod line;
mod choice;
mod point;
mod touches;
mod worst;
mod frames;
mod readings;
mod ways;
mod judge;

pub use choice::Bounds;
use choice::{Offer, SAME_ERROR};
pub use device::{BOARD_CLOCK_MHZ, Device, Readout, Times, Wires};
use frames::Frames;
use judge::Judged;
pub use line::Line;
pub use point::{FilterSettings, Point};
pub use readings::Readings;
pub(super) use touches::{Touched, Touches, Way};
use ways::Ways;
pub use worst::OtherError;

pub use crate::verdict::SLOT_BYTES;

/// Standard errors by which an error must lie below the limit to be called impossible.
const CERTAIN: f64 = 3.0;

/// Settings that a trade varies.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Numbers of centres K of each network.
    pub centres: Vec<usize>,
    /// Numbers of samples averaged for each reading: white noise falls with the square root, noise with a memory hardly.
    pub samples_averaged: Vec<usize>,
    /// Steps from one column-wire that is read to the next: 1 reads all. Only scenes have others than 1.
    pub column_steps: Vec<usize>,
    pub device: Device,
    /// Whether front and choice count the largest error of the subject's own and [other](OtherError) contacts.
    pub worst_case: bool,
}

/// Trade of a subject: every point, and the one chosen.
#[derive(Debug, Clone, PartialEq, Serialize)]
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
    /// Readings that points decode, for each choice of columns and number of samples.
    pub readings: Vec<Readings>,
    /// Every point that was judged.
    pub points: Vec<Point>,
    /// Formats that cannot hold a network of some settings, and why.
    pub left_out: Vec<String>,
    /// Bounds that [`Trade::choose`] was given.
    pub bounds: Bounds,
    /// Index of the point that [`Trade::choose`] picked.
    pub chosen: Option<usize>,
    /// What that point is worth.
    pub verdict: Option<Verdict>,
    /// Reason why no point was picked within bounds.
    #[serde(skip)]
    pub refused: Option<NoPoint>,
    /// Index of every point's blob: points that differ only in the filter share one.
    #[serde(skip)]
    blobs: Vec<usize>,
    #[serde(skip)]
    distinct_blobs: Vec<Vec<u8>>,
}

impl Trade {
    /// Picks the point within `bounds`, if any are given, among those that beat the baselines.
    pub fn choose(&mut self, bounds: &Bounds) -> std::result::Result<(), NoPoint> {
        self.bounds = *bounds;
        let chosen = self.choice(bounds);
        self.refused = chosen.as_ref().err().cloned();
        self.chosen = chosen.clone().unwrap_or_default();
        self.verdict = self.chosen.map(|point| self.verdict_on(point));
        chosen.map(|_| ())
    }

    fn choice(&self, bounds: &Bounds) -> std::result::Result<Option<usize>, NoPoint> {
        let unit = named(&self.unit, &self.group);
        let choose = |among: &[usize]| {
            let offer = |i: &usize| self.points[*i].offer(&self.group, self.worst_case);
            let offers: Vec<Offer> = among.iter().map(offer).collect();
            Ok(bounds.choose(&offers, &unit)?.map(|place| among[place]))
        };
        let all: Vec<usize> = (0..self.points.len()).collect();
        let Some(best) = choose(&all)? else { return Ok(None) };
        let Some((decoder, least)) = self.better_baseline(best) else { return Ok(Some(best)) };
        let kept: Vec<usize> =
            all.into_iter().filter(|i| self.better_baseline(*i).is_none()).collect();
        let decoder = decoder.into();
        choose(&kept).map_err(|_| NoPoint::Beaten { decoder, least, unit: unit.clone() })
    }

    /// Baseline with the least error of the group, and that error, if it is smaller than that of a point which decodes the
    /// same readings.
    ///
    /// # Panics
    /// If there is no such point.
    pub fn better_baseline(&self, point: usize) -> Option<(&str, f64)> {
        let point = &self.points[point];
        let of = |it: &DecoderErrors| metrics::rmse_of(&it.errors, &self.group);
        let decoders = self.readings[point.readings].decoders.iter();
        let least = decoders
            .filter_map(|it| Some((it.decoder.as_str(), of(it)?)))
            .min_by(|(_, a), (_, b)| a.total_cmp(b));
        least.filter(|(_, least)| *least < point.rmse(&self.group))
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

    /// RMSE of the group that a point is chosen by.
    fn counted_rmse(&self, point: usize) -> f64 {
        self.points[point].counted_rmse(&self.group, self.worst_case)
    }

    /// Fastest point with the smallest error, or one so near to it that it counts as equal.
    pub fn most_accurate(&self) -> Option<usize> {
        let rmse = |i: &usize| self.counted_rmse(*i);
        let front = self.front();
        let least = front.iter().map(rmse).fold(f64::INFINITY, f64::min);
        front.into_iter().find(|i| rmse(i) <= SAME_ERROR * least)
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

    /// Verdict on a point by the errors of all groups, with what its blob gives reason to beware of.
    ///
    /// # Panics
    /// If there is no such point.
    pub fn verdict_on(&self, point: usize) -> Verdict {
        let Point { errors, readings, .. } = &self.points[point];
        let Readings { decoders, limit, .. } = &self.readings[*readings];
        let network = DecoderErrors::new(metrics::NETWORK, errors.clone());
        let all: Vec<_> = std::iter::once(network).chain(decoders.iter().cloned()).collect();
        let verdict = Verdict::new(&all, limit);
        match ModelBlob::of_bytes(self.blob(point)) {
            Ok(blob) => verdict
                .with(Warning::other_image(&blob.parse()))
                .of_blob(&blob, self.training_frames),
            Err(_) => verdict,
        }
        .of_frames(self.outliers.as_ref(), self.test_frames)
    }

    /// Readings of the chosen point; if none is chosen, of the first.
    ///
    /// # Panics
    /// If there are no readings.
    pub fn main_readings(&self) -> &Readings {
        &self.readings[self.chosen.map_or(0, |point| self.points[point].readings)]
    }

    /// What tells these readings from the others of the trade, such as `6 columns, 4 samples`; empty if nothing does.
    pub fn distinction(&self, readings: &Readings) -> String {
        let Readings { wires, samples_averaged, .. } = readings;
        let differ = |by: &dyn Fn(&Readings) -> bool| self.readings.iter().any(by);
        let columns = readings.columns().filter(|_| differ(&|other| other.wires != *wires));
        let samples = differ(&|other| other.samples_averaged != *samples_averaged);
        let samples = samples.then_some(*samples_averaged);
        readings::in_words(columns, samples).trim_start_matches(", ").into()
    }

    /// What the board's line carries, and what helps if that is less than the frames a second that were asked for.
    pub fn line_note(&self) -> String {
        let Line { baud, estimate_bytes, estimates_per_s } = self.line;
        let carries = format!(
            "The board's serial line carries at most {estimates_per_s:.0} estimates a second: {estimate_bytes} bytes each, \
             at {baud} baud."
        );
        match self.bounds.frame_rate_hz {
            Some(asked) if asked > estimates_per_s => format!(
                "{carries} For {asked} a second decode fewer outputs (axes of a scene's [outputs], or --outputs '*_dz_mm' of a CSV file), or use the estimates on the device."
            ),
            _ => carries,
        }
    }

    /// Groups of outputs, with their units.
    pub fn groups(&self) -> impl Iterator<Item = (&str, &str)> {
        let errors = self.points.first().map_or(&[][..], |point| &point.errors);
        errors.iter().map(|errors| (errors.group.as_str(), errors.unit.as_str()))
    }

    /// Blob of a point.
    pub fn blob(&self, point: usize) -> &[u8] {
        &self.distinct_blobs[self.blobs[point]]
    }
}

/// Trains and judges every point of `plan` for the subject. The front is determined by the RMSE of `group` and the time of
/// a frame.
///
/// # Errors
/// [`Error`] for a plan that cannot be carried out, or a subject that cannot be trained; [`Error::NoPoint`] for `bounds`
/// that nothing can meet, before anything is trained.
///
/// # Panics
/// If the plan has no steps of columns or no numbers of samples.
pub fn compute(
    subject: &Subject,
    plan: &Plan,
    group: &str,
    bounds: &Bounds,
    progress: &dyn Progress,
) -> Result<Trade> {
    check(subject, plan)?;
    let subjects: Vec<Cow<'_, Subject>> =
        plan.column_steps.iter().map(|step| subject.with_every_column(*step)).collect();
    progress.stage("prepare frames", subjects.len() * plan.samples_averaged.len());
    let each = subjects.iter().flat_map(|of| plan.samples_averaged.iter().map(move |n| (of, *n)));
    let synthesised = each.clone().map(|(subject, samples)| {
        let frames = Frames::new(subject, samples, plan, group);
        progress.step();
        frames
    });
    let frames: Vec<Frames<'_>> = synthesised.collect::<Result<_>>()?;
    let ways: Vec<Vec<Ways<'_>>> =
        frames.iter().map(|frames| Ways::all(frames, plan).collect()).collect();
    // What nothing can meet is refused at once: costs first, then errors, since the limit takes some seconds.
    let unit = metrics::unit_of_rmse(group);
    let mut offers = Vec::new();
    for (place, ways) in ways.iter().enumerate() {
        for ways in ways {
            let of_ways = ways.offers(&plan.device);
            offers.extend(of_ways.into_iter().map(|offer| (place, offer)));
        }
    }
    let possible = |least_errors: &[f64]| {
        let offers =
            offers.iter().map(|&(place, offer)| Offer { rmse: least_errors[place], ..offer });
        bounds.check_possible(&offers.collect::<Vec<_>>(), &named(unit, group))
    };
    possible(&vec![0.0; frames.len()])?;
    let measures: Vec<(Measure, LimitSummary)> = each
        .clone()
        .zip(&frames)
        .map(|((subject, _), frames)| match subject.moving_scene() {
            Some((scene, _)) => (scene.measure(), LimitSummary::new(&Err(Refusal::Moving))),
            None => subject.measure(frames.noise, progress),
        })
        .collect();
    let least = |limit| least_error(limit, group).map_or(0.0, |[limit, se]| limit - CERTAIN * se);
    possible(&measures.iter().map(|(_, limit)| least(limit)).collect::<Vec<_>>())?;

    progress.stage("train and measure", ways.iter().flatten().map(judge::steps).sum());
    let mut judged = Judged::default();
    for (place, (ways, (measure, _))) in ways.iter().zip(&measures).enumerate() {
        for ways in ways {
            judged.add(ways, (place, measure), &plan.device, progress)?;
        }
    }
    let Judged { mut points, left_out, blobs, distinct } = judged;
    if let (true, Some(cause)) = (points.is_empty(), left_out.first()) {
        return Err(Error::failed(format!("no way to decode can be trained: {cause}")));
    }
    compare(&mut points, group, plan.worst_case);
    let outputs = &frames[0].training().outputs.names;
    let line = Line::new(frames[0].training().rows, outputs.len());
    let of_frames = each.zip(&frames).zip(measures);
    let readings = of_frames.map(|(((subject, _), frames), (measure, limit))| {
        Readings::new(subject, frames, (&measure, limit))
    });
    let readings = readings.collect::<std::result::Result<_, _>>()?;
    Ok(Trade {
        subject: subject.name().into(),
        seed: subject.origin().seed,
        noise_kind: subject.scene().map(|scene| scene.world.noise.kind),
        noise_level: match subject {
            Subject::Scene(scene) => scene.world.noise.total_level(),
            Subject::Measured(data) => data.noise_level().unwrap_or(0.0),
        },
        training_frames: subject.training_frames(),
        test_frames: subject.test_frames(),
        test_choice: match subject {
            Subject::Scene(_) => None,
            Subject::Measured(data) => Some(data.test_choice.clone()),
        },
        motion: subject.moving_scene().map(|(_, path)| path),
        outliers: subject.measurements().map(|data| data.outliers.clone()),
        device: plan.device,
        line,
        group: group.into(),
        unit: unit.into(),
        worst_case: plan.worst_case,
        readings,
        points,
        left_out,
        bounds: Bounds::default(),
        chosen: None,
        verdict: None,
        refused: None,
        blobs,
        distinct_blobs: distinct,
    })
}

/// Unit and group of an error, for messages.
fn named(unit: &str, group: &str) -> String {
    format!("{unit} ({group})").trim_start().into()
}

/// Limit of a group and its standard error, if they are known.
fn least_error(limit: &LimitSummary, group: &str) -> Option<[f64; 2]> {
    let limit = limit.groups.iter().find(|limit| limit.group == group)?;
    Some([limit.limit, limit.limit_standard_error])
}

fn check(subject: &Subject, plan: &Plan) -> std::result::Result<(), BadValue> {
    for &centres in &plan.centres {
        Options { centres, ..subject.options() }.check(subject.training_frames())?;
    }
    if let Some(samples) =
        plan.samples_averaged.iter().find(|samples| !(1..=256).contains(*samples))
    {
        return Err(BadValue::new("--average", samples, "the firmware averages 1 to 256 samples"));
    }
    let (columns, rule) = match subject {
        Subject::Scene(scene) => {
            let columns = scene.world.sensor.column_wires;
            (columns, format!("give steps from 1 to {columns}, the columns of the scene"))
        }
        Subject::Measured(_) => {
            (1, "only a scene has columns to leave out; of a data file, choose --inputs".into())
        }
    };
    if let Some(step) = plan.column_steps.iter().find(|step| !(1..=columns).contains(*step)) {
        return Err(BadValue::new("--column-step", step, rule));
    }
    plan.device.check()?;
    let has_others = subject.scene().is_some_and(|scene| !scene.others.is_empty());
    if plan.worst_case && !has_others {
        let rule =
            "there are no other contacts to judge by; leave it out, or give a scene of contacts";
        return Err(BadValue::new("--worst-case", true, rule));
    }
    if let Subject::Measured(_) = subject
        && let Some(samples) = plan.samples_averaged.iter().find(|samples| **samples != 1)
    {
        let rule = "measured readings are averaged already: give 1, or a scene";
        return Err(BadValue::new("--average", samples, rule));
    }
    Ok(())
}

/// Fills in the fields that compare points with each other.
fn compare(points: &mut [Point], group: &str, worst_case: bool) {
    let mut best: BTreeMap<String, f64> = BTreeMap::new();
    for errors in points.iter().flat_map(|point| &point.errors) {
        let least = best.entry(errors.group.clone()).or_insert(f64::INFINITY);
        *least = least.min(errors.rmse);
    }
    let rank = |point: &Point| (point.times.frame_ms, point.counted_rmse(group, worst_case));
    let ranks: Vec<_> = points.iter().map(rank).collect();
    for (point, own) in points.iter_mut().zip(&ranks) {
        point.ratio_to_best = point.errors.iter().map(|e| e.rmse / best[&e.group]).collect();
        let beaten = |other: &(f64, f64)| other != own && other.0 <= own.0 && other.1 <= own.1;
        point.on_front = !ranks.iter().any(beaten);
    }
}
