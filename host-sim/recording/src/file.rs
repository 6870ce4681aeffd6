//! Records of an MCAP file of any bytes, in bounded memory: where the parts of a recording are.

use std::collections::BTreeMap;
use std::io::{BufReader, Read, Seek, SeekFrom};

use crate::bytes::Bytes;
use crate::chunk::{Channels, Chunk};
use crate::error::{Error, Result, at_most};
use crate::layout::{MOST_BLOB_BYTES, MOST_COLUMNS, MOST_SCENE_BYTES, MOST_TEXT_BYTES};
use crate::record::{HEAD, MAGIC, kind};

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

/// Bytes of the footer's record.
const FOOTER_BYTES: u64 = HEAD + 20;

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
                    learnt.unwrap_or_else(|| Err(Error::damaged(at, "it is not an index")))?;
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
        let most = MOST_TEXT_BYTES as u64;
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
        Chunk::parse(at, body)
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
