//! Files of others: recordings that tools wrote anew are read, and whatever is no recording is refused with what it lacks.

use std::io::Cursor;

use crate::common::{Folder, assert_same, electrodes, frames, recording, write};
use taxel_recording::{Error, Frame, Reader, Writer};

const _: fn() = || {
    fn may_be_sent<T: Send>() {}
    may_be_sent::<Writer>();
    may_be_sent::<Reader>();
};

/// Places, kinds and bodies of records up to the end.
fn records(bytes: &[u8], mut at: usize) -> Vec<(usize, u8, &[u8])> {
    let mut records = vec![];
    while let Some(length) = bytes.get(at + 1..at + 9) {
        let end = at + 9 + u64::from_le_bytes(length.try_into().unwrap()) as usize;
        records.push((at, bytes[at], &bytes[at + 9..end]));
        at = end;
    }
    records
}

fn put(to: &mut Vec<u8>, kind: u8, parts: &[&[u8]]) {
    let body = parts.concat();
    to.push(kind);
    to.extend((body.len() as u64).to_le_bytes());
    to.extend(body);
}

/// What a tool writes that copies records: metadata at the end, and other messages between those of a recording, which are
/// in chunks without a checksum, or stand alone. A summary has no messages of its own.
fn copied(bytes: &[u8], chunk_bytes: Option<usize>, has_summary: bool) -> Vec<u8> {
    let mut copy = bytes[..8].to_vec();
    put(&mut copy, 1, &[&[0; 8]]);
    let (mut chunk, mut indexes, mut last_ns) = (vec![], vec![], [0; 8]);
    // A channel without a schema: its number, topic and encoding, and no metadata.
    put(&mut chunk, 4, &[&[99, 0, 0, 0], b"\x07\0\0\0/camera\x04\0\0\0jpeg", &[0; 4]]);
    let mut end_chunk = |chunk: &mut Vec<u8>, last_ns: &[u8], copy: &mut Vec<u8>| {
        let (at, length) = (copy.len() as u64, (chunk.len() as u64).to_le_bytes());
        put(copy, 6, &[&[0; 8], last_ns, &length, &[0; 8], &length, chunk]);
        let place = [at.to_le_bytes(), (copy.len() as u64 - at).to_le_bytes()].concat();
        put(&mut indexes, 8, &[&[0; 8], last_ns, &place, &[0; 16], &length, &length]);
        chunk.clear();
    };
    let originals = records(bytes, 8);
    let bodies = originals.iter().filter(|(_, kind, _)| *kind == 6).map(|(_, _, body)| &body[40..]);
    for (_, kind, body) in bodies.flat_map(|body| records(body, 0)) {
        put(&mut chunk, kind, &[body]);
        if kind == 5 {
            last_ns.copy_from_slice(&body[6..14]);
            put(&mut chunk, 5, &[&[99, 0], &body[2..22], b"a picture"]);
            if chunk_bytes.is_some_and(|most| chunk.len() > most) {
                end_chunk(&mut chunk, &last_ns, &mut copy);
            }
        }
    }
    match chunk_bytes {
        None => copy.extend(chunk),
        Some(_) if chunk.is_empty() => {}
        Some(_) => end_chunk(&mut chunk, &last_ns, &mut copy),
    }
    for (_, _, body) in originals.iter().filter(|(_, kind, _)| *kind == 12) {
        let at = copy.len() as u64;
        put(&mut copy, 12, &[body]);
        let place = [at.to_le_bytes(), (copy.len() as u64 - at).to_le_bytes()].concat();
        let name = 4 + u32::from_le_bytes(body[..4].try_into().unwrap()) as usize;
        put(&mut indexes, 13, &[&place, &body[..name]]);
    }
    put(&mut copy, 15, &[&[0; 4]]);
    let summary = if has_summary { copy.len() as u64 } else { 0 };
    if has_summary {
        copy.extend(indexes);
    }
    put(&mut copy, 2, &[&summary.to_le_bytes(), &[0; 12]]);
    copy.extend(&bytes[..8]);
    copy
}

