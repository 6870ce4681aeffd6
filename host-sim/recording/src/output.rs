//! Records and messages of a recording that is being written.

use std::collections::BTreeMap;
use std::io::Write;

use mcap::WriteOptions;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;

use crate::error::{Result, at_most};
use crate::file::{BLOB, LAYOUT, MOST_CHUNKS, PARENT, SCENE, SETTINGS, START};
use crate::layout::{Extras, Layout};
use crate::topic::{ENCODING, LANGUAGE, Topic};

/// Recording that is being written to `W`.
pub struct Output<W: Write> {
    records: mcap::Writer<NoSeek<W>>,
    channels: [Option<u16>; Topic::ALL.len()],
    /// Bytes of the chunk that is not written yet.
    pub pending_bytes: usize,
    chunks: usize,
}

impl<W: Write> Output<W> {
    /// Begins a recording of `start_ns` (since 1970).
    pub fn new(to: W, layout: &Layout, extras: &Extras, start_ns: u64) -> Result<Self> {
        // Chunks are written whole: what a kill leaves ends with a whole one. They end by `end_chunk` alone, so that all of a
        // frame's messages are in one.
        let options = WriteOptions::new().profile("ros2").library("taxel").chunk_size(None);
        let mut records = options.disable_seeking(true).create(NoSeek::new(to))?;
        let mut texts = layout.to_texts();
        texts.insert(START.into(), start_ns.to_string());
        texts.insert(PARENT.into(), extras.parent_frame.clone());
        records.write_metadata(&Metadata { name: LAYOUT.into(), metadata: texts })?;
        if !extras.settings.is_empty() {
            records.write_metadata(&Metadata {
                name: SETTINGS.into(),
                metadata: extras.settings.clone(),
            })?;
        }
        let blob = extras.blob.as_deref().map(|blob| (BLOB, "application/octet-stream", blob));
        let scene =
            extras.scene.as_deref().map(|scene| (SCENE, "application/toml", scene.as_bytes()));
        for (name, media_type, data) in [blob, scene].into_iter().flatten() {
            records.attach(&mcap::Attachment {
                log_time: start_ns,
                create_time: start_ns,
                name: name.into(),
                media_type: media_type.into(),
                data: data.into(),
            })?;
        }
        records.flush()?;
        Ok(Self { records, channels: [None; Topic::ALL.len()], pending_bytes: 0, chunks: 0 })
    }

    /// Writes a message. The time of the device's clock is its time of publication.
    pub fn put(
        &mut self,
        topic: Topic,
        sequence: u32,
        log_time: u64,
        publish_time: u64,
        data: &[u8],
    ) -> Result<()> {
        let channel_id = self.channel(topic)?;
        let header = MessageHeader { channel_id, sequence, log_time, publish_time };
        self.pending_bytes += data.len();
        Ok(self.records.write_to_known_channel(&header, data)?)
    }

    /// Channel of a topic, which begins with its first message.
    fn channel(&mut self, topic: Topic) -> Result<u16> {
        if let Some(channel) = self.channels[topic as usize] {
            return Ok(channel);
        }
        let definition = topic.definition();
        let schema = self.records.add_schema(topic.kind(), LANGUAGE, definition.as_bytes())?;
        // No `offered_qos_profiles`: readers refuse those that are not complete.
        let channel = self.records.add_channel(schema, topic.name(), ENCODING, &BTreeMap::new())?;
        self.channels[topic as usize] = Some(channel);
        Ok(channel)
    }

    /// Ends the chunk, and passes its bytes on.
    pub fn end_chunk(&mut self) -> Result<()> {
        if self.pending_bytes > 0 {
            self.chunks += 1;
            at_most(MOST_CHUNKS as u64, self.chunks as u64, "parts of a recording")?;
        }
        self.pending_bytes = 0;
        Ok(self.records.flush()?)
    }

    /// Ends the recording.
    pub fn finish(mut self) -> Result<W> {
        self.records.finish()?;
        Ok(self.records.into_inner().into_inner())
    }
}
