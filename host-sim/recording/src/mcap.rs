//! Writer of MCAP files, version 0, as <https://mcap.dev/spec> has them: in chunks, without compression, with all indexes.
//!
//! Chunks are written whole, and nothing is gone back to: what a kill leaves ends with a whole chunk.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::mem::take;

use crc32fast::Hasher;

use crate::error::{Error, Result};
use crate::record::{Fields, MAGIC, head, kind};
use crate::summary::{Summary, Times};

/// MCAP file that is being written to `W`. Dropping it ends it, without telling of failures.
pub struct Mcap<W: Write> {
    /// Nothing once the file is finished, or could not be written.
    to: Option<W>,
    /// Number of bytes that are written.
    at: u64,
    /// CRC-32 of all bytes, and then of the summary's.
    checksum: Hasher,
    /// Records of the chunk that is not written yet, and the times of its messages.
    chunk: Fields,
    times: Times,
    /// Times of each channel's messages in the chunk, and their places there.
    indexes: Vec<Fields>,
    summary: Summary,
}

impl<W: Write> Mcap<W> {
    /// Begins a file of this profile.
    pub fn new(to: W, profile: &str, library: &str) -> Result<Self> {
        let mut file = Self {
            to: Some(to),
            at: 0,
            checksum: Hasher::new(),
            chunk: Fields::new(),
            times: Times::default(),
            indexes: vec![],
            summary: Summary::default(),
        };
        file.pass_on(&MAGIC)?;
        file.put(kind::HEADER, &[Fields::new().text(profile).text(library).bytes()])?;
        Ok(file)
    }

    /// Size of the chunk that is not written yet, in bytes.
    pub fn pending_bytes(&self) -> usize {
        self.chunk.bytes().len()
    }

    /// Number of chunks that are written.
    pub fn chunk_count(&self) -> u32 {
        self.summary.chunks.count
    }

    /// Writes a metadata record.
    pub fn metadata(&mut self, name: &str, texts: &BTreeMap<String, String>) -> Result<()> {
        let place = self.put(kind::METADATA, &[Fields::new().text(name).texts(texts).bytes()])?;
        self.summary.metadata.add(kind::METADATA_INDEX, &[place.text(name).bytes()]);
        Ok(())
    }

    /// Writes an attachment that was made at `ns`.
    pub fn attach(&mut self, name: &str, media_type: &str, ns: u64, data: &[u8]) -> Result<()> {
        let length = data.len() as u64;
        let fields = Fields::new().u64(ns).u64(ns).text(name).text(media_type).u64(length);
        let mut checksum = Hasher::new();
        checksum.update(fields.bytes());
        checksum.update(data);
        let checksum = checksum.finalize().to_le_bytes();
        let place = self.put(kind::ATTACHMENT, &[fields.bytes(), data, &checksum])?;
        let index = place.u64(ns).u64(ns).u64(length).text(name).text(media_type);
        self.summary.attachments.add(kind::ATTACHMENT_INDEX, &[index.bytes()]);
        Ok(())
    }

    /// Adds a channel with a schema of its own, and returns its number.
    ///
    /// # Panics
    /// There are 65 535 channels already.
    pub fn add_channel(
        &mut self,
        topic: &str,
        encoding: &str,
        schema: &str,
        language: &str,
        definition: &str,
    ) -> u16 {
        self.indexes.push(Fields::new());
        self.summary.messages.push(0);
        // Schema 0 would be none.
        let number = u16::try_from(self.indexes.len()).expect("at most 65 535 channels");
        let schema = Fields::new().u16(number).text(schema).text(language).text(definition);
        let texts = BTreeMap::new();
        let channel =
            Fields::new().u16(number).u16(number).text(topic).text(encoding).texts(&texts);
        self.chunk.record(kind::SCHEMA, &[schema.bytes()]);
        self.chunk.record(kind::CHANNEL, &[channel.bytes()]);
        self.summary.schemas.add(kind::SCHEMA, &[schema.bytes()]);
        self.summary.channels.add(kind::CHANNEL, &[channel.bytes()]);
        number
    }

    /// Adds a message to the chunk.
    ///
    /// # Panics
    /// There is no such channel.
    pub fn add_message(
        &mut self,
        number: u16,
        sequence: u32,
        log_ns: u64,
        publish_ns: u64,
        data: &[u8],
    ) {
        let place = usize::from(number) - 1;
        self.summary.messages[place] += 1;
        let index = take(&mut self.indexes[place]);
        self.indexes[place] = index.u64(log_ns).u64(self.chunk.bytes().len() as u64);
        self.times.add(log_ns);
        self.summary.times.add(log_ns);
        let header = Fields::new().u16(number).u32(sequence).u64(log_ns).u64(publish_ns);
        self.chunk.record(kind::MESSAGE, &[header.bytes(), data]);
    }

    /// Ends the chunk if there are messages in it, and passes all bytes on.
    pub fn flush(&mut self) -> Result<()> {
        if self.times.0.is_some() {
            self.end_chunk()?;
        }
        self.guard(W::flush)
    }

