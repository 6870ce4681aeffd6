//! Files of others: recordings that tools wrote anew are read, and whatever is no recording is refused with what it lacks.

mod common;

use std::collections::BTreeMap;
use std::io::Cursor;

use common::{Folder, assert_same, electrodes, extras, frames, start};
use mcap::records::Metadata;
use mcap::{Compression, WriteOptions};
use taxel_recording::{Error, Frame, Layout, Reader, Replace, Writer};

const _: fn() = || {
    fn may_be_sent<T: Send>() {}
    may_be_sent::<Writer>();
    may_be_sent::<Reader>();
};

/// A recording of the layout's frames.
fn recording(name: &str, layout: &Layout, written: &[Frame]) -> Vec<u8> {
    let folder = Folder::new(name);
    let path = folder.path(name);
    let mut writer =
        Writer::create(&path, layout, &extras(), start(), Replace::Recordings).unwrap();
    written.iter().for_each(|frame| writer.write(frame).unwrap());
    writer.finish().unwrap();
    std::fs::read(path).unwrap()
}

/// What a tool writes that copies records: metadata at the end, and other messages between those of a recording.
fn copied(bytes: &[u8], options: WriteOptions, change: impl Fn(&mut Metadata)) -> Vec<u8> {
    let mut copy = options.create(Cursor::new(vec![])).unwrap();
    let schema = copy.add_schema("std_msgs/msg/String", "ros2msg", b"string data\n").unwrap();
    let other = copy.add_channel(schema, "/camera", "cdr", &BTreeMap::new()).unwrap();
    for message in mcap::MessageStream::new(bytes).unwrap() {
        let message = message.unwrap();
        let channel = &message.channel;
        let schema = channel.schema.as_ref().unwrap();
        let schema = copy.add_schema(&schema.name, &schema.encoding, &schema.data).unwrap();
        let channel_id = copy.add_channel(schema, &channel.topic, "cdr", &BTreeMap::new()).unwrap();
        let mut header = mcap::records::MessageHeader {
            channel_id,
            sequence: message.sequence,
            log_time: message.log_time,
            publish_time: message.publish_time,
        };
        copy.write_to_known_channel(&header, &message.data).unwrap();
        header.channel_id = other;
        copy.write_to_known_channel(&header, b"a picture").unwrap();
    }
    for record in mcap::read::LinearReader::new(bytes).unwrap() {
        if let mcap::records::Record::Metadata(mut metadata) = record.unwrap() {
            change(&mut metadata);
            copy.write_metadata(&metadata).unwrap();
        }
    }
    copy.finish().unwrap();
    copy.into_inner().into_inner()
}

#[test]
fn a_recording_that_a_tool_copied_is_read() {
    let layout = electrodes();
    let written = frames(&layout, 20);
    let bytes = recording("copied", &layout, &written);
    let options = || WriteOptions::new().chunk_size(Some(2000));
    let bare = options().emit_summary_records(false).emit_summary_offsets(false);
    for options in [options(), bare, options().calculate_chunk_crcs(false)] {
        let copy = copied(&bytes, options, |_| {});
        let mut reader = Reader::new(Cursor::new(copy)).unwrap();
        assert!(!reader.was_cut());
        let read: Vec<Frame> = reader.by_ref().map(Result::unwrap).collect();
        assert_same(&read, &written);
        reader.seek(reader.duration()).unwrap();
        assert_eq!(reader.next().unwrap().unwrap().number, written[19].number);
    }
}

#[test]
fn what_is_no_recording_is_refused_with_what_it_lacks() {
    let layout = electrodes();
    let bytes = recording("refused", &layout, &frames(&layout, 3));
    let lacks = |bytes: Vec<u8>| match Reader::new(Cursor::new(bytes))
        .and_then(|mut it| it.next().unwrap())
    {
        Err(Error::Foreign(lacks)) => lacks,
        other => panic!("{other:?}"),
    };
    assert_eq!(lacks(b"time,r1c1_ohm\n".into()), "the first bytes of an MCAP file");
    let options = WriteOptions::new;
    let unnamed = copied(&bytes, options(), |metadata| metadata.name += "-2");
    assert_eq!(lacks(unnamed), "a metadata record \"taxel\"");
    let no_rows = copied(&bytes, options(), |metadata| drop(metadata.metadata.remove("rows")));
    assert_eq!(lacks(no_rows), "\"rows\" in its metadata record `taxel`");
    let alone = copied(&bytes, options().use_chunks(false), |_| {});
    assert_eq!(lacks(alone), "chunks: its messages stand alone");

    // Another type on a topic of a recording.
    let mut other = options().create(Cursor::new(vec![])).unwrap();
    for record in mcap::read::LinearReader::new(&bytes).unwrap() {
        if let mcap::records::Record::Metadata(metadata) = record.unwrap() {
            other.write_metadata(&metadata).unwrap();
        }
    }
    let schema = other.add_schema("std_msgs/msg/String", "ros2msg", b"string data\n").unwrap();
    let channel_id = other.add_channel(schema, "/taxel/readings", "cdr", &BTreeMap::new()).unwrap();
    let header =
        mcap::records::MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
    other.write_to_known_channel(&header, b"text").unwrap();
    other.finish().unwrap();
    assert_eq!(
        lacks(other.into_inner().into_inner()),
        "messages of type sensor_msgs/msg/Image in CDR on topic /taxel/readings"
    );

    let later = copied(&bytes, options(), |metadata| {
        metadata.metadata.insert("format".into(), "2".into());
    });
    assert!(matches!(Reader::new(Cursor::new(later)), Err(Error::OtherFormat { .. })));
}

#[test]
fn a_compressed_recording_is_refused_by_the_name_of_its_compression() {
    let layout = electrodes();
    let bytes = recording("compressed", &layout, &frames(&layout, 3));
    // The name of a compression is the fifth field of a chunk, whose first record is the schema of pictures.
    let options = WriteOptions::new().compression(None::<Compression>).calculate_chunk_crcs(false);
    let mut copy = copied(&bytes, options, |_| {});
    let chunk = copy.windows(9).position(|it| it[0] == 6 && it[4..9] == [0; 5]).unwrap();
    let name = chunk + 9 + 28;
    copy[name..name + 4].copy_from_slice(&4_u32.to_le_bytes());
    copy.splice(name + 4..name + 4, *b"zstd");
    let length = u64::from_le_bytes(copy[chunk + 1..chunk + 9].try_into().unwrap()) + 4;
    copy[chunk + 1..chunk + 9].copy_from_slice(&length.to_le_bytes());
    let outcome = Reader::new(Cursor::new(copy)).unwrap().next().unwrap();
    assert!(matches!(outcome, Err(Error::Compressed(name)) if name == "zstd"));
}
