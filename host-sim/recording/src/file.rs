//! Records of an MCAP file of any bytes, in bounded memory: where a recording's parts are, and chunks of messages.
//!
//! A record is a byte that tells its kind, the length of its body in eight bytes, and the body.

use std::collections::{BTreeMap, HashMap};
use std::io::{BufReader, Read, Seek, SeekFrom};

use crate::bytes::Bytes;
use crate::error::{Error, Result, at_most};
use crate::layout::{MOST_BLOB_BYTES, MOST_COLUMNS, MOST_SCENE_BYTES, MOST_TEXT_BYTES};
use crate::topic::{ENCODING, LANGUAGE, Topic};

/// Metadata record with the layout, and that with further settings.
pub const LAYOUT: &str = "taxel";
pub const SETTINGS: &str = "taxel-settings";
/// Name, in the layout's record, of the time when the recording began, in ns since 1970.
pub const START: &str = "start_ns";
/// Name there of the frame of ROS that the sensor's stands in.
pub const PARENT: &str = "parent_frame";
/// Attachments: the weight blob, and the scene.
pub const BLOB: &str = "model.bin";
pub const SCENE: &str = "scene.toml";

/// Largest size of a chunk: one of the largest layout's frames, and what may stand before it.
const MOST_CHUNK_BYTES: u64 = 8 << 20;
/// Largest number of chunks: three days with two a second.
pub const MOST_CHUNKS: usize = 1 << 19;
/// Largest size of names beside the data of a record.
const MOST_NAME_BYTES: u64 = 64 << 10;

const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";
/// Bytes before a record's body.
const HEAD: u64 = 9;
/// Bytes of the footer's record.
const FOOTER_BYTES: u64 = HEAD + 20;

mod kind {
    pub const FOOTER: u8 = 2;
    pub const SCHEMA: u8 = 3;
    pub const CHANNEL: u8 = 4;
    pub const MESSAGE: u8 = 5;
    pub const CHUNK: u8 = 6;
    pub const CHUNK_INDEX: u8 = 8;
    pub const ATTACHMENT: u8 = 9;
    pub const ATTACHMENT_INDEX: u8 = 10;
    pub const METADATA: u8 = 12;
    pub const METADATA_INDEX: u8 = 13;
    pub const DATA_END: u8 = 15;
}

/// Place of a chunk in the file.
#[derive(Debug, Clone, Copy)]
pub struct ChunkPlace {
    /// First byte of its record.
    pub at: u64,
    /// Time of its latest message, in ns.
    pub last_ns: u64,
}

