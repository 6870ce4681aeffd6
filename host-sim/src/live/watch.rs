//! Shows what a feed brings, and does what the page's buttons ask for, until the program is told to end.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use taxel_firmware::link::message::EstimateReport;
use taxel_learn::ModelBlob;
use taxel_recording::{Frame, Status as RecordedStatus};
use taxel_view::message::{self as page, Kind, State, Status};
use taxel_view::{Action, Command, View};

use super::contact::{force_n, place_mm};
use super::feed::{Feed, Next};
use super::moment::Moment;
use super::recorder::{Beside, Recorder};
use super::shown;
use super::touch::{Touch, mean, unsteady};
use super::wires::Wires;
use crate::{Error, Result};

/// Time that one look for a frame takes, after which buttons are looked at.
const LOOK: Duration = Duration::from_millis(10);
/// Time from one status to the next, and from one judgement of the wires to the next.
const STATUS: Duration = Duration::from_millis(500);
/// Frames whose mean becomes the baseline.
const ZERO_FRAMES: usize = 24;
/// Time over which rates and errors are told.
const WINDOW: Duration = Duration::from_secs(10);

/// What goes with what is watched.
pub struct Watched<'b> {
    /// Model that decodes, if it is known: for its reading model, and for recordings.
    pub blob: Option<&'b ModelBlob>,
    /// Text of the scene, for recordings.
    pub scene: Option<String>,
}

/// Watches `feed` on `view` until `stop` is set.
///
/// # Errors
/// What no waiting mends.
pub fn watch(
    feed: &mut dyn Feed,
    view: &View,
    commands: &Receiver<Command>,
    watched: &Watched<'_>,
    stop: &AtomicBool,
) -> Result<()> {
    let mut watch = Watch::new(feed, view, watched);
    watch.show_layout();
    while !stop.load(Ordering::Relaxed) {
        while let Ok(command) = commands.try_recv() {
            let answer = watch.act(command.action);
            command.answer(answer);
            watch.tell();
        }
        watch.step()?;
    }
    watch.stop_recording().map(drop).map_err(Error::failed)
}

struct Watch<'w, 'b> {
    feed: &'w mut dyn Feed,
    view: &'w View,
    watched: &'w Watched<'b>,
    baseline: Option<Vec<f32>>,
    /// What the baseline is of, in words; empty if the feed tells it.
    rest: &'static str,
    /// The newest frames, whose mean can become the baseline.
    newest: VecDeque<Vec<f32>>,
    wires: Wires,
    recorder: Option<Recorder>,
    is_paused: bool,
    /// Why no frames come.
    trouble: Option<(State, String)>,
    /// What happened to the last recording by itself.
    remark: Option<String>,
    /// Detector of touch, as soon as frames at rest are known.
    touch: Option<Touch>,
    is_touched: bool,
    /// Whether a contact has ended, and no force of 0 was told yet.
    owes_zero: bool,
    /// Newest event, and when it came.
    event: Option<(String, Instant)>,
    /// Times of the last frames, whether each was decoded, and squares of errors with their number.
    past: VecDeque<(Instant, bool, f64, usize)>,
    told: Instant,
}

impl<'w, 'b> Watch<'w, 'b> {
    fn new(feed: &'w mut dyn Feed, view: &'w View, watched: &'w Watched<'b>) -> Self {
        let wires = Wires::new(&feed.layout().readings, feed.limits());
        let baseline = feed.baseline();
        let at_rest = feed.at_rest();
        let touch =
            (!at_rest.is_empty()).then(|| Touch::new(feed.layout(), feed.limits(), at_rest, None));
        Self {
            feed,
            view,
            watched,
            baseline,
            rest: "",
            newest: VecDeque::new(),
            wires,
            recorder: None,
            is_paused: false,
            trouble: None,
            remark: None,
            touch,
            is_touched: false,
            owes_zero: false,
            event: None,
            past: VecDeque::new(),
            told: Instant::now(),
        }
    }

    fn step(&mut self) -> Result<()> {
        match self.feed.next(LOOK)? {
            Next::Frame(moment) => self.take(*moment),
            Next::Nothing => {}
            Next::Trouble(cause) => self.say(State::NoData, cause),
            Next::Ended => {
                let note = self.feed.note().map(|note| format!("; {note}")).unwrap_or_default();
                self.say(State::Ended, format!("the end of the recording{note}"));
            }
            Next::Anew => {
                // A recording has one layout from its beginning to its end.
                if self.recorder.is_some() {
                    let ended = self.stop_recording().unwrap_or_else(|cause| cause);
                    self.remark = Some(format!(
                        "the recording has ended, because the sensor sends other frames now: {ended}"
                    ));
                }
                self.wires = Wires::new(&self.feed.layout().readings, self.feed.limits());
                (self.baseline, self.newest) = (self.feed.baseline(), VecDeque::new());
                (self.touch, self.is_touched, self.rest) = (None, false, "");
                self.show_layout();
            }
        }
        if self.told.elapsed() > STATUS {
            let model = self.watched.blob.map(ModelBlob::parse);
            self.flush_recording();
            // Statistics of ratios to a baseline tell nothing of readings in ohm.
            let model = model.as_ref().filter(|model| !model.metadata().relative_inputs);
            self.wires.judge(model.and_then(taxel_core::blob::Model::reading_model));
            self.tell();
        }
        Ok(())
    }

