//! Chunks of messages, and the channels that these belong to, of any bytes.

use std::collections::HashMap;

use crate::bytes::Bytes;
use crate::error::{Error, Result};
use crate::record::{HEAD, kind};
use crate::topic::{ENCODING, LANGUAGE, Topic};

/// Topics of channels, by their numbers.
#[derive(Debug, Default)]
pub struct Channels {
    /// Types of the schemas that topics of a recording have.
    kinds: HashMap<u16, &'static str>,
    topics: HashMap<u16, Topic>,
}

impl Channels {
    /// Topic of a channel, if it is one of a recording.
    pub fn topic(&self, channel: u16) -> Option<Topic> {
        self.topics.get(&channel).copied()
    }

    /// Whether there are any.
    pub fn is_empty(&self) -> bool {
        self.topics.is_empty()
    }

    /// Learns what a record tells of channels.
    ///
    /// # Errors
    /// [`Error::Foreign`] if a topic of a recording has messages of another type.
    pub fn learn(&mut self, kind: u8, body: &[u8], at: u64) -> Result<()> {
        let mut bytes = Bytes::record(body);
        let learnt = match kind {
            kind::SCHEMA => self.learn_schema(&mut bytes).map(Ok),
            kind::CHANNEL => self.learn_channel(&mut bytes),
            _ => Some(Ok(())),
        };
        learnt.unwrap_or_else(|| Err(Error::damaged(at, "it is neither a channel nor a schema")))
    }

    fn learn_schema(&mut self, bytes: &mut Bytes<'_>) -> Option<()> {
        let (number, name, language) = (bytes.u16()?, bytes.text()?, bytes.text()?);
        let topic = Topic::ALL.into_iter().find(|topic| topic.kind() == name);
        match topic.filter(|_| language == LANGUAGE) {
            Some(topic) => self.kinds.insert(number, topic.kind()),
            None => self.kinds.remove(&number),
        };
        Some(())
    }

    fn learn_channel(&mut self, bytes: &mut Bytes<'_>) -> Option<Result<()>> {
        let (number, schema) = (bytes.u16()?, bytes.u16()?);
        let (name, encoding) = (bytes.text()?, bytes.text()?);
        self.topics.remove(&number);
        let Some(topic) = Topic::ALL.into_iter().find(|topic| topic.name() == name) else {
            return Some(Ok(()));
        };
        if encoding == ENCODING && self.kinds.get(&schema) == Some(&topic.kind()) {
            self.topics.insert(number, topic);
        } else if name.starts_with("/taxel/") {
            let lacks = format!("messages of type {} in CDR on topic {name}", topic.kind());
            return Some(Err(Error::Foreign(lacks)));
        }
        Some(Ok(()))
    }
}

/// Message of a topic of a recording.
#[derive(Debug, Clone, Copy)]
pub struct Message<'c> {
    pub topic: Topic,
    pub number: u32,
    /// Time by the wall clock, in ns since 1970.
    pub ns: u64,
    /// Time by the device's clock, in ns.
    pub device_ns: u64,
    pub data: &'c [u8],
}

/// Chunk of messages.
#[derive(Debug)]
pub struct Chunk {
    /// First byte of its record in the file.
    pub at: u64,
    body: Vec<u8>,
    /// Place in the body of the next record.
    next: usize,
}

impl Chunk {
    /// Chunk of a record's `body`.
    ///
    /// # Errors
    /// [`Error::Compressed`]; [`Error::Damaged`] if it is not as it was written.
    pub fn parse(at: u64, body: Vec<u8>) -> Result<Self> {
        let damaged = |what| Error::damaged(at, what);
        let read = || {
            let mut bytes = Bytes::record(&body);
            bytes.take(16)?;
            let (length, crc) = (bytes.u64()?, bytes.u32()?);
            let compression = bytes.text()?;
            let stored = bytes.u64()?;
            Some((length, crc, compression, stored, bytes.rest()))
        };
        let (length, crc, compression, stored, data) =
            read().ok_or_else(|| damaged("it is not a chunk"))?;
        if !compression.is_empty() {
            return Err(Error::Compressed(compression.chars().take(20).collect()));
        }
        if length != stored || stored != data.len() as u64 {
            return Err(damaged("the chunk's lengths differ"));
        }
        if crc != 0 && crc != crc32fast::hash(data) {
            return Err(damaged("the chunk's checksum differs"));
        }
        let next = body.len() - data.len();
        Ok(Self { at, body, next })
    }

    /// Next message of a recording's topic; `None` at the end. Learns `channels` on the way.
    pub fn message(&mut self, channels: &mut Channels) -> Result<Option<Message<'_>>> {
        let at = self.at;
        loop {
            let mut bytes = Bytes::record(&self.body[self.next..]);
            if bytes.rest().is_empty() {
                return Ok(None);
            }
            let mut record = || {
                let (kind, length) = (bytes.u8()?, bytes.u64()?);
                Some((kind, bytes.take(usize::try_from(length).ok()?)?))
            };
            let Some((kind, body)) = record() else {
                self.next = self.body.len();
                return Err(Error::damaged(at, "a record in the chunk has no end"));
            };
            self.next += HEAD as usize + body.len();
            if kind != kind::MESSAGE {
                channels.learn(kind, body, at)?;
                continue;
            }
            let mut bytes = Bytes::record(body);
            let mut header = || Some((bytes.u16()?, bytes.u32()?, bytes.u64()?, bytes.u64()?));
            let Some((channel, number, ns, device_ns)) = header() else {
                return Err(Error::damaged(at, "a message in the chunk has no header"));
            };
            if let Some(topic) = channels.topic(channel) {
                // Found once more, since what is lent cannot be returned from a loop.
                let data = &self.body[self.next - bytes.rest().len()..self.next];
                return Ok(Some(Message { topic, number, ns, device_ns, data }));
            }
        }
    }
}
