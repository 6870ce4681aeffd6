//! Frames of a simulated sensor, which a contact moves over.

use std::sync::mpsc::{self, Receiver, SyncSender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use taxel_core::health::Limits;
use taxel_data::{Dataset, Silent, Stream};
use taxel_learn::reading_model::Extent;
use taxel_learn::{ModelBlob, Options};
use taxel_limit::Limit;
use taxel_recording::{Frame, Layout};
use taxel_simulate::path::Path;
use taxel_simulate::timetable::Timetable;
use taxel_simulate::{Synthesis, World};
use taxel_view::message::{Can, Kind};

use super::decode::FrameByFrame;
use super::feed::{About, Feed, Next};
use super::moment::Moment;
use super::sheet;
use super::touch::mean;
use crate::experiment::Experiment;
use crate::subject::Subject;
use crate::training_set::TrainingSet;
use crate::{Error, Result};

/// Frames and centres of the small model that is trained for a view.
const TRAINING_FRAMES: usize = 4000;
const CENTRES: usize = 64;
/// Duration of a trajectory in s, and most scans of one.
const DURATION_S: f64 = 12.0;
const MOST_STEPS: f64 = 6000.0;
/// A contact that is slow enough to be watched, where the scene has none that moves.
pub(super) const SLOW: Path = Path {
    speed_mm_per_s: [4.0, 12.0],
    press_rate_hz: [0.25, 0.5],
    peak_depth_mm: None,
    centre_mm: None,
    half_length_mm: None,
    duration_s: DURATION_S,
    trajectories: 1,
};
/// Time that still frames of a scene whose electrodes move on their own are shown for.
const STILL_S: f64 = 0.5;
/// Frames that lie behind by more than this are left out.
const MOST_LATE: Duration = Duration::from_millis(500);
/// Time from one frame that is judged beside the limit to the next.
const JUDGED: Duration = Duration::from_millis(500);
/// Frames whose mean is the baseline.
const AT_REST: usize = 64;

/// A small model for `scene`, trained in seconds: of the whole array, without refinement, with a full reading model where the
/// scene allows it.
///
/// # Errors
/// If the scene cannot be trained on.
pub fn small_model(scene: &Experiment) -> Result<ModelBlob> {
    let mut scene = scene.clone();
    scene.frames = scene.frames.min(TRAINING_FRAMES);
    let each_row = scene.world.motion.largest_contact(&scene.world.sensor).is_none();
    let subject = Subject::Scene(Box::new(scene));
    let usual = subject.options();
    let options = Options { centres: usual.centres.min(CENTRES), ..usual.for_each_row(each_row) };
    let mut training: TrainingSet<'_> = subject.training_set();
    (training.refine, training.reading_model) = (false, Some(Extent::Full));
    let full = training.blob(&options, &Silent);
    full.or_else(|_| {
        training.reading_model = None;
        training.blob(&options, &Silent)
    })
}

/// Frames of a scene, as fast as they would come from a device.
pub struct SimulationFeed<'b> {
    layout: Layout,
    about: About,
    decoder: FrameByFrame<'b>,
    trajectories: Receiver<Dataset>,
    current: Dataset,
    /// Number of the next frame, and of the next one of the current trajectory.
    number: u64,
    place: usize,
    period: Duration,
    /// Time at which the next frame is due.
    due: Instant,
    has_truth: bool,
    at_rest: Vec<Vec<f32>>,
    baseline: Vec<f32>,
    judge: Judge,
}

