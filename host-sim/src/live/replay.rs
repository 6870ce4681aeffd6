//! Frames of a recording: an MCAP file, or a data file of readings.

use std::collections::{BTreeSet, VecDeque};
use std::path::Path;
use std::time::{Duration, Instant};

use taxel_core::health::Limits;
use taxel_data::{Clock, DataFile, columns};
use taxel_firmware::link::message::EstimateReport;
use taxel_learn::ModelBlob;
use taxel_recording::{Frame, Layout, Reader};
use taxel_view::Action;
use taxel_view::message::{Can, Kind};

use super::decode::FrameByFrame;
use super::feed::{About, Feed, Next};
use super::moment::Moment;
use super::sheet;
use crate::{Error, Result};

/// Times of frames that are remembered, to step back by.
const REMEMBERED: usize = 1000;
/// Frames a second of a data file that does not tell its times.
pub const USUAL_RATE: f64 = 100.0;

/// Time of each line of a data file in s: its `clock`'s, unless a rate is given or it tells none.
pub fn times_s(clock: &Clock, frame_rate: Option<f64>) -> Vec<f64> {
    if clock.column.is_some() && clock.unit == "s" && frame_rate.is_none() {
        return clock.at.clone();
    }
    let rate = frame_rate.unwrap_or(USUAL_RATE);
    (0..clock.at.len()).map(|line| line as f64 / rate).collect()
}

/// Frames that lie still: any of them can be gone to.
trait Still {
    /// The next frame, with its time since the first one.
    fn next(&mut self) -> Result<Option<(Duration, Frame)>>;
    /// Goes to the first frame at this time or after it.
    fn seek(&mut self, to: Duration) -> Result<()>;
}

impl Still for Reader {
    fn next(&mut self) -> Result<Option<(Duration, Frame)>> {
        let frame =
            Iterator::next(self).transpose().map_err(|cause| Error::failed(cause.to_string()))?;
        Ok(frame.map(|frame| (Reader::position(self), frame)))
    }

    fn seek(&mut self, to: Duration) -> Result<()> {
        Reader::seek(self, to).map_err(|cause| Error::failed(cause.to_string()))
    }
}

/// Lines of a data file.
struct Lines {
    file: DataFile,
    readings: Vec<usize>,
    /// Columns with the true outputs, if the file has all of them.
    truth: Vec<usize>,
    times_s: Vec<f64>,
    next: usize,
}

impl Still for Lines {
    fn next(&mut self) -> Result<Option<(Duration, Frame)>> {
        let line = self.next;
        let Some(time_s) = self.times_s.get(line) else { return Ok(None) };
        self.next += 1;
        let since = Duration::from_secs_f64(time_s - self.times_s[0]);
        let values = |columns: &[usize]| -> Vec<f32> {
            columns.iter().map(|column| self.file.value(line, *column) as f32).collect()
        };
        let frame = Frame {
            time_us: since.as_micros() as u64,
            number: line as u32,
            readings: values(&self.readings),
            truth: (!self.truth.is_empty()).then(|| values(&self.truth)),
            ..Frame::default()
        };
        Ok(Some((since, frame)))
    }

    fn seek(&mut self, to: Duration) -> Result<()> {
        let to_s = self.times_s.first().copied().unwrap_or(0.0) + to.as_secs_f64();
        self.next = self.times_s.partition_point(|time| *time < to_s);
        Ok(())
    }
}

/// Frames of a recording, at the speed of the clock or another.
pub struct ReplayFeed<'b> {
    frames: Box<dyn Still>,
    layout: Layout,
    about: About,
    /// Decoder, if frames are decoded anew, and the columns of their truth that are its outputs', if all are there.
    decoder: Option<(FrameByFrame<'b>, Option<Vec<usize>>)>,
    baseline: Option<Vec<f32>>,
    speed: f64,
    is_paused: bool,
    /// Place in the recording at a moment of the wall clock.
    from: (Duration, Instant),
    /// Frame that was read and is not due yet.
    ahead: Option<(Duration, Frame)>,
    at: Duration,
    /// Time between the last two frames.
    period_s: f64,
    /// Times of the last frames that were given.
    given: VecDeque<Duration>,
    /// Frames that are to be given at once, and paused after.
    steps: usize,
    /// What was found of damaged parts, which are left out.
    damage: BTreeSet<String>,
}