    fn say(&mut self, state: State, message: String) {
        let trouble = Some((state, message));
        if self.trouble != trouble {
            self.trouble = trouble;
            self.tell();
        }
    }

    /// Makes what was recorded safe while no frames come; frames do so themselves.
    fn flush_recording(&mut self) {
        let stalls = self.past.back().is_none_or(|it| it.0.elapsed() > STATUS);
        if let Some(recorder) = self.recorder.as_mut().filter(|_| stalls)
            && let Err(cause) = recorder.flush()
        {
            self.lose_recording(&cause);
        }
    }

    /// Ends a recording that cannot be written any more. What was written can be recovered.
    fn lose_recording(&mut self, cause: &Error) {
        self.recorder = None;
        self.remark = Some(format!("the recording has ended: {cause}"));
    }

    /// State of what is watched, and what is to be said of it.
    fn state(&self, wires: &[page::Wire]) -> (State, String) {
        let remark = self.remark.clone().unwrap_or_default();
        if self.is_paused || self.feed.is_paused() && self.trouble.is_none() {
            return (State::Paused, if remark.is_empty() { "paused".into() } else { remark });
        }
        if let Some((state, message)) = &self.trouble {
            return (*state, message.clone());
        }
        let seeks_rest = self.touch.is_none() && self.newest.len() == ZERO_FRAMES;
        let words = "the sensor at rest is not known yet, because readings are not steady: let go of the sensor";
        let said = seeks_rest.then(|| words.into()).into_iter();
        let said = said.chain(self.feed.note()).chain(self.remark.clone());
        let said = said.chain((!wires.is_empty()).then(|| {
            let words: Vec<&str> = wires.iter().take(2).map(|wire| wire.words.as_str()).collect();
            words.join("; ")
        }));
        (State::Live, said.collect::<Vec<_>>().join("; "))
    }

    fn take(&mut self, mut moment: Moment) {
        self.find_contact(&mut moment.frame);
        let frame = &moment.frame;
        let outputs = frame.outputs.as_deref();
        let (square, count) = shown::errors(self.feed.layout(), outputs, frame.truth.as_deref());
        let has_outputs = outputs.is_some();
        if let Some(event) = frame.events.last() {
            self.event = Some((event.clone(), moment.heard));
        }
        if self.newest.len() == ZERO_FRAMES {
            self.newest.pop_front();
        }
        self.newest.push_back(frame.readings.clone());
        if self.touch.is_none()
            && self.newest.len() == ZERO_FRAMES
            && unsteady(self.feed.layout(), self.feed.limits(), self.newest.make_contiguous())
                .is_none()
        {
            if self.baseline.is_none() {
                self.rest = "first steady frames";
            }
            self.set_rest(self.baseline.clone());
        }
        self.wires.push(&moment.frame.readings);
        self.past.push_back((moment.heard, has_outputs, square, count));
        while self.past.front().is_some_and(|(time, ..)| time.elapsed() > WINDOW) {
            self.past.pop_front();
        }
        self.record(&mut moment);
        self.trouble = None;
        if !self.is_paused {
            self.view.show(shown::frame(&moment));
        }
    }

    /// Tells whether something touches, where, and with which force, unless the frame does.
    fn find_contact(&mut self, frame: &mut Frame) {
        let layout = self.feed.layout();
        let outputs = frame.outputs.as_deref();
        let was_touched = self.is_touched;
        let touch = self.touch.as_mut();
        self.is_touched = touch.is_some_and(|touch| touch.update(&frame.readings, frame.time_us));
        let touching = outputs.filter(|_| self.is_touched);
        frame.contact_mm = frame.contact_mm.or_else(|| place_mm(layout, touching?));
        frame.force_n = frame.force_n.or_else(|| force_n(layout, outputs?));
        self.owes_zero = (self.owes_zero || was_touched) && !self.is_touched;
        if let Some(force_n) = frame.force_n.as_mut().filter(|_| self.owes_zero) {
            (*force_n, self.owes_zero) = ([0.0; 3], false);
        }
    }