impl<'b> SimulationFeed<'b> {
    /// Frames of `scene`, so many a second, decoded by the model in `blob`.
    ///
    /// # Errors
    /// If the model takes other readings than the scene has.
    pub fn new(scene: &Experiment, blob: &'b ModelBlob, frame_rate: f64) -> Result<Self> {
        let decoder = FrameByFrame::new(blob, Limits::USUAL)?;
        let model = blob.parse();
        let metadata = model.metadata();
        let readings = scene.world.reading_names();
        let layout = sheet::layout(
            &scene.name,
            sheet::columns(readings.iter().map(String::as_str), []),
            sheet::columns(metadata.output_names.iter(), metadata.output_units.iter()),
            Some(&scene.world.sensor),
        );
        if !sheet::takes(metadata, &layout) {
            return Err(Error::Usage(format!(
                "--model: it takes other readings than scene {} has; train one on the scene",
                scene.name
            )));
        }
        let has_truth = metadata.output_names.iter().eq(scene.world.output_names());
        let at_rest = Synthesis::new(&scene.world).untouched().frames(Stream::Test, AT_REST);
        let at_rest: Vec<Vec<f32>> = at_rest.inputs.lines().map(floats).collect();
        let baseline = mean(&at_rest);
        let (sender, trajectories) = mpsc::sync_channel(1);
        let (world, rate) = (scene.world.clone(), frame_rate);
        spawn("synthesis", move || synthesise(&world, rate, &sender))?;
        let mut in_mm = vec![false; layout.outputs.len()];
        let deformations = layout.electrodes.iter().flat_map(|it| it.outputs).flatten();
        deformations.for_each(|output| in_mm[output] = true);
        let can = Can { zero: true, record: true, seek: false };
        let source = format!(
            "scene {}, {} noise, {frame_rate} frames a second",
            scene.name,
            scene.world.noise.kind.in_words(scene.world.noise.total_level())
        );
        // The limit is that of decoders without a memory.
        let is_judged = has_truth && !decoder.tracks();
        let judge = Judge::start(&scene.world, is_judged, in_mm)?;
        let mut feed = Self {
            layout,
            about: About { kind: Kind::Simulation, source, can, duration_s: None },
            decoder,
            trajectories,
            current: Dataset::empty(vec![], vec![], 1, 0),
            number: 0,
            place: 0,
            period: Duration::from_secs_f64(1.0 / frame_rate),
            due: Instant::now(),
            has_truth,
            judge,
            at_rest,
            baseline,
        };
        feed.decoder.set_baseline(&feed.baseline);
        feed.go_on()?;
        feed.due = Instant::now();
        Ok(feed)
    }

    /// Takes the next trajectory.
    fn go_on(&mut self) -> Result<()> {
        let failed = |_| Error::failed("an error in the program: synthesis has ended");
        (self.current, self.place) = (self.trajectories.recv().map_err(failed)?, 0);
        Ok(())
    }
}

fn floats(values: &[f64]) -> Vec<f32> {
    values.iter().map(|value| *value as f32).collect()
}

fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> Result<()> {
    let spawned = thread::Builder::new().name(name.into()).spawn(work);
    spawned.map(drop).map_err(|cause| Error::failed(format!("no thread for {name}: {cause}")))
}

/// Synthesises one trajectory after the other, for as long as they are taken.
fn synthesise(world: &World, frame_rate: f64, sender: &SyncSender<Dataset>) {
    let duration_s = DURATION_S.min(MOST_STEPS / frame_rate);
    let path = Path { duration_s, ..world.path.unwrap_or(SLOW) };
    let moves = world.check_path(&path).is_ok();
    for number in 0.. {
        let synthesis = Synthesis::new(world);
        let frames = if moves {
            let starts_s = (0..(duration_s * frame_rate) as usize).map(|it| it as f64 / frame_rate);
            let timetable = Timetable::instants(starts_s.collect());
            let synthesis = synthesis.along(path, timetable);
            synthesis.frames_from(Stream::Test, number, synthesis.steps())
        } else {
            let still = synthesis.frames_from(Stream::Test, number, 1);
            let times = (STILL_S * frame_rate).ceil().max(1.0) as usize;
            still.subset(&vec![0; times])
        };
        if sender.send(frames).is_err() {
            return;
        }
    }
}