    fn end_chunk(&mut self) -> Result<()> {
        let chunk = take(&mut self.chunk);
        let times = take(&mut self.times).fields();
        let length = chunk.bytes().len() as u64;
        // The text is the name of the compression: none.
        let fields = Fields::new().u64(length).u32(crc32fast::hash(chunk.bytes())).text("");
        let fields = fields.u64(length);
        let place = self.put(kind::CHUNK, &[times.bytes(), fields.bytes(), chunk.bytes()])?;
        self.chunk = chunk;
        self.chunk.clear();

        let indexes_at = self.at;
        let mut places = Fields::new();
        for (number, place) in (1..).zip(0..self.indexes.len()) {
            let index = take(&mut self.indexes[place]);
            if !index.bytes().is_empty() {
                places = places.u16(number).u64(self.at);
                let fields = Fields::new().u16(number).sequence(index.bytes());
                self.put(kind::MESSAGE_INDEX, &[fields.bytes()])?;
            }
        }
        let rest = Fields::new().sequence(places.bytes()).u64(self.at - indexes_at);
        let rest = rest.text("").u64(length).u64(length);
        let index = [times.bytes(), place.bytes(), rest.bytes()];
        self.summary.chunks.add(kind::CHUNK_INDEX, &index);
        Ok(())
    }

    /// Ends the file.
    pub fn finish(mut self) -> Result<W> {
        self.end()?;
        self.to.take().ok_or_else(is_broken)
    }

    fn end(&mut self) -> Result<()> {
        self.flush()?;
        let checksum = take(&mut self.checksum).finalize();
        self.put(kind::DATA_END, &[&checksum.to_le_bytes()])?;

        self.checksum = Hasher::new();
        let summary_at = self.at;
        for records in take(&mut self.summary).groups() {
            self.pass_on(records.bytes())?;
        }
        // The summary's checksum is that of all before it. There are no offsets of the summary's parts.
        let footer = Fields::new().u64(summary_at).u64(0);
        self.pass_on(&head(kind::FOOTER, &[footer.bytes(), &[0; 4]]))?;
        self.pass_on(footer.bytes())?;
        let checksum = take(&mut self.checksum).finalize();
        self.pass_on(&checksum.to_le_bytes())?;
        self.pass_on(&MAGIC)
    }

    /// Writes a record, and returns its place and its length as fields.
    fn put(&mut self, kind: u8, parts: &[&[u8]]) -> Result<Fields> {
        let at = self.at;
        self.pass_on(&head(kind, parts))?;
        parts.iter().try_for_each(|part| self.pass_on(part))?;
        Ok(Fields::new().u64(at).u64(self.at - at))
    }

    fn pass_on(&mut self, bytes: &[u8]) -> Result<()> {
        self.at += bytes.len() as u64;
        self.checksum.update(bytes);
        self.guard(|to| to.write_all(bytes))
    }

    /// Writes, and never again if that fails: what followed would stand after half a record.
    fn guard(&mut self, write: impl FnOnce(&mut W) -> io::Result<()>) -> Result<()> {
        let mut to = self.to.take().ok_or_else(is_broken)?;
        write(&mut to).map_err(Error::Write)?;
        self.to = Some(to);
        Ok(())
    }
}

fn is_broken() -> Error {
    Error::Write(io::Error::other("what was written before is not whole"))
}

impl<W: Write> Drop for Mcap<W> {
    fn drop(&mut self) {
        if self.to.is_some() {
            let _ = self.end();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Disk that is full for a while: it refuses one write after so many bytes.
    struct Disk<'d> {
        bytes: &'d mut Vec<u8>,
        full_at: Option<usize>,
    }

    impl Write for Disk<'_> {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let free = self.full_at.map_or(usize::MAX, |at| at - self.bytes.len());
            if free == 0 {
                self.full_at = None;
                return Err(io::ErrorKind::StorageFull.into());
            }
            self.bytes.write(&bytes[..bytes.len().min(free)])
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// Writes a file whose disk is full at a byte; whether that went well.
    fn write(bytes: &mut Vec<u8>, full_at: Option<usize>) -> Result<()> {
        let mut file = Mcap::new(Disk { bytes, full_at }, "profile", "library")?;
        file.attach("a", "text/plain", 1, b"attached")?;
        let channel = file.add_channel("/topic", "cdr", "type", "ros2msg", "byte b\n");
        let mut outcome = Ok(());
        for sequence in 0..3 {
            file.add_message(channel, sequence, 7, 8, b"message");
            // Whoever does not heed a failure writes on.
            outcome = outcome.and(file.flush());
        }
        outcome.and(file.finish().map(drop))
    }

    #[test]
    fn nothing_follows_what_could_not_be_written() {
        let mut whole = vec![];
        write(&mut whole, None).unwrap();
        for at in 0..whole.len() {
            let mut bytes = vec![];
            let outcome = write(&mut bytes, Some(at));
            assert!(matches!(outcome, Err(Error::Write(_))));
            assert_eq!(bytes, whole[..at]);
        }
    }
}
