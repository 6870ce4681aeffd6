//! What is written comes back to the bit, whole or cut.

use std::fs;
use std::time::{Duration, UNIX_EPOCH};

use crate::common::{Folder, assert_same, electrodes, extras, forces, frames, start, write};
use taxel_recording::{
    Column, Electrode, Error, Extras, Frame, Layout, Reader, Replace, Writer, recover,
};

#[test]
fn frames_and_all_that_goes_with_them_come_back_to_the_bit() {
    let folder = Folder::new();
    for (name, layout) in [("electrodes", electrodes()), ("forces", forces())] {
        let path = folder.path(name);
        let written = frames(&layout, 40);
        write(&path, &layout, &written, 7);
        let mut reader = Reader::open(&path).unwrap();
        assert!(!reader.was_cut());
        assert_eq!(reader.layout(), &layout);
        assert_eq!(reader.extras().unwrap(), extras());
        assert_eq!(reader.start(), start());
        assert_eq!(reader.duration(), Duration::from_millis(390));
        let read: Vec<Frame> = reader.by_ref().map(Result::unwrap).collect();
        assert_same(&read, &written);
        assert_eq!(reader.position(), reader.duration());
    }
}

#[test]
fn a_recording_without_frames_is_whole() {
    let folder = Folder::new();
    let path = folder.path("empty");
    write(&path, &forces(), &[], 1);
    let mut reader = Reader::open(&path).unwrap();
    assert!(!reader.was_cut() && reader.next().is_none());
    assert_eq!((reader.duration(), reader.extras().unwrap()), (Duration::ZERO, extras()));
    assert_eq!(recover(&path).unwrap(), None);
}

#[test]
fn reading_goes_on_from_any_time() {
    let folder = Folder::new();
    let path = folder.path("seek");
    let layout = electrodes();
    let written = frames(&layout, 40);
    write(&path, &layout, &written, 7);
    let whole = fs::read(&path).unwrap();
    // With a summary, and without.
    for bytes in [whole.len(), whole.len() - 1] {
        fs::write(&path, &whole[..bytes]).unwrap();
        for number in [39_u64, 0, 20, 21, 7, 40] {
            let mut reader = Reader::open(&path).unwrap();
            reader.by_ref().take(3).for_each(drop);
            reader.seek(Duration::from_micros((10_000 * number).saturating_sub(1))).unwrap();
            let read: Vec<Frame> = reader.map(Result::unwrap).collect();
            assert_same(&read, &written[number as usize..]);
        }
    }
}

#[test]
fn a_device_that_starts_anew_does_not_turn_the_clock_back() {
    let folder = Folder::new();
    let path = folder.path("restart");
    let layout = forces();
    let mut written = frames(&layout, 4);
    for (frame, time_us) in written.iter_mut().zip([900_000, 910_000, 5, 10_005]) {
        frame.time_us = time_us;
    }
    write(&path, &layout, &written, 9);
    let mut reader = Reader::open(&path).unwrap();
    let mut positions = vec![];
    for expected in &written {
        assert_eq!(reader.next().unwrap().unwrap().time_us, expected.time_us);
        positions.push(reader.position().as_millis());
    }
    assert_eq!(positions, [0, 10, 10, 20]);
}

#[test]
fn a_file_that_is_cut_anywhere_keeps_all_its_whole_chunks() {
    let folder = Folder::new();
    let (path, cut) = (folder.path("whole"), folder.path("cut"));
    let layout = electrodes();
    let written = frames(&layout, 12);
    let sizes = write(&path, &layout, &written, 2);
    let whole = fs::read(&path).unwrap();
    let bytes = (sizes[0]..whole.len()).step_by(61).chain(sizes.iter().copied());
    for bytes in bytes {
        fs::write(&cut, &whole[..bytes]).unwrap();
        let mut reader = Reader::open(&cut).unwrap();
        assert!(reader.was_cut());
        assert_eq!(reader.extras().unwrap(), extras());
        let read: Vec<Frame> = reader.map(Result::unwrap).collect();
        // Indexes of a chunk's messages may be missing.
        let chunks = sizes.iter().filter(|size| **size <= bytes).count() - 1;
        assert!(
            read.len() == 2 * chunks || read.len() == 2 * (chunks + 1),
            "{} of {bytes} bytes",
            read.len()
        );
        assert_same(&read, &written[..read.len()]);

        if read.is_empty() {
            // There is nothing to keep, and what is there may be worth something to somebody.
            assert!(recover(&cut).is_err() && fs::read(&cut).unwrap() == whole[..bytes]);
            continue;
        }
        let recovered = recover(&cut).unwrap().expect("a file that was cut");
        assert_eq!(recovered.frames, read.len() as u64);
        let mut reader = Reader::open(&cut).unwrap();
        assert!(!reader.was_cut());
        assert_eq!(reader.extras().unwrap(), extras());
        assert_same(&reader.map(Result::unwrap).collect::<Vec<_>>(), &read);
        let mended = fs::read(&cut).unwrap();
        assert_eq!(recover(&cut).unwrap(), None);
        assert_eq!(fs::read(&cut).unwrap(), mended, "a whole file was changed");
    }
}