/// Bytes with others instead of some, wherever they stand.
fn replaced(mut bytes: Vec<u8>, from: &[u8], to: &[u8]) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let places: Vec<usize> = (0..bytes.len()).filter(|&at| bytes[at..].starts_with(from)).collect();
    assert!(!places.is_empty());
    places.iter().for_each(|&at| bytes[at..at + to.len()].copy_from_slice(to));
    bytes
}

#[test]
fn a_recording_that_a_tool_copied_is_read() {
    let layout = electrodes();
    let written = frames(&layout, 20);
    let bytes = recording(&layout, &written);
    for has_summary in [true, false] {
        let copy = copied(&bytes, Some(2000), has_summary);
        let mut reader = Reader::new(Cursor::new(copy)).unwrap();
        assert!(!reader.was_cut());
        let read: Vec<Frame> = reader.by_ref().map(Result::unwrap).collect();
        assert_same(&read, &written);
        reader.seek(reader.duration()).unwrap();
        assert_eq!(reader.next().unwrap().unwrap().number, written[19].number);
    }
}

#[test]
fn frames_that_are_written_at_once_have_chunks_of_half_a_second() {
    let folder = Folder::new();
    let path = folder.path("at_once");
    write(&path, &electrodes(), &frames(&electrodes(), 300), 300);
    let bytes = std::fs::read(&path).unwrap();
    let chunks = records(&bytes[..bytes.len() - 8], 8).iter().filter(|it| it.1 == 6).count();
    assert!((4..=7).contains(&chunks), "{chunks} of 3 s");
}

#[test]
fn what_is_no_recording_is_refused_with_what_it_lacks() {
    let layout = electrodes();
    let bytes = recording(&layout, &frames(&layout, 3));
    let lacks = |bytes: Vec<u8>| match Reader::new(Cursor::new(bytes))
        .and_then(|mut it| it.next().unwrap())
    {
        Err(Error::Foreign(lacks)) => lacks,
        other => panic!("{other:?}"),
    };
    assert_eq!(lacks(b"time,r1c1_ohm\n".into()), "the first bytes of an MCAP file");
    let changed = |from: &[u8], to: &[u8]| replaced(bytes.clone(), from, to);
    let unnamed = changed(b"\x05\0\0\0taxel", b"\x05\0\0\0other");
    assert_eq!(lacks(unnamed), "a metadata record \"taxel\"");
    let no_rows = changed(b"\x04\0\0\0rows", b"\x04\0\0\0rank");
    assert_eq!(lacks(no_rows), "\"rows\" in its metadata record `taxel`");
    assert_eq!(lacks(copied(&bytes, None, false)), "chunks: its messages stand alone");
    let unlike = "messages of type sensor_msgs/msg/Image in CDR on topic /taxel/readings";
    for has_summary in [true, false] {
        let other = copied(&bytes, Some(2000), has_summary);
        assert_eq!(
            lacks(replaced(other, b"sensor_msgs/msg/Image", b"sensor_msgs/msg/Joint")),
            unlike
        );
    }
    let later = changed(b"format\x01\0\0\x001", b"format\x01\0\0\x002");
    assert!(matches!(Reader::new(Cursor::new(later)), Err(Error::OtherFormat { .. })));
}

#[test]
fn a_refusal_of_a_compressed_recording_names_the_compression() {
    let layout = electrodes();
    let bytes = recording(&layout, &frames(&layout, 3));
    let mut copy = bytes[..8].to_vec();
    for (_, kind, body) in records(&bytes, 8) {
        match kind {
            // The name of a compression is the fifth field of a chunk.
            6 => put(&mut copy, 6, &[&body[..28], b"\x04\0\0\0zstd", &body[32..]]),
            12 => put(&mut copy, 12, &[body]),
            _ => {}
        }
    }
    let outcome = Reader::new(Cursor::new(copy)).unwrap().next().unwrap();
    assert!(matches!(outcome, Err(Error::Compressed(name)) if name == "zstd"));
}
