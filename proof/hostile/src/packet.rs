//! Bytes on the line: COBS frames, packets and messages. The first byte says what the rest is.

use taxel_firmware::link::message::{Report, Request};
use taxel_firmware::link::receive::{Received, Receiver};
use taxel_firmware::link::{cobs, packet};

use crate::seal;

/// Room of the receiver, as tight as a small device's.
const ROOM: usize = 256;

/// Whether bytes are a packet of a message `$kind`. What is found must be the same when it is encoded and decoded again.
/// Messages borrow, so this is written once for each kind.
macro_rules! same_again {
    ($kind:ty, $sealed:expr) => {{
        let found = packet::decode::<$kind>($sealed);
        if let Ok(found) = &found {
            let mut buffer = vec![0; $sealed.len()];
            // Numbers may arrive longer than they need to be, but are not sent so.
            let again = packet::encode(found.number, &found.body, &mut buffer).expect("no longer");
            let again = packet::decode::<$kind>(again).expect("what was just encoded");
            // As texts, in which NaN equals NaN.
            assert_eq!(format!("{found:?}"), format!("{again:?}"));
        }
        found.is_ok()
    }};
}

/// A stream of bytes, the bytes of a packet before its CRC, or a message to send.
pub fn check(bytes: &[u8]) -> bool {
    let Some((kind, bytes)) = bytes.split_first() else { return false };
    match kind % 3 {
        0 => stream(bytes),
        1 => {
            let sealed = seal::packet(bytes);
            let is_request = same_again!(Request<'_>, &sealed);
            same_again!(Report<'_>, &sealed) || is_request
        }
        _ => there_and_back(bytes),
    }
}

/// Whether any packet was found in a stream. Whatever came before, a good packet behind two zeros is found.
fn stream(bytes: &[u8]) -> bool {
    let mut receiver = Receiver::new([0; ROOM]);
    let mut found = false;
    for byte in bytes {
        if let Some(Received::Frame(frame)) = receiver.push(*byte) {
            assert!(frame.len() <= ROOM, "longer than the receiver's memory");
            found |= packet::decode::<Request<'_>>(frame).is_ok();
        }
    }
    let mut buffer = [0; ROOM];
    let good = packet::encode(7, &Request::Identify, &mut buffer).expect("a short packet");
    let mut line = vec![0, 0];
    assert!(cobs::encode(good, |byte| {
        line.push(byte);
        true
    }));
    let mut ends = Vec::new();
    for byte in line {
        if let Some(end) = receiver.push(byte) {
            ends.push(matches!(end, Received::Frame(frame) if frame == good));
        }
    }
    assert!(ends.last() == Some(&true), "a good packet behind zeros is lost");
    found
}

/// A message of any bytes arrives as it was sent, and holds no zero on the line but at its end.
fn there_and_back(message: &[u8]) -> bool {
    let mut line = Vec::new();
    assert!(cobs::encode(message, |byte| {
        line.push(byte);
        true
    }));
    let (end, inside) = line.split_last().expect("an end");
    assert!(*end == 0 && !inside.contains(&0), "a zero inside a frame");
    let mut receiver = Receiver::new(vec![0; message.len()]);
    let arrived = line.iter().find_map(|byte| match receiver.push(*byte) {
        Some(Received::Frame(frame)) => Some(frame == message),
        _ => None,
    });
    assert_eq!(arrived, Some(true), "it arrives otherwise than it was sent");
    true
}
