//! Mending of recordings whose writer was killed.

use std::fs::{File, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::Path;

use crate::error::{Error, Result};
use crate::layout::Extras;
use crate::output::Output;
use crate::reader::Reader;
use crate::topic::Topic;

/// What was recovered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Recovered {
    /// Number of frames.
    pub frames: u64,
    /// Bytes that were left out: those of a chunk that is not whole, or is damaged.
    pub bytes_left_out: u64,
}

/// Mends the recording at `path` if it was cut or a chunk is damaged; `None` if it is whole, and as it was.
///
/// The mended recording is written beside it, and then takes its name.
///
/// # Errors
/// [`Error::InUse`] if it is being recorded; errors of [`Reader::open`]; [`Error::Data`] if no frame is left, or the mended one
/// cannot be written.
/// The recording is then as it was.
pub fn recover(path: &Path) -> Result<Option<Recovered>> {
    let file = File::open(path).map_err(Error::Read)?;
    if let Err(TryLockError::WouldBlock) = file.try_lock_shared() {
        return Err(Error::InUse(path.into()));
    }
    let mut reader = Reader::open(path)?;
    if !reader.was_cut() {
        match reader.by_ref().find_map(Result::err) {
            None => return Ok(None),
            Some(Error::Read(cause)) => return Err(Error::Read(cause)),
            // A chunk is damaged: it is left out.
            Some(_) => {}
        }
    }
    let mut recovered = None;
    taxel_data::output::write_whole(path, |to| {
        let outcome = mend(&mut reader, to);
        recovered =
            Some(outcome.map_err(|cause| taxel_data::Error::write(path, io::Error::other(cause)))?);
        if recovered.is_some_and(|it| it.frames == 0) {
            return Err(taxel_data::Error::unfit("no frame in it is whole: it is left unchanged"));
        }
        Ok(())
    })?;
    Ok(recovered)
}

/// Writes a whole recording of what a cut one holds. Frames that were read already are written too.
///
/// # Errors
/// [`Error::Read`], [`Error::Write`].
pub fn mend<S: Read + Seek>(reader: &mut Reader<S>, to: &mut dyn Write) -> Result<Recovered> {
    let extras = match reader.extras() {
        Err(Error::Read(cause)) => return Err(Error::Read(cause)),
        // Frames are worth more than a model that is damaged.
        Err(_) => Extras { parent_frame: reader.parent_frame.clone(), ..Extras::default() },
        Ok(extras) => extras,
    };
    let Reader { source, contents, layout, start_ns, .. } = reader;
    let mut output = Output::new(to, layout, &extras, *start_ns)?;
    let mut frames = 0;
    let mut bytes_left_out = source.length - contents.whole_bytes;
    let ends = contents.chunks[contents.chunks.len().min(1)..].iter().map(|chunk| chunk.at);
    let ends: Vec<u64> = ends.chain([contents.whole_bytes]).collect();
    for (place, end) in contents.chunks.iter().zip(ends) {
        let mut chunk = match source.chunk(place.at) {
            Ok(chunk) => chunk,
            Err(Error::Read(cause)) => return Err(Error::Read(cause)),
            Err(_) => {
                bytes_left_out += end.saturating_sub(place.at);
                continue;
            }
        };
        // A record in a sound chunk that is none is passed over.
        while let Some(message) = chunk.message(&mut contents.channels).transpose() {
            let Ok(message) = message else { continue };
            frames += u64::from(message.topic == Topic::Readings);
            output.put(message.topic, message.number, message.ns, message.device_ns, message.data);
        }
        output.end_chunk()?;
    }
    output.finish()?;
    Ok(Recovered { frames, bytes_left_out })
}
