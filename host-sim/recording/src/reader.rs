//! A recording that is read frame by frame.

use std::fs::File;
use std::io::{Read, Seek};
use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use crate::chunk::{Chunk, Message};
use crate::diagnostics::read_diagnostics;
use crate::error::{Error, Result};
use crate::file::{BLOB, Contents, LAYOUT, PARENT, SCENE, SETTINGS, START, Source};
use crate::frame::{Frame, Status};
use crate::layout::{Extras, Layout};
use crate::message;
use crate::topic::Topic;

/// A recording, whose frames it gives one after the other, as they stand in the file. It holds one chunk in memory: at most
/// 8 MiB, and 16 bytes for each other chunk of the file.
///
/// A part that is damaged is an error of its own; frames after it follow.
pub struct Reader<S = File> {
    pub(crate) source: Source<S>,
    pub(crate) contents: Contents,
    pub(crate) layout: Layout,
    pub(crate) start_ns: u64,
    pub(crate) parent_frame: String,
    free_outputs: Vec<usize>,
    was_cut: bool,
    chunk: Option<Chunk>,
    /// Place of the next chunk among all.
    next_chunk: usize,
    /// Number of chunks, from the first, whose channels are known.
    learnt_chunks: usize,
    /// Frame that waits for its parts, with its time.
    frame: Option<(u64, Frame)>,
    status: Option<Status>,
    /// Time of frames that are passed over.
    from_ns: u64,
    at_ns: u64,
}

impl Reader<File> {
    /// Opens the recording at `path`.
    ///
    /// # Errors
    /// [`Error::Foreign`] if it is none; [`Error::OtherFormat`], [`Error::Read`]. One that was cut is none.
    pub fn open(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(Error::Read)?;
        // A pipe has no place to go back to, and a folder no bytes.
        if !file.metadata().map_err(Error::Read)?.is_file() {
            return Err(Error::Foreign("bytes: it is not a file".into()));
        }
        Self::new(file)
    }
}

impl<S: Read + Seek> Reader<S> {
    /// Reads the recording in `source`.
    ///
    /// # Errors
    /// As [`open`](Reader::open).
    pub fn new(source: S) -> Result<Self> {
        let mut source = Source::new(source)?;
        let (contents, was_cut) = source.contents()?;
        let lacks = || Error::Foreign(format!("a metadata record {LAYOUT:?}"));
        let texts = source.metadata(&contents, LAYOUT)?.ok_or_else(lacks)?;
        let layout = Layout::from_texts(&texts)?;
        let start_ns = texts.get(START).and_then(|text| text.parse().ok());
        let start_ns =
            start_ns.ok_or_else(|| Error::Foreign(format!("{START:?} in its metadata")))?;
        let parent_frame = texts.get(PARENT).cloned().unwrap_or(Extras::default().parent_frame);
        let learnt_chunks = if contents.channels.is_empty() { 0 } else { contents.chunks.len() };
        Ok(Self {
            source,
            free_outputs: layout.free_outputs(),
            layout,
            start_ns,
            parent_frame,
            was_cut,
            chunk: None,
            next_chunk: 0,
            learnt_chunks,
            contents,
            frame: None,
            status: None,
            from_ns: 0,
            at_ns: start_ns,
        })
    }

    /// Layout of the frames.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// What goes with the frames.
    ///
    /// # Errors
    /// [`Error::Damaged`] or [`Error::TooMany`] for a part that cannot be read.
    pub fn extras(&mut self) -> Result<Extras> {
        let scene = self.source.attachment(&self.contents, SCENE)?.map(String::from_utf8);
        let scene = scene.transpose().map_err(|_| Error::Foreign("a scene in UTF-8".into()))?;
        let extras = Extras {
            blob: self.source.attachment(&self.contents, BLOB)?,
            scene,
            settings: self.source.metadata(&self.contents, SETTINGS)?.unwrap_or_default(),
            parent_frame: self.parent_frame.clone(),
        };
        extras.check()?;
        Ok(extras)
    }

    /// Time when the first frame was taken.
    pub fn start(&self) -> SystemTime {
        UNIX_EPOCH + Duration::from_nanos(self.start_ns)
    }

    /// Time from the first frame to the last.
    pub fn duration(&self) -> Duration {
        let last = self.contents.chunks.iter().map(|chunk| chunk.last_ns).max();
        self.since_start(last.unwrap_or(self.start_ns))
    }

    /// Whether the file has no end, since whoever wrote it was killed: [`recover`](crate::recover) mends it. It is read as far
    /// as its chunks are whole.
    pub fn was_cut(&self) -> bool {
        self.was_cut
    }

    /// Time of the last frame that was given, since the first one.
    pub fn position(&self) -> Duration {
        self.since_start(self.at_ns)
    }

    fn since_start(&self, ns: u64) -> Duration {
        Duration::from_nanos(ns.saturating_sub(self.start_ns))
    }

