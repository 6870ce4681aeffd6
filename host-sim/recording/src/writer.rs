//! A recording that is written while it happens.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crate::diagnostics::diagnostics;
use crate::error::{Error, Result};
use crate::frame::{Frame, Status};
use crate::layout::{Extras, Layout};
use crate::message;
use crate::output::Output;
use crate::reader::Reader;
use crate::topic::Topic;

/// Longest time that a frame waits until it is safe from a kill and from loss of power, while frames come.
const FLUSH: Duration = Duration::from_millis(500);
/// Size of a chunk that is written at once, and of one that may be shorter than [`FLUSH`] in the recording's time.
const CHUNK_BYTES: usize = 1 << 20;
const LEAST_CHUNK_BYTES: usize = 1 << 14;
/// Longest time between two messages about the state of the wires.
const STATUS_NS: u64 = 1_000_000_000;

/// Which existing files a recording may replace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Replace {
    /// Earlier recordings.
    Recordings,
    /// Any file.
    AnyFile,
}

/// A recording that is being written, under its own name. Dropping it ends it as [`finish`](Self::finish) does, without
/// telling of failures. A kill leaves what was written up to half a second before, for [`recover`](crate::recover).
pub struct Writer {
    output: Output<BufWriter<File>>,
    /// The same file, for what the writer of records cannot do.
    file: File,
    layout: Layout,
    free_outputs: Vec<usize>,
    parent_frame: String,
    /// Time by the wall clock, and by the device's in µs, of the last frame.
    last: Option<(u64, u64)>,
    start_ns: u64,
    status: Option<(Status, u64)>,
    flushed: Instant,
    /// Time by the wall clock of the first frame in the chunk.
    chunk_ns: u64,
}