impl Feed for SimulationFeed<'_> {
    fn layout(&self) -> &Layout {
        &self.layout
    }

    fn about(&self) -> About {
        self.about.clone()
    }

    fn next(&mut self, within: Duration) -> Result<Next> {
        let wait = self.due.saturating_duration_since(Instant::now());
        if wait > within {
            thread::sleep(within);
            return Ok(Next::Nothing);
        }
        thread::sleep(wait);
        if self.due.elapsed() > MOST_LATE {
            self.due = Instant::now();
        }
        self.due += self.period;
        if self.place == self.current.frames() {
            self.go_on()?;
        }
        let [readings, outputs] =
            [&self.current.inputs, &self.current.outputs].map(|table| table.line(self.place));
        let frame = Frame {
            time_us: (self.number as f64 * self.period.as_secs_f64() * 1e6) as u64,
            number: self.number as u32,
            readings: floats(readings),
            truth: self.has_truth.then(|| floats(outputs)),
            ..Frame::default()
        };
        (self.number, self.place) = (self.number + 1, self.place + 1);
        let mut moment = Moment::new(frame);
        self.decoder.decode(&mut moment)?;
        self.judge.look(readings, &moment.frame);
        Ok(Next::Frame(Box::new(moment)))
    }

    fn baseline(&self) -> Option<Vec<f32>> {
        Some(self.baseline.clone())
    }

    fn at_rest(&self) -> &[Vec<f32>] {
        &self.at_rest
    }

    fn zero(&mut self, readings: &[f32]) -> std::result::Result<(), String> {
        self.decoder.set_baseline(readings);
        Ok(())
    }

    fn judged(&self) -> Option<[f64; 2]> {
        let sums = self.judge.sums.lock().unwrap_or_else(PoisonError::into_inner);
        (sums.frames >= FEWEST_JUDGED).then_some(sums.squares_mm2)
    }
}

/// Least number of frames whose errors are compared.
const FEWEST_JUDGED: usize = 10;

/// Squared errors of the frames that were judged, summed.
#[derive(Default)]
struct Sums {
    frames: usize,
    /// Sums for the posterior mean, and for the decoder.
    squares_mm2: [f64; 2],
}

/// Compares some of the frames with what the best of all decoders makes of them, in the background.
struct Judge {
    sender: Option<SyncSender<(Vec<f64>, Frame)>>,
    sums: Arc<Mutex<Sums>>,
    last: Instant,
}

impl Judge {
    /// A judge by the limit of still frames of `world`, of those outputs that are deformations, `in_mm`; it does nothing unless
    /// they are judged, and without a limit.
    fn start(world: &World, is_judged: bool, in_mm: Vec<bool>) -> Result<Self> {
        let (sums, last) = (Arc::<Mutex<Sums>>::default(), Instant::now());
        let still = World { path: None, ..world.clone() };
        let Ok(limit) = Limit::new(&still) else { return Ok(Self { sender: None, sums, last }) };
        let (sender, receiver) = mpsc::sync_channel::<(Vec<f64>, Frame)>(1);
        let of_thread = Arc::clone(&sums);
        spawn("limit", move || {
            while let Ok((readings, frame)) = receiver.recv() {
                let best = limit.posteriors(&readings, &Silent);
                let (Some(outputs), Some(truth)) = (&frame.outputs, &frame.truth) else { continue };
                let squares = |values: &mut dyn Iterator<Item = f64>| -> f64 {
                    let pairs = values.zip(truth).zip(&in_mm).filter(|(_, in_mm)| **in_mm);
                    pairs.map(|((a, b), _)| (a - f64::from(*b)).powi(2)).sum()
                };
                let of_best = squares(&mut best.iter().flat_map(|it| it.mean.iter().copied()));
                let decoded = squares(&mut outputs.iter().copied().map(f64::from));
                let mut sums = of_thread.lock().unwrap_or_else(PoisonError::into_inner);
                sums.frames += 1;
                sums.squares_mm2[0] += of_best;
                sums.squares_mm2[1] += decoded;
            }
        })?;
        Ok(Self { sender: is_judged.then_some(sender), sums, last })
    }

    /// Judges this frame, if it is time to, and the one before is done.
    fn look(&mut self, readings: &[f64], frame: &Frame) {
        if let Some(sender) = &self.sender
            && self.last.elapsed() > JUDGED
            && sender.try_send((readings.to_vec(), frame.clone())).is_ok()
        {
            self.last = Instant::now();
        }
    }
}