    /// Goes to the first frame at `since_start` or after it. In a file without a summary, all chunks before it are read.
    ///
    /// # Errors
    /// [`Error::Read`]. Chunks before it that are damaged are passed over.
    pub fn seek(&mut self, since_start: Duration) -> Result<()> {
        let since_start = u64::try_from(since_start.as_nanos()).unwrap_or(u64::MAX);
        self.from_ns = self.start_ns.saturating_add(since_start);
        let chunks = &self.contents.chunks;
        let found = chunks.iter().position(|chunk| chunk.last_ns >= self.from_ns);
        self.next_chunk = found.unwrap_or(chunks.len());
        (self.chunk, self.frame, self.status) = (None, None, None);
        for chunk in self.learnt_chunks..self.next_chunk {
            match self.learn_channels(self.contents.chunks[chunk].at) {
                Err(Error::Read(cause)) => return Err(Error::Read(cause)),
                _ => self.learnt_chunks = chunk + 1,
            }
        }
        Ok(())
    }

    fn learn_channels(&mut self, chunk: u64) -> Result<()> {
        let mut chunk = self.source.chunk(chunk)?;
        while chunk.message(&mut self.contents.channels)?.is_some() {}
        Ok(())
    }

    /// Reads to the next frame that is whole.
    fn read(&mut self) -> Result<Option<(u64, Frame)>> {
        loop {
            if self.chunk.is_none() {
                let Some(place) = self.contents.chunks.get(self.next_chunk) else {
                    return Ok(self.frame.take());
                };
                self.next_chunk += 1;
                self.chunk = Some(self.source.chunk(place.at)?);
            }
            let Some(chunk) = &mut self.chunk else { continue };
            let at = chunk.at;
            let Some(message) = chunk.message(&mut self.contents.channels)? else {
                self.chunk = None;
                self.learnt_chunks = self.learnt_chunks.max(self.next_chunk);
                continue;
            };
            let unfit = |message: &Message<'_>| {
                let (topic, number) = (message.topic.name(), message.number);
                Error::damaged(
                    at,
                    format!("the message of frame {number} on {topic} does not fit the layout"),
                )
            };
            if message.topic == Topic::Readings {
                let readings = message::read_image(message.data, &self.layout);
                let readings = readings.ok_or_else(|| unfit(&message))?;
                let (time_us, number, status) =
                    (message.device_ns / 1000, message.number, self.status.clone());
                let frame = Frame { time_us, number, readings, status, ..Frame::default() };
                if let Some(whole) = self.frame.replace((message.ns, frame)) {
                    return Ok(Some(whole));
                }
            } else if let Some((_, frame)) = &mut self.frame
                && frame.number == message.number
            {
                let part = add(frame, &message, &self.layout, &self.free_outputs);
                part.ok_or_else(|| unfit(&message))?;
                if message.topic == Topic::Diagnostics && frame.status.is_some() {
                    self.status.clone_from(&frame.status);
                }
            }
        }
    }
}

/// Adds a part to its frame; `None` if it does not fit the layout.
fn add(
    frame: &mut Frame,
    part: &Message<'_>,
    layout: &Layout,
    free_outputs: &[usize],
) -> Option<()> {
    let data = part.data;
    match part.topic {
        Topic::Points | Topic::Truth | Topic::Outputs | Topic::TrueOutputs => {
            let missing = || vec![f32::NAN; layout.outputs.len()];
            let is_true = matches!(part.topic, Topic::Truth | Topic::TrueOutputs);
            let outputs = if is_true { &mut frame.truth } else { &mut frame.outputs };
            let outputs = outputs.get_or_insert_with(missing);
            let mut deviations = frame.deviations.take().unwrap_or_default();
            let had_deviations = !deviations.is_empty();
            deviations.resize(layout.outputs.len(), f32::NAN);
            let has_deviations = if matches!(part.topic, Topic::Points | Topic::Truth) {
                message::read_points(data, layout, outputs, &mut deviations)?
            } else {
                message::read_array(data, free_outputs, outputs, &mut deviations)?
            };
            if had_deviations || has_deviations && !is_true {
                frame.deviations = Some(deviations);
            }
        }
        Topic::Contact => frame.contact_mm = Some(message::read_point(data, layout.surface_mm())?),
        Topic::Wrench => frame.force_n = Some(message::read_wrench(data)?),
        Topic::Events => frame.events.push(message::read_text(data)?),
        Topic::Diagnostics => {
            let mut status = None;
            read_diagnostics(data, &mut status)?;
            if let Some(status) = status {
                frame.status = Some(status).filter(|status| status.fits(layout));
                frame.status.as_ref()?;
            }
        }
        Topic::Readings | Topic::Transform => {}
    }
    Some(())
}

impl<S: Read + Seek> Iterator for Reader<S> {
    type Item = Result<Frame>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            match self.read().transpose()? {
                Ok((ns, _)) if ns < self.from_ns => {}
                Ok((ns, frame)) => {
                    self.at_ns = ns;
                    return Some(Ok(frame));
                }
                Err(error) => return Some(Err(error)),
            }
        }
    }
}