#[test]
fn damaged_chunks_are_skipped_and_their_bytes_counted() {
    let folder = Folder::new();
    let path = folder.path("damaged");
    let written = frames(&electrodes(), 3);
    let sizes = write(&path, &electrodes(), &written, 1);
    // The second chunk is damaged, in a whole file.
    let mut bytes = fs::read(&path).unwrap();
    bytes[sizes[1] + 200] ^= 1;
    fs::write(&path, &bytes).unwrap();
    assert_eq!(recover(&path).unwrap().unwrap().frames, 2);
    let read: Vec<Frame> = Reader::open(&path).unwrap().map(Result::unwrap).collect();
    assert_eq!([read[0].number, read[1].number], [written[0].number, written[2].number]);
    // The third is not whole either, and zeros follow that were never written.
    bytes.truncate(sizes[2] + 1000);
    bytes.resize(sizes[2] + 5000, 0);
    fs::write(&path, &bytes).unwrap();
    let mut reader = Reader::open(&path).unwrap();
    assert!(matches!(reader.find(Result::is_err), Some(Err(Error::Damaged { .. }))));
    let recovered = recover(&path).unwrap().unwrap();
    assert_eq!(recovered.frames, 1);
    assert_eq!(recovered.bytes_left_out as usize, sizes[2] - sizes[1] + 5000);
}

#[test]
fn a_frame_that_does_not_fit_is_refused_and_harms_nothing() {
    let folder = Folder::new();
    let path = folder.path("unfit");
    let layout = forces();
    let written = frames(&layout, 2);
    let mut writer =
        Writer::create(&path, &layout, &extras(), UNIX_EPOCH, Replace::Recordings).unwrap();
    writer.write(&written[0]).unwrap();
    let unfit: [fn(&mut Frame); 5] = [
        |frame| frame.readings.clear(),
        |frame| frame.outputs = Some(vec![]),
        |frame| frame.outputs = None,
        |frame| frame.truth = Some(vec![0.0; 99]),
        |frame| frame.status.as_mut().unwrap().row_wires.clear(),
    ];
    for (case, change) in unfit.into_iter().enumerate() {
        let mut frame = written[1].clone();
        change(&mut frame);
        let outcome = writer.write(&frame);
        // No health of rows is known: that is no fault.
        assert_eq!(
            matches!(outcome, Err(Error::Frame { number: 8, .. })),
            case < 4,
            "{case}: {outcome:?}"
        );
    }
    writer.finish().unwrap();
    assert_eq!(Reader::open(&path).unwrap().map(Result::unwrap).count(), 2);
}

#[test]
fn frames_of_the_largest_layout_come_back() {
    let folder = Folder::new();
    let path = folder.path("largest");
    let half = 16_384;
    let mut layout = forces();
    layout.columns = 2 * half;
    layout.readings = vec![Column { name: "r".into(), unit: "Ω".into() }; 2 * half];
    layout.outputs = vec![Column { name: "dx".into(), unit: "mm".into() }; half];
    layout.outputs.extend(vec![Column { name: "force_of_one".into(), unit: "N".into() }; half]);
    let electrode = |output| Electrode {
        name: "e".into(),
        place_mm: [1e300, 1e-300, 1.0 / 3.0],
        outputs: [Some(output), None, None],
    };
    layout.electrodes = (0..half).map(electrode).collect();
    let written = frames(&layout, 8);
    write(&path, &layout, &written, 9);
    let mut reader = Reader::open(&path).unwrap();
    assert_eq!(reader.layout(), &layout);
    assert_same(&reader.by_ref().map(Result::unwrap).collect::<Vec<_>>(), &written);

    layout.outputs.iter_mut().for_each(|output| output.name = "long".repeat(9));
    let refused = Writer::create(&path, &layout, &extras(), start(), Replace::Recordings);
    assert!(matches!(refused, Err(Error::TooMany { .. })));
    assert_eq!(Reader::open(&path).unwrap().count(), 8);
}

#[test]
fn only_recordings_are_replaced_and_none_that_is_being_written() {
    let folder = Folder::new();
    let path = folder.path("file");
    let create = |replace| Writer::create(&path, &forces(), &extras(), start(), replace);
    fs::write(&path, "a thesis").unwrap();
    assert!(matches!(create(Replace::Recordings), Err(Error::NotReplaced(_))));
    assert_eq!(fs::read(&path).unwrap(), b"a thesis");
    let writer = create(Replace::AnyFile).unwrap();
    assert!(matches!(create(Replace::AnyFile), Err(Error::InUse(_))));
    assert!(matches!(recover(&path), Err(Error::InUse(_))));
    writer.finish().unwrap();
    create(Replace::Recordings).unwrap().finish().unwrap();
}

#[test]
fn a_bad_layout_is_refused_before_any_file_is_touched() {
    let folder = Folder::new();
    let path = folder.path("layout");
    let changes: [fn(&mut Layout, &mut Extras); 9] = [
        |layout, _| layout.rows += 1,
        |layout, _| layout.readings[0].name = "a\tb".into(),
        |layout, _| layout.title = "two\nlines".into(),
        |layout, _| layout.electrodes[0].outputs[0] = Some(1000),
        |layout, _| layout.electrodes[0].outputs[0] = layout.electrodes[1].outputs[0],
        |layout, _| layout.outputs[0].unit = "N".into(),
        |layout, _| layout.electrodes[0].place_mm[2] = f64::NAN,
        |_, extras| extras.blob = Some(vec![0; (16 << 20) + 1]),
        |_, extras| extras.parent_frame = String::new(),
    ];
    for change in changes {
        let (mut layout, mut extras) = (electrodes(), extras());
        change(&mut layout, &mut extras);
        let refused = Writer::create(&path, &layout, &extras, start(), Replace::AnyFile);
        assert!(matches!(refused, Err(Error::Layout(_) | Error::TooMany { .. })));
        assert!(!path.exists());
    }
}
