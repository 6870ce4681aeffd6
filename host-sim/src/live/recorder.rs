//! A recording of what is watched.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Instant, SystemTime};

use taxel_recording::{Extras, Frame, Layout, Replace, Writer};
use taxel_rig::scans::Scan;
use taxel_view::message as page;

use super::moment::Moment;
use super::replay::BASELINE;
use crate::{Error, Result};

/// A recording that is being written.
pub struct Recorder {
    writer: Writer,
    path: PathBuf,
    start: Instant,
    /// Number of readings of a frame.
    readings: usize,
}

/// What goes with a recording.
#[derive(Debug, Clone, Default)]
pub struct Beside {
    /// Weight blob.
    pub blob: Option<Vec<u8>>,
    /// Text of the scene.
    pub scene: Option<String>,
    /// Where the frames came from, in words.
    pub source: String,
    /// Readings of the untouched sensor.
    pub baseline: Option<Vec<f32>>,
}

impl Recorder {
    /// Begins a recording at `path`.
    ///
    /// # Errors
    /// If it cannot be written, or another file than a recording would be replaced.
    pub fn start(path: &Path, layout: &Layout, beside: Beside) -> Result<Self> {
        let mut settings = BTreeMap::from([("source".to_owned(), beside.source)]);
        if let Some(baseline) = beside.baseline {
            let numbers: Vec<String> = baseline.iter().map(f32::to_string).collect();
            settings.insert(BASELINE.to_owned(), numbers.join(","));
        }
        let extras =
            Extras { blob: beside.blob, scene: beside.scene, settings, ..Extras::default() };
        let writer = Writer::create(path, layout, &extras, SystemTime::now(), Replace::Recordings);
        let writer =
            writer.map_err(|cause| Error::failed(format!("{}: {cause}", path.display())))?;
        let readings = layout.readings.len();
        Ok(Self { writer, path: path.into(), start: Instant::now(), readings })
    }

    /// A name that is free in the current folder.
    pub fn free_path() -> PathBuf {
        let paths = (1..).map(|number| PathBuf::from(format!("recording-{number}.mcap")));
        let mut free = paths.filter(|path| !path.exists());
        free.next().unwrap_or_default()
    }

    /// Records a frame.
    ///
    /// # Errors
    /// If the disk is full, or the frame does not fit the layout.
    pub fn write(&mut self, frame: &Frame) -> Result<()> {
        let failed = |cause| Error::failed(format!("{}: {cause}", self.path.display()));
        self.writer.write(frame).map_err(failed)
    }

    /// Records a scan of a device. Readings that were lost on the line are missing.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    pub fn write_scan(&mut self, scan: &Scan) -> Result<()> {
        self.write(&Moment::of_scan(scan.clone(), self.readings).frame)
    }

    /// Makes all frames safe from a kill, if that was not done lately; call it while no frames come.
    ///
    /// # Errors
    /// If the disk is full.
    pub fn flush(&mut self) -> Result<()> {
        let failed = |cause| Error::failed(format!("{}: {cause}", self.path.display()));
        self.writer.flush().map_err(failed)
    }

    /// Its file, size and length, for the page.
    pub fn for_page(&self) -> page::Recording {
        page::Recording {
            file: self.path.display().to_string(),
            bytes: self.writer.bytes(),
            seconds: self.start.elapsed().as_secs_f64(),
        }
    }

    /// Ends the recording. Returns what it is, in words.
    ///
    /// # Errors
    /// If its end cannot be written.
    pub fn finish(self) -> Result<String> {
        let (path, seconds) = (self.path, self.start.elapsed().as_secs_f64());
        let failed = |cause| Error::failed(format!("{}: {cause}", path.display()));
        self.writer.finish().map_err(failed)?;
        Ok(format!("{}, {seconds:.1} s", path.display()))
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use taxel_firmware::link::message::EstimateReport;
    use taxel_recording::{Reader, Status};

    use super::super::feed::{Feed, Next};
    use super::super::{replay::ReplayFeed, sheet};
    use super::*;

    #[test]
    fn a_recording_is_replayed_with_baseline_truth_and_status() {
        let columns = |names: &[&str]| sheet::columns(names.iter().copied(), []);
        let layout = sheet::layout("", columns(&["a", "b"]), columns(&["x_mm", "load_n"]), None);
        let folder = std::env::temp_dir().join(format!("taxel-recorder-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("it.mcap");
        let beside = Beside { baseline: Some(vec![7.5, 0.1]), ..Beside::default() };
        let mut recorder = Recorder::start(&path, &layout, beside).unwrap();
        let status = |is_novel| Status { is_novel, is_clamped: !is_novel, ..Status::default() };
        for number in 0..3_u8 {
            let at = f32::from(number);
            let frame = Frame {
                time_us: 250_000 * u64::from(number),
                number: number.into(),
                readings: vec![at, 10.0 + at],
                outputs: Some(vec![0.5 * at, 2.0]),
                truth: Some(vec![at, 4.0]),
                status: Some(status(number == 1)),
                ..Frame::default()
            };
            recorder.write(&frame).unwrap();
        }
        assert_eq!(recorder.for_page().file, path.display().to_string());
        recorder.finish().unwrap();
        let reader = Reader::open(&path).unwrap();
        let mut feed = ReplayFeed::of_recording(reader, &path, None).unwrap();
        assert_eq!(feed.baseline(), Some(vec![7.5, 0.1]));
        assert_eq!(feed.about().duration_s, Some(0.5));
        let flags = [EstimateReport::CLAMPED, EstimateReport::NOVEL, EstimateReport::CLAMPED];
        for (number, flags) in (0..3_u8).zip(flags) {
            let Next::Frame(moment) = feed.next(Duration::from_secs(9)).unwrap() else { panic!() };
            let at = f32::from(number);
            assert_eq!((moment.flags, moment.frame.readings), (flags, vec![at, 10.0 + at]));
            assert_eq!(moment.frame.outputs, Some(vec![0.5 * at, 2.0]));
            assert_eq!(moment.frame.truth, Some(vec![at, 4.0]));
            assert_eq!(feed.position().map(|it| it.1), Some(1.0));
        }
        assert!(matches!(feed.next(Duration::ZERO).unwrap(), Next::Ended));
        std::fs::remove_dir_all(folder).unwrap();
    }
}