    fn record(&mut self, moment: &mut Moment) {
        let Some(recorder) = &mut self.recorder else { return };
        let [row_wires, column_wires] = self.wires.for_recording(self.feed.layout());
        moment.frame.status = Some(RecordedStatus {
            row_wires,
            column_wires,
            lost_frames: self.feed.lost(),
            is_novel: moment.has(EstimateReport::NOVEL),
            is_clamped: moment.has(EstimateReport::CLAMPED),
        });
        if let Err(cause) = recorder.write(&moment.frame) {
            self.lose_recording(&cause);
            self.tell();
        }
    }

    fn act(&mut self, action: Action) -> std::result::Result<String, String> {
        let is_recording = self.feed.about().kind == Kind::Recording;
        match action {
            Action::Zero => self.zero(),
            Action::Record => self.start_recording(),
            Action::StopRecording => self.stop_recording(),
            Action::Pause | Action::Resume => {
                self.trouble = None;
                // A device goes on scanning, and a recording stands still.
                if is_recording {
                    return self.feed.act(action);
                }
                self.is_paused = action == Action::Pause;
                Ok(String::new())
            }
            Action::Step { .. } | Action::Seek { .. } | Action::Speed { .. } => {
                self.trouble = None;
                self.feed.act(action)
            }
        }
    }

    fn zero(&mut self) -> std::result::Result<String, String> {
        if self.newest.len() < ZERO_FRAMES {
            return Err(format!(
                "not zeroed: {ZERO_FRAMES} frames are needed, and there are {}",
                self.newest.len()
            ));
        }
        let frames = self.newest.make_contiguous();
        let touching = self.touch.as_ref().and_then(|touch| touch.look(frames));
        let why =
            if touching.is_some() { "something touches the sensor" } else { "it is not steady" };
        if let Some(seen) =
            touching.or_else(|| unsteady(self.feed.layout(), self.feed.limits(), frames))
        {
            return Err(format!(
                "not zeroed: {why}. S is {:.1} times the level at which a touch begins, and {} changes most; let go of the \
                 sensor, and try again",
                seen.times,
                self.feed.layout().readings[seen.reading].name
            ));
        }
        self.set_rest(None);
        self.rest = "last zero";
        let baseline = self.baseline.as_deref().unwrap_or_default();
        self.feed.zero(baseline)?;
        Ok(format!("zeroed by the mean of {ZERO_FRAMES} frames"))
    }

    /// Takes the newest frames for those at rest, with their mean for the baseline unless one is `known`.
    fn set_rest(&mut self, known: Option<Vec<f32>>) {
        let frames = self.newest.make_contiguous();
        self.touch =
            Some(Touch::new(self.feed.layout(), self.feed.limits(), frames, known.as_deref()));
        let baseline = known.unwrap_or_else(|| mean(frames));
        self.view.set_baseline(baseline.clone());
        self.baseline = Some(baseline);
    }

    fn start_recording(&mut self) -> std::result::Result<String, String> {
        if !self.feed.about().can.record {
            return Err("a recording cannot be recorded again".into());
        }
        if self.recorder.is_some() {
            return Err("a recording is being written already".into());
        }
        let beside = Beside {
            blob: self.watched.blob.map(|blob| blob.bytes().to_vec()),
            scene: self.watched.scene.clone(),
            source: self.feed.about().source,
            baseline: self.baseline.clone(),
        };
        if self.feed.layout().readings.is_empty() {
            return Err("not recorded: no frame has come yet".into());
        }
        let path = Recorder::free_path();
        let recorder = Recorder::start(&path, self.feed.layout(), beside);
        self.recorder = Some(recorder.map_err(|cause| cause.to_string())?);
        self.remark = None;
        Ok(format!("recording {}", path.display()))
    }

    fn stop_recording(&mut self) -> std::result::Result<String, String> {
        match self.recorder.take() {
            Some(recorder) => recorder.finish().map_err(|cause| cause.to_string()),
            None => Ok(String::new()),
        }
    }

    fn show_layout(&self) {
        self.view.set_layout(shown::layout(self.feed));
        if let Some(baseline) = &self.baseline {
            self.view.set_baseline(baseline.clone());
        }
    }

    fn tell(&mut self) {
        self.told = Instant::now();
        let span = self.past.front().zip(self.past.back()).map(|(a, b)| b.0 - a.0);
        let span_s = span.map_or(0.0, |span| span.as_secs_f64());
        let is_recent = self.past.back().is_some_and(|it| it.0.elapsed() < Duration::from_secs(2));
        let rate = |count: usize| {
            (span_s > 0.0 && is_recent).then(|| (count.saturating_sub(1) as f64 / span_s) as f32)
        };
        let decoded = self.past.iter().filter(|it| it.1).count();
        let judged = self.feed.judged();
        let (position_s, speed) = self.feed.position().unzip();
        let wires = self.wires.for_page();
        let (state, message) = self.state(&wires);
        self.view.set_status(Status {
            state,
            message,
            scan_rate: rate(self.past.len()),
            decode_rate: rate(decoded).filter(|_| decoded > 0),
            rest: self.rest.into(),
            lost: self.feed.lost(),
            wires,
            recording: self.recorder.as_ref().map(Recorder::for_page),
            rmse_mm: rmse(self.past.iter().map(|it| (it.2, it.3))),
            times_limit: judged.map(|[best, decoded]| (decoded / best).sqrt() as f32),
            position_s,
            speed,
            event: self.event.as_ref().map(|(words, heard)| {
                format!("{words}, {:.0} s ago", heard.elapsed().as_secs_f64())
            }),
        });
    }
}

