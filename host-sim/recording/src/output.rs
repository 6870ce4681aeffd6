//! Records and messages of a recording that is being written.

use std::io::Write;

use crate::error::{Result, at_most};
use crate::file::{BLOB, LAYOUT, MOST_CHUNKS, PARENT, SCENE, SETTINGS, START};
use crate::layout::{Extras, Layout};
use crate::mcap::Mcap;
use crate::topic::{ENCODING, LANGUAGE, Topic};

/// Recording that is being written to `W`.
pub struct Output<W: Write> {
    file: Mcap<W>,
    channels: [Option<u16>; Topic::ALL.len()],
}

impl<W: Write> Output<W> {
    /// Begins a recording of `start_ns` (since 1970).
    pub fn new(to: W, layout: &Layout, extras: &Extras, start_ns: u64) -> Result<Self> {
        let mut file = Mcap::new(to, "ros2", "taxel")?;
        let mut texts = layout.to_texts();
        texts.insert(START.into(), start_ns.to_string());
        texts.insert(PARENT.into(), extras.parent_frame.clone());
        file.metadata(LAYOUT, &texts)?;
        if !extras.settings.is_empty() {
            file.metadata(SETTINGS, &extras.settings)?;
        }
        if let Some(blob) = &extras.blob {
            file.attach(BLOB, "application/octet-stream", start_ns, blob)?;
        }
        if let Some(scene) = &extras.scene {
            file.attach(SCENE, "application/toml", start_ns, scene.as_bytes())?;
        }
        file.flush()?;
        Ok(Self { file, channels: [None; Topic::ALL.len()] })
    }

    /// Adds a message. The time of the device's clock is its time of publication.
    pub fn put(&mut self, topic: Topic, sequence: u32, ns: u64, device_ns: u64, data: &[u8]) {
        // No `offered_qos_profiles`: readers refuse those that are not complete.
        let channel = *self.channels[topic as usize].get_or_insert_with(|| {
            let definition = topic.definition();
            self.file.add_channel(topic.name(), ENCODING, topic.kind(), LANGUAGE, &definition)
        });
        self.file.add_message(channel, sequence, ns, device_ns, data);
    }

    /// Bytes of the chunk that is not written yet.
    pub fn pending_bytes(&self) -> usize {
        self.file.pending_bytes()
    }

    /// Ends the chunk, and passes its bytes on. Nothing else ends one, so that all of a frame's messages are in one.
    pub fn end_chunk(&mut self) -> Result<()> {
        let chunks = self.file.chunk_count() + u32::from(self.pending_bytes() > 0);
        at_most(MOST_CHUNKS as u64, chunks.into(), "parts of a recording")?;
        self.file.flush()
    }

    /// Ends the recording.
    pub fn finish(self) -> Result<W> {
        self.file.finish()
    }
}