impl<'b> ReplayFeed<'b> {
    /// Frames of the MCAP file that `reader` has open. Where it holds no estimates, or `blob` is given by the user, they are
    /// decoded by the model in `blob`.
    ///
    /// # Errors
    /// If the model takes other readings.
    pub fn of_recording(
        mut reader: Reader,
        path: &Path,
        blob: Option<&'b ModelBlob>,
    ) -> Result<Self> {
        // Frames are worth more than a model that is damaged.
        let settings = reader.extras().unwrap_or_default().settings;
        let baseline = settings
            .get(BASELINE)
            .map(|text| text.split(',').map(|number| number.parse().unwrap_or(f32::NAN)).collect());
        let mut layout = reader.layout().clone();
        let is_whole = |baseline: &Vec<f32>| baseline.len() == layout.readings.len();
        let baseline: Option<Vec<f32>> = baseline.filter(is_whole);
        let duration = reader.duration();
        let decoder = match blob {
            Some(blob) => {
                let model = blob.parse();
                let own = sheet::of_model(model.metadata(), None);
                let decoder = decoder_for(blob, &layout)?;
                let recorded = |name: &str| sheet::names(&layout.outputs).position(|it| it == name);
                let truth = sheet::names(&own.outputs).map(recorded).collect::<Option<Vec<_>>>();
                if sheet::names(&own.outputs).ne(sheet::names(&layout.outputs)) {
                    (layout.outputs, layout.electrodes) = (own.outputs, own.electrodes);
                }
                Some((decoder, truth))
            }
            None => None,
        };
        Ok(Self::new(Box::new(reader), layout, path, duration, decoder, baseline))
    }

    /// Frames of the data `file`, decoded by the model in `blob` if there is one; otherwise all of its columns are readings.
    /// `clock` is the file's. A file without times has `frame_rate` frames a second.
    ///
    /// # Errors
    /// If a column of the model is missing, or the times are not in order.
    pub fn of_data(
        file: DataFile,
        blob: Option<&'b ModelBlob>,
        clock: &Clock,
        frame_rate: Option<f64>,
    ) -> Result<Self> {
        let times_s = times_s(clock, frame_rate);
        let title = file.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let (layout, readings, truth) = if let Some(blob) = blob {
            let model = blob.parse();
            let layout = sheet::of_model(model.metadata(), None);
            let readings = file.columns(sheet::names(&layout.readings))?;
            let truth = file.columns(sheet::names(&layout.outputs)).unwrap_or_default();
            (layout, readings, truth)
        } else {
            let is_time = |name: &&String| Some(*name) != clock.column.as_ref();
            let names: Vec<&str> = file.header.iter().filter(is_time).map(String::as_str).collect();
            // With cells of a grid, the others are no readings.
            let cells: Vec<&str> =
                names.iter().copied().filter(|name| columns::cell_of(name).is_some()).collect();
            let names = if cells.is_empty() { names } else { cells };
            let readings = file.columns(names.iter().copied())?;
            (sheet::layout(&title, sheet::columns(names, []), vec![], None), readings, vec![])
        };
        let own = Some((0..layout.outputs.len()).collect());
        let decoder = match blob {
            Some(blob) => Some((decoder_for(blob, &layout)?, own)),
            None => None,
        };
        let last_s = times_s.last().zip(times_s.first()).map_or(0.0, |(last, first)| last - first);
        let path = file.path.clone();
        let lines = Lines { file, readings, truth, times_s, next: 0 };
        Ok(Self::new(
            Box::new(lines),
            layout,
            &path,
            Duration::from_secs_f64(last_s),
            decoder,
            None,
        ))
    }

    fn new(
        frames: Box<dyn Still>,
        layout: Layout,
        path: &Path,
        duration: Duration,
        mut decoder: Option<(FrameByFrame<'b>, Option<Vec<usize>>)>,
        baseline: Option<Vec<f32>>,
    ) -> Self {
        if let (Some((decoder, _)), Some(baseline)) = (&mut decoder, &baseline) {
            decoder.set_baseline(baseline);
        }
        let can = Can { zero: true, record: false, seek: true };
        let about = About {
            kind: Kind::Recording,
            source: path.display().to_string(),
            can,
            duration_s: Some(duration.as_secs_f64()),
        };
        let from = (Duration::ZERO, Instant::now());
        let (at, given) = (Duration::ZERO, VecDeque::new());
        let (speed, is_paused, ahead, steps, period_s) = (1.0, false, None, 0, 1.0 / USUAL_RATE);
        Self {
            frames,
            layout,
            about,
            decoder,
            baseline,
            speed,
            is_paused,
            from,
            ahead,
            at,
            period_s,
            given,
            steps,
            damage: BTreeSet::new(),
        }
    }

    /// Goes on from this place at this moment.
    fn play_from(&mut self, place: Duration) {
        self.from = (place, Instant::now());
    }

    fn seek(&mut self, to: Duration) -> std::result::Result<(), String> {
        self.frames.seek(to).map_err(|cause| cause.to_string())?;
        (self.ahead, self.at) = (None, to);
        self.play_from(to);
        // Something is to be seen, also of one that is paused.
        self.steps = 1;
        Ok(())
    }
}

impl ReplayFeed<'_> {
    /// Goes so many frames back: to one that was given, or else as far before as so many frames last.
    fn step_back(&mut self, frames: usize) -> std::result::Result<(), String> {
        if let Some(place) = self.given.len().checked_sub(frames + 1) {
            let to = self.given[place];
            self.given.truncate(place);
            return self.seek(to);
        }
        let before = Duration::from_secs_f64(frames as f64 * self.period_s);
        self.given.clear();
        self.seek(self.at.saturating_sub(before))
    }
}