/// Root mean square of errors, of the sums of squares of several frames and the numbers of their values.
fn rmse(frames: impl Iterator<Item = (f64, usize)>) -> Option<f32> {
    let (squares, count) = frames.fold((0.0, 0), |all, it| (all.0 + it.0, all.1 + it.1));
    (count > 0).then(|| (squares / count as f64).sqrt() as f32)
}

#[cfg(test)]
mod tests {
    use taxel_recording::Layout;
    use taxel_view::message::Can;

    use super::super::feed::About;
    use super::super::sheet;
    use super::*;

    /// A feed that brings nothing by itself.
    struct Silent(Layout);

    impl Feed for Silent {
        fn layout(&self) -> &Layout {
            &self.0
        }

        fn about(&self) -> About {
            let can = Can { zero: true, record: true, seek: false };
            About { kind: Kind::Device, source: String::new(), can, duration_s: None }
        }

        fn next(&mut self, _within: Duration) -> Result<Next> {
            Ok(Next::Nothing)
        }
    }

    #[test]
    fn the_error_is_of_values_and_not_of_frames() {
        assert_eq!(rmse([(32.0, 1), (4.0, 3), (0.0, 0)].into_iter()), Some(3.0));
        assert_eq!(rmse([(0.0, 0)].into_iter()), None);
    }

    #[test]
    fn force_is_always_there_place_while_touched_and_zero_once() {
        let columns = |names: &[&str]| sheet::columns(names.iter().copied(), []);
        let outputs = columns(&["x_mm", "y_mm", "force_N"]);
        let mut feed = Silent(sheet::layout("", columns(&["a", "b", "c"]), outputs, None));
        let (view, _commands) = View::start(0, None).unwrap();
        let watched = Watched { blob: None, scene: None };
        let mut watch = Watch::new(&mut feed, &view, &watched);
        let mut number = 0_u32;
        let mut show = |watch: &mut Watch<'_, '_>, change: f32, force_n: Option<f32>| {
            number += 1;
            let noise = if number.is_multiple_of(2) { 0.01 } else { -0.01 };
            let mut frame = Frame {
                time_us: u64::from(number) * 10_000,
                readings: vec![5.0 + noise, 7.0 - noise + change, 9.0],
                outputs: force_n.map(|force_n| vec![1.0, 2.0, force_n]),
                ..Frame::default()
            };
            watch.find_contact(&mut frame);
            let found = (frame.contact_mm.is_some(), frame.force_n.map(|it| it[2]));
            watch.take(Moment::new(frame));
            found
        };
        // A load that grows is no rest.
        for step in 0..40_u8 {
            assert_eq!(show(&mut watch, f32::from(step) * 0.05, Some(0.5)), (false, Some(0.5)));
        }
        assert!(watch.zero().unwrap_err().contains("not steady"));
        assert!(watch.state(&[]).1.contains("let go of the sensor"));
        for _ in 0..ZERO_FRAMES {
            show(&mut watch, 0.0, Some(0.1));
        }
        assert!((watch.baseline.as_ref().unwrap()[1] - 7.0).abs() < 1e-3);
        assert_eq!((watch.state(&[]).1.as_str(), watch.rest), ("", "first steady frames"));
        assert_eq!(show(&mut watch, 0.0, Some(0.1)), (false, Some(0.1)));
        assert_eq!(show(&mut watch, 0.5, Some(2.0)), (true, Some(2.0)));
        let refused = watch.zero().unwrap_err();
        assert!(
            refused.contains("something touches") && refused.contains("and b changes"),
            "{refused}"
        );
        // The frame in which the contact ends has no force: the next one tells 0.
        for (force_n, told_n) in [(None, None), (Some(0.1), Some(0.0)), (Some(0.1), Some(0.1))] {
            assert_eq!(show(&mut watch, 0.0, force_n), (false, told_n));
        }
        assert!(watch.zero().unwrap_err().contains("something touches"));
        for _ in 0..ZERO_FRAMES {
            show(&mut watch, 0.0, Some(0.1));
        }
        assert_eq!(watch.zero().unwrap(), "zeroed by the mean of 24 frames");
    }
}