/// What a recording holds, and where.
#[derive(Debug, Default)]
pub struct Contents {
    /// Chunks, as they stand in the file.
    pub chunks: Vec<ChunkPlace>,
    /// Metadata records and attachments by name, with their first bytes. Others than a recording's are left out.
    parts: BTreeMap<&'static str, u64>,
    /// Channels, as far as they are known without reading chunks.
    pub channels: Channels,
    /// First byte after the last whole record; the file's length if no more was to follow.
    pub whole_bytes: u64,
}

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
    fn learn(&mut self, kind: u8, body: &[u8], at: u64) -> Result<()> {
        let mut bytes = Bytes::record(body);
        let learnt = match kind {
            kind::SCHEMA => self.learn_schema(&mut bytes).map(Ok),
            kind::CHANNEL => self.learn_channel(&mut bytes),
            _ => Some(Ok(())),
        };
        learnt.unwrap_or_else(|| Err(Error::damaged(at, "it is no channel and no schema")))
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

/// File that is read piece by piece.
pub struct Source<S> {
    bytes: BufReader<S>,
    at: u64,
    /// Length of the file.
    pub length: u64,
}

impl<S: Read + Seek> Source<S> {
    pub fn new(mut source: S) -> Result<Self> {
        let length = source.seek(SeekFrom::End(0)).map_err(Error::Read)?;
        source.rewind().map_err(Error::Read)?;
        Ok(Self { bytes: BufReader::new(source), at: 0, length })
    }

    /// Goes to a byte of the file.
    fn go(&mut self, at: u64) -> Result<()> {
        let by = at.cast_signed().wrapping_sub(self.at.cast_signed());
        self.bytes.seek_relative(by).map_err(Error::Read)?;
        self.at = at;
        Ok(())
    }

    /// Reads the next bytes. What is allocated is no more than the file has.
    fn read(&mut self, count: u64) -> Result<Vec<u8>> {
        if count > self.length.saturating_sub(self.at) {
            return Err(Error::damaged(self.at, "the file ends before this part does"));
        }
        let mut bytes = vec![0; count as usize];
        self.bytes.read_exact(&mut bytes).map_err(Error::Read)?;
        self.at += count;
        Ok(bytes)
    }

    /// Kind of the record at `at`, and the length of its body; `None` if it is not whole before `end`. Goes to its body.
    fn head(&mut self, at: u64, end: u64) -> Result<Option<(u8, u64)>> {
        if end.saturating_sub(at) < HEAD {
            return Ok(None);
        }
        self.go(at)?;
        let head = self.read(HEAD)?;
        let mut bytes = Bytes::record(&head);
        let (Some(kind), Some(length)) = (bytes.u8(), bytes.u64()) else { return Ok(None) };
        // No record is of kind 0: those are bytes that the file system has not written.
        let is_whole = kind != 0 && length <= end - at - HEAD;
        Ok(is_whole.then_some((kind, length)))
    }

    /// Body of the record of this `kind` at `at`.
    fn body(&mut self, at: u64, kind: u8, most: u64, what: &'static str) -> Result<Vec<u8>> {
        match self.head(at, self.length)? {
            Some((found, length)) if found == kind => {
                at_most(most, length, what)?;
                self.read(length)
            }
            _ => Err(Error::damaged(at, "another record should be here")),
        }
    }

    /// Whether the file has an end, and the first byte of its summary (0 if there is none).
    ///
    /// # Errors
    /// [`Error::Foreign`] if it does not begin as MCAP does.
    fn footer(&mut self) -> Result<Option<u64>> {
        let magic = MAGIC.len() as u64;
        self.go(0)?;
        if self.read(magic).ok().as_deref() != Some(&MAGIC) {
            return Err(Error::Foreign("the first bytes of an MCAP file".into()));
        }
        let Some(at) = self.length.checked_sub(FOOTER_BYTES + magic).filter(|at| *at >= magic)
        else {
            return Ok(None);
        };
        let Some((kind::FOOTER, 20)) = self.head(at, self.length)? else { return Ok(None) };
        let body = self.read(20 + magic)?;
        Ok(if body.ends_with(&MAGIC) { Bytes::record(&body).u64() } else { None })
    }

    /// What the file holds, and whether it was cut: by its summary if that is sound, else by passing over all records.
    pub fn contents(&mut self) -> Result<(Contents, bool)> {
        let footer = self.footer()?;
        if let Some(summary) = footer.filter(|at| *at > 0)
            && let Ok(contents) = self.summary(summary)
            && contents.parts.contains_key(LAYOUT)
            && !contents.chunks.is_empty()
        {
            return Ok((contents, false));
        }
        Ok((self.scan()?, footer.is_none()))
    }

    /// What the summary tells.
    fn summary(&mut self, mut at: u64) -> Result<Contents> {
        let mut contents = Contents { whole_bytes: self.length, ..Contents::default() };
        let end = self.length;
        while let Some((kind, length)) = self.head(at, end)? {
            let next = at + HEAD + length;
            match kind {
                kind::FOOTER => return Ok(contents),
                kind::SCHEMA | kind::CHANNEL => {
                    at_most(MOST_CHUNK_BYTES, length, "bytes of a definition")?;
                    let body = self.read(length)?;
                    contents.channels.learn(kind, &body, at)?;
                }
                kind::CHUNK_INDEX | kind::ATTACHMENT_INDEX | kind::METADATA_INDEX => {
                    at_most(MOST_CHUNK_BYTES, length, "bytes of an index")?;
                    let body = self.read(length)?;
                    let learnt = contents.learn_index(kind, &mut Bytes::record(&body));
                    learnt.unwrap_or_else(|| Err(Error::damaged(at, "it is no index")))?;
                }
                _ => {}
            }
            at = next;
        }
        Err(Error::damaged(at, "the summary has no end"))
    }

    /// What passing over all records tells.
    fn scan(&mut self) -> Result<Contents> {
        let mut contents = Contents::default();
        let mut at = MAGIC.len() as u64;
        while let Some((kind, length)) = self.head(at, self.length)? {
            match kind {
                kind::DATA_END | kind::FOOTER => {
                    // Nothing of a recording follows.
                    at = self.length;
                    break;
                }
                kind::MESSAGE => {
                    return Err(Error::Foreign("chunks: its messages stand alone".into()));
                }
                kind::CHUNK if length >= 16 => {
                    let times = self.read(16)?;
                    let last_ns = Bytes::record(&times[8..]).u64().unwrap_or(0);
                    contents.add_chunk(ChunkPlace { at, last_ns })?;
                }
                kind::METADATA if length >= 4 => {
                    let name = self.read(length.min(MOST_NAME_BYTES))?;
                    contents.add_part(
                        Bytes::record(&name).text().unwrap_or(""),
                        &[LAYOUT, SETTINGS],
                        at,
                    );
                }
                kind::ATTACHMENT if length >= 20 => {
                    let names = self.read(length.min(MOST_NAME_BYTES))?;
                    let mut bytes = Bytes::record(&names[16..]);
                    contents.add_part(bytes.text().unwrap_or(""), &[BLOB, SCENE], at);
                }
                _ => {}
            }
            at += HEAD + length;
        }
        contents.whole_bytes = at;
        Ok(contents)
    }

    /// Names and texts of a metadata record; `None` if there is none.
    pub fn metadata(
        &mut self,
        contents: &Contents,
        name: &str,
    ) -> Result<Option<BTreeMap<String, String>>> {
        let Some(&at) = contents.parts.get(name) else { return Ok(None) };
        let most = 2 * MOST_TEXT_BYTES as u64;
        let body = self.body(at, kind::METADATA, most, "bytes of metadata")?;
        let read = || {
            let mut bytes = Bytes::record(&body);
            bytes.text()?;
            let mut texts = Bytes::record(bytes.sequence()?);
            let mut map = BTreeMap::new();
            while !texts.rest().is_empty() && map.len() <= MOST_COLUMNS {
                map.insert(texts.text()?.to_string(), texts.text()?.to_string());
            }
            Some(map)
        };
        read().map(Some).ok_or_else(|| Error::damaged(at, "the metadata cannot be read"))
    }

    /// Data of an attachment; `None` if there is none.
    pub fn attachment(&mut self, contents: &Contents, name: &str) -> Result<Option<Vec<u8>>> {
        let Some(&at) = contents.parts.get(name) else { return Ok(None) };
        let most =
            if name == BLOB { MOST_BLOB_BYTES } else { MOST_SCENE_BYTES } as u64 + MOST_NAME_BYTES;
        let mut body = self.body(at, kind::ATTACHMENT, most, "bytes of an attachment")?;
        let read = || {
            let (hashed, crc) = body.split_at_checked(body.len().checked_sub(4)?)?;
            let mut bytes = Bytes::record(hashed);
            bytes.take(16)?;
            bytes.text()?;
            bytes.text()?;
            let length = bytes.u64()?;
            let data = bytes.rest();
            let crc = Bytes::record(crc).u32()?;
            let is_sound =
                data.len() as u64 == length && (crc == 0 || crc == crc32fast::hash(hashed));
            is_sound.then_some(data.len())
        };
        let length = read().ok_or_else(|| Error::damaged(at, format!("{name} cannot be read")))?;
        body.truncate(body.len() - 4);
        Ok(Some(body.split_off(body.len() - length)))
    }

    /// Reads the chunk at `at`.
    ///
    /// # Errors
    /// [`Error::Compressed`]; [`Error::Damaged`] if it is not as it was written; [`Error::TooMany`].
    pub fn chunk(&mut self, at: u64) -> Result<Chunk> {
        let body = self.body(at, kind::CHUNK, MOST_CHUNK_BYTES, "bytes of a chunk")?;
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
            read().ok_or_else(|| damaged("it is no chunk"))?;
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
        Ok(Chunk { at, body, next })
    }
}

impl Contents {
    fn add_chunk(&mut self, place: ChunkPlace) -> Result<()> {
        // None is read twice, whatever an index says.
        if self.chunks.last().is_some_and(|last| last.at >= place.at) {
            return Err(Error::damaged(place.at, "chunks are out of order"));
        }
        self.chunks.push(place);
        at_most(MOST_CHUNKS as u64, self.chunks.len() as u64, "parts of a recording")
    }

    /// Keeps the place of the first part of this name, if it is one of those `known`.
    fn add_part(&mut self, name: &str, known: &[&'static str], at: u64) {
        if let Some(name) = known.iter().find(|known| **known == name) {
            self.parts.entry(name).or_insert(at);
        }
    }

    /// Learns what a record of the summary tells of a chunk, an attachment or a metadata record.
    fn learn_index(&mut self, kind: u8, bytes: &mut Bytes<'_>) -> Option<Result<()>> {
        if kind == kind::CHUNK_INDEX {
            let (_, last_ns, at) = (bytes.u64()?, bytes.u64()?, bytes.u64()?);
            return Some(self.add_chunk(ChunkPlace { at, last_ns }));
        }
        let (at, _) = (bytes.u64()?, bytes.u64()?);
        if kind == kind::METADATA_INDEX {
            self.add_part(bytes.text()?, &[LAYOUT, SETTINGS], at);
        } else {
            bytes.take(24)?;
            self.add_part(bytes.text()?, &[BLOB, SCENE], at);
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