/// Name of the setting with the readings of the untouched sensor.
pub const BASELINE: &str = "baseline";

fn decoder_for<'b>(blob: &'b ModelBlob, layout: &Layout) -> Result<FrameByFrame<'b>> {
    if !sheet::takes(blob.parse().metadata(), layout) {
        let message = "--model: it takes other readings than the recording has";
        return Err(Error::Usage(message.into()));
    }
    FrameByFrame::new(blob, Limits::USUAL)
}

impl Feed for ReplayFeed<'_> {
    fn layout(&self) -> &Layout {
        &self.layout
    }

    fn about(&self) -> About {
        self.about.clone()
    }

    fn next(&mut self, within: Duration) -> Result<Next> {
        if self.ahead.is_none() {
            match self.frames.next() {
                Ok(next) => self.ahead = next,
                // What follows a damaged part is played on.
                Err(cause) => {
                    self.damage.insert(cause.to_string());
                    return Ok(Next::Nothing);
                }
            }
        }
        let Some((time, _)) = &self.ahead else {
            (self.is_paused, self.steps) = (true, 0);
            std::thread::sleep(within);
            return Ok(Next::Ended);
        };
        if self.steps == 0 {
            let left = time.saturating_sub(self.from.0).div_f64(self.speed);
            let wait = (self.from.1 + left).saturating_duration_since(Instant::now());
            if self.is_paused || wait > within {
                std::thread::sleep(within);
                return Ok(Next::Nothing);
            }
            std::thread::sleep(wait);
        }
        let Some((time, frame)) = self.ahead.take() else { return Ok(Next::Nothing) };
        if self.steps > 0 {
            self.steps -= 1;
            self.play_from(time);
        }
        if let Some(step) = time.checked_sub(self.at).filter(|step| !step.is_zero()) {
            self.period_s = step.as_secs_f64();
        }
        self.at = time;
        if self.given.len() == REMEMBERED {
            self.given.pop_front();
        }
        self.given.push_back(time);
        let mut moment = Moment::new(frame);
        if let Some((decoder, columns)) = &mut self.decoder {
            let pick =
                |truth: Vec<f32>| Some(columns.as_ref()?.iter().map(|it| truth[*it]).collect());
            moment.frame.truth = moment.frame.truth.take().and_then(pick);
            (moment.frame.contact_mm, moment.frame.force_n) = (None, None);
            decoder.decode(&mut moment)?;
        } else {
            let status = moment.frame.status.as_ref();
            let flag = |set: Option<bool>, flag: u8| if set == Some(true) { flag } else { 0 };
            moment.flags = flag(status.map(|it| it.is_novel), EstimateReport::NOVEL)
                | flag(status.map(|it| it.is_clamped), EstimateReport::CLAMPED);
        }
        Ok(Next::Frame(Box::new(moment)))
    }

    fn baseline(&self) -> Option<Vec<f32>> {
        self.baseline.clone()
    }

    fn zero(&mut self, readings: &[f32]) -> std::result::Result<(), String> {
        if let Some((decoder, _)) = &mut self.decoder {
            decoder.set_baseline(readings);
        }
        Ok(())
    }

    fn act(&mut self, action: Action) -> std::result::Result<String, String> {
        match action {
            Action::Pause => self.is_paused = true,
            Action::Resume => {
                if self.ahead.is_none()
                    && self.about.duration_s.is_some_and(|it| self.at.as_secs_f64() >= it - 1e-6)
                {
                    self.seek(Duration::ZERO)?;
                }
                self.play_from(self.at);
                self.is_paused = false;
            }
            Action::Seek { to_s } => {
                self.given.clear();
                let most = self.about.duration_s.unwrap_or(0.0);
                self.seek(Duration::from_secs_f64(to_s.clamp(0.0, most)))?;
            }
            Action::Speed { factor } => {
                self.play_from(self.at);
                self.speed = factor;
            }
            Action::Step { frames } => {
                self.is_paused = true;
                self.steps = 0;
                if frames < 0 {
                    self.step_back(frames.unsigned_abs() as usize)?;
                } else {
                    self.steps = frames as usize;
                }
            }
            _ => return Err("a recording cannot do that".into()),
        }
        Ok(String::new())
    }

    fn note(&self) -> Option<String> {
        let damage = self.damage.last().map(|last| {
            let count = self.damage.len();
            format!("damaged parts of the recording are left out, {count} so far, such as: {last}")
        });
        let of_decoder = self.decoder.as_ref().and_then(|(decoder, _)| decoder.note());
        let notes: Vec<String> = damage.into_iter().chain(of_decoder).collect();
        (!notes.is_empty()).then(|| notes.join("; "))
    }

    fn is_paused(&self) -> bool {
        self.is_paused
    }

    fn position(&self) -> Option<(f64, f64)> {
        Some((self.at.as_secs_f64(), self.speed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame each 10 ms, for ever; the number is of the next.
    struct Endless(u32);

    impl Still for Endless {
        fn next(&mut self) -> Result<Option<(Duration, Frame)>> {
            let time = 10 * self.0;
            self.0 += 1;
            Ok(Some((Duration::from_millis(time.into()), Frame::default())))
        }

        fn seek(&mut self, to: Duration) -> Result<()> {
            self.0 = to.as_millis() as u32 / 10;
            Ok(())
        }
    }

    #[test]
    fn another_speed_plays_on_from_where_the_replay_is() {
        let layout = sheet::layout("", vec![], vec![], None);
        let path = Path::new("endless.csv");
        let hour = Duration::from_hours(1);
        let mut feed = ReplayFeed::new(Box::new(Endless(0)), layout, path, hour, None, None);
        // Frames until this place, or so many seconds of the clock.
        let play = |feed: &mut ReplayFeed<'_>, to_s: u64, most_s: u64| {
            let start = Instant::now();
            while feed.at < Duration::from_secs(to_s) {
                assert!(start.elapsed() < Duration::from_secs(most_s), "{:?}", feed.at);
                feed.next(Duration::from_millis(50)).unwrap();
            }
        };
        feed.act(Action::Speed { factor: 1000.0 }).unwrap();
        play(&mut feed, 100, 60);
        // From the start at the speed of the clock, it would be there in 100 s.
        feed.act(Action::Speed { factor: 1.0 }).unwrap();
        play(&mut feed, 101, 50);
    }

    #[test]
    fn lines_of_a_data_file_are_replayed_at_their_times() {
        let text = "time_s,r1c1_ohm,r1c2_ohm,load_g\n5,1,2,9\n5.5,3,4,9\n6.5,5,6,9\n8,7,8,9\n";
        let path = Path::new("log.csv");
        let file =
            || DataFile::parse(path, text.as_bytes(), &taxel_data::data_file::Reading::default());
        let file = || file().unwrap();
        let clock = Clock::of(&file(), None).unwrap();
        let mut feed = ReplayFeed::of_data(file(), None, &clock, None).unwrap();
        assert_eq!((feed.about.duration_s, feed.layout.columns), (Some(3.0), 2));
        let next = |feed: &mut ReplayFeed<'_>| {
            feed.steps = 1;
            let Next::Frame(moment) = feed.next(Duration::ZERO).unwrap() else { panic!() };
            let Frame { number, time_us, readings, .. } = moment.frame;
            (number, time_us, readings)
        };
        assert_eq!(next(&mut feed), (0, 0, vec![1.0, 2.0]));
        assert_eq!(next(&mut feed), (1, 500_000, vec![3.0, 4.0]));
        for (to_s, number) in [(1.5, 2), (1.51, 3), (0.2, 1), (99.0, 3)] {
            feed.act(Action::Seek { to_s }).unwrap();
            assert_eq!(next(&mut feed).0, number, "{to_s}");
        }
        // Before what was given, a step lasts as long as the last one.
        feed.act(Action::Seek { to_s: 0.5 }).unwrap();
        assert_eq!([next(&mut feed).0, next(&mut feed).0], [1, 2]);
        feed.given.clear();
        feed.act(Action::Step { frames: -1 }).unwrap();
        assert_eq!(next(&mut feed).0, 1);
        assert_eq!(times_s(&clock, Some(10.0)), [0.0, 0.1, 0.2, 0.3]);
        assert_eq!(times_s(&clock, None), [0.0, 0.5, 1.5, 3.0]);
    }
}