impl Writer {
    /// Begins a recording at `path`, whose first frame was taken at `start`. The file is locked: it is not recovered, nor
    /// recorded over, until it is finished.
    ///
    /// # Errors
    /// [`Error::Layout`] or [`Error::TooMany`] for a layout or extras that cannot be recorded, before any file is touched;
    /// [`Error::NotReplaced`], [`Error::InUse`], [`Error::Write`].
    pub fn create(
        path: &Path,
        layout: &Layout,
        extras: &Extras,
        start: SystemTime,
        replace: Replace,
    ) -> Result<Self> {
        layout.check()?;
        extras.check()?;
        let since_1970 = start.duration_since(UNIX_EPOCH).unwrap_or_default();
        let start_ns = u64::try_from(since_1970.as_nanos()).unwrap_or(u64::MAX);
        // Whatever is no recording, empty files apart, is kept.
        if replace == Replace::Recordings
            && path.metadata().is_ok_and(|found| found.len() > 0 || !found.is_file())
            && Reader::open(path).is_err()
        {
            return Err(Error::NotReplaced(path.into()));
        }
        let file = OpenOptions::new().write(true).create(true).truncate(false).open(path);
        let file = file.map_err(Error::Write)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(Error::InUse(path.into())),
            // Not every file system has locks.
            Ok(()) | Err(TryLockError::Error(_)) => {}
        }
        file.set_len(0).map_err(Error::Write)?;
        let to = BufWriter::new(file.try_clone().map_err(Error::Write)?);
        let output = Output::new(to, layout, extras, start_ns)?;
        file.sync_all().map_err(Error::Write)?;
        Ok(Self {
            output,
            file,
            free_outputs: layout.free_outputs(),
            layout: layout.clone(),
            parent_frame: extras.parent_frame.clone(),
            last: None,
            start_ns,
            status: None,
            flushed: Instant::now(),
            chunk_ns: start_ns,
        })
    }

    /// Writes a frame.
    ///
    /// # Errors
    /// [`Error::Frame`] if it does not fit the layout, and nothing is written then. After [`Error::Write`] no more can be
    /// written; what the file holds can be recovered.
    pub fn write(&mut self, frame: &Frame) -> Result<()> {
        frame.check(&self.layout)?;
        let Some(device_ns) = frame.time_us.checked_mul(1000) else {
            let (number, rule) = (frame.number, "is after 584 years".into());
            return Err(Error::Frame { number, field: "time_us", rule });
        };
        // A device that starts anew counts from 0 again; the wall clock never goes back.
        let ns = match self.last {
            None => self.start_ns,
            Some((ns, last_ns)) => ns.saturating_add(device_ns.saturating_sub(last_ns)),
        };
        let is_first = self.last.replace((ns, device_ns)).is_none();
        let layout = &self.layout;
        let mut put =
            |topic, data: Vec<u8>| self.output.put(topic, frame.number, ns, device_ns, &data);
        put(Topic::Readings, message::image(ns, layout, &frame.readings));
        let decoded = (&frame.outputs, frame.deviations.as_deref(), Topic::Points, Topic::Outputs);
        let truth = (&frame.truth, None, Topic::Truth, Topic::TrueOutputs);
        for (outputs, deviations, points, array) in [decoded, truth] {
            let Some(outputs) = outputs else { continue };
            if self.free_outputs.len() < layout.outputs.len() {
                put(points, message::points(ns, layout, outputs, deviations));
            }
            // An empty one tells that there are outputs: none at all.
            if !self.free_outputs.is_empty() || layout.outputs.is_empty() {
                put(array, message::array(layout, &self.free_outputs, outputs, deviations));
            }
        }
        let surface_mm = layout.surface_mm();
        if let Some(contact_mm) = frame.contact_mm {
            put(Topic::Contact, message::point(ns, contact_mm, surface_mm));
        }
        if let Some(force_n) = frame.force_n {
            put(Topic::Wrench, message::wrench(ns, frame.contact_mm, surface_mm, force_n));
        }
        for event in &frame.events {
            put(Topic::Events, message::text(event));
        }
        if let Some(status) = &frame.status {
            let is_said = self
                .status
                .as_ref()
                .is_some_and(|(last, at)| last == status && ns - at < STATUS_NS);
            if !is_said {
                put(Topic::Diagnostics, diagnostics(ns, &layout.title, status));
                self.status = Some((status.clone(), ns));
            }
        }
        if is_first {
            put(Topic::Transform, message::transform(ns, &self.parent_frame));
        }
        let (bytes, time_ns) = (self.output.pending_bytes(), ns - self.chunk_ns);
        let is_long = u128::from(time_ns) >= FLUSH.as_nanos() && bytes >= LEAST_CHUNK_BYTES;
        if self.flushed.elapsed() >= FLUSH {
            self.flush()?;
        } else if is_long || bytes >= CHUNK_BYTES {
            self.end_chunk()?;
        }
        Ok(())
    }

    /// Makes all frames safe from a kill and from loss of power. [`write`](Self::write) does so every half second; call it if
    /// no more frames come for a while.
    ///
    /// # Errors
    /// [`Error::Write`], as for [`write`](Self::write).
    pub fn flush(&mut self) -> Result<()> {
        self.end_chunk()?;
        self.flushed = Instant::now();
        self.file.sync_data().map_err(Error::Write)
    }

    fn end_chunk(&mut self) -> Result<()> {
        self.chunk_ns = self.last.map_or(self.start_ns, |(ns, _)| ns);
        // Each chunk tells the state of the wires anew, for those who begin to read at it.
        self.status = None;
        self.output.end_chunk()
    }

    /// Size of the file so far, in bytes. Frames of the last half second may not be in it.
    pub fn bytes(&self) -> u64 {
        self.file.metadata().map_or(0, |found| found.len())
    }

    /// Ends the recording, and makes it safe from loss of power.
    ///
    /// # Errors
    /// [`Error::Write`]; what the file holds can be recovered.
    pub fn finish(self) -> Result<()> {
        let mut to = self.output.finish()?;
        to.flush().map_err(Error::Write)?;
        self.file.sync_all().map_err(Error::Write)
    }
}
