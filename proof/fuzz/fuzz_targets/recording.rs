//! Recordings of any bytes. A file is refused, or its frames fit its layout. One that was cut has the same frames when it
//! is mended.
#![no_main]

use std::io::Cursor;

use libfuzzer_sys::fuzz_target;
use taxel_recording::{Error, Frame, Reader, mend};

fuzz_target!(|bytes: &[u8]| {
    let Ok(mut reader) = Reader::new(Cursor::new(bytes)) else { return };
    let read = frames(&mut reader);
    // A message takes 31 bytes at least.
    assert!(read.len() * 31 <= bytes.len(), "{} frames of {} bytes", read.len(), bytes.len());
    let layout = reader.layout();
    for frame in &read {
        assert_eq!(frame.readings.len(), layout.readings.len());
        for values in [&frame.outputs, &frame.deviations, &frame.truth].into_iter().flatten() {
            assert_eq!(values.len(), layout.outputs.len());
        }
    }
    reader.seek(reader.duration() / 2).expect("a file in memory");
    reader.by_ref().for_each(drop);
    if reader.was_cut() {
        let mut mended = vec![];
        let mut cut = Reader::new(Cursor::new(bytes)).expect("a file that was read before");
        let recovered = mend(&mut cut, &mut mended).expect("a file in memory");
        let mut mended = Reader::new(Cursor::new(mended)).expect("a file that was mended");
        assert!(!mended.was_cut() && mended.layout() == reader.layout());
        assert!(recovered.bytes_left_out <= bytes.len() as u64);
        // As text, in which each NaN is like another.
        assert_eq!(format!("{:?}", frames(&mut mended)), format!("{read:?}"), "frames were lost");
    }
});

/// Frames that can be read.
fn frames(reader: &mut Reader<Cursor<impl AsRef<[u8]>>>) -> Vec<Frame> {
    reader.by_ref().filter_map(Result::<Frame, Error>::ok).collect()
}
