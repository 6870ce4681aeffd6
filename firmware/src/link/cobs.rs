//! Consistent overhead byte stuffing (Cheshire & Baker, IEEE/ACM Transactions on Networking 1999).
//!
//! It is implemented here for two reasons: it needs no second buffer in either direction, and no panic is
//! reachable in it, which `cargo xtask firmware` proves. Tests compare it with the `cobs` crate.

/// Longest run of bytes behind one code byte.
const LONGEST_RUN: usize = 254;

/// The byte that ends every frame, and does not occur within one.
pub const END: u8 = 0;

/// Calls `send` with the frame of `message` piece by piece, [`END`] included, until it returns `false`; returns whether all
/// pieces were sent.
pub fn encode(message: &[u8], mut send: impl FnMut(&[u8]) -> bool) -> bool {
    let mut rest = message;
    loop {
        let window = rest.get(..LONGEST_RUN).unwrap_or(rest);
        let zero = window.iter().position(|byte| *byte == END);
        let run = zero.and_then(|length| window.get(..length)).unwrap_or(window);
        // The sum is at most 254 + 1.
        if !send(&[run.len() as u8 + 1]) || !send(run) {
            return false;
        }
        let used = run.len() + usize::from(zero.is_some());
        rest = rest.get(used..).unwrap_or_default();
        if rest.is_empty() && zero.is_none() {
            return send(&[END]);
        }
    }
}

/// Meaning of one received byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decoded {
    /// A byte of the message.
    Byte(u8),
    /// A byte without a meaning of its own, such as a code byte.
    Nothing,
    /// The frame ended where it may end.
    End,
    /// The frame ended in the middle of a run: bytes are lost.
    BrokenEnd,
}

/// Decodes a stream byte by byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decoder {
    /// Number of bytes until the next code byte.
    left: u8,
    /// Whether a zero of the message stands before that code byte, unless the frame ends there.
    zero_follows: bool,
    /// Whether any byte came since the last end.
    started: bool,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Decoder {
    /// Makes a decoder at the start of a frame.
    pub const fn new() -> Self {
        Self { left: 0, zero_follows: false, started: false }
    }

    /// Takes one byte of the stream.
    pub fn push(&mut self, byte: u8) -> Decoded {
        if byte == END {
            let broken = self.left != 0 || !self.started;
            *self = Self::new();
            return if broken { Decoded::BrokenEnd } else { Decoded::End };
        }
        self.started = true;
        if let Some(left) = self.left.checked_sub(1) {
            self.left = left;
            return Decoded::Byte(byte);
        }
        let zero = self.zero_follows;
        self.left = byte - 1; // not zero: that is END
        self.zero_follows = byte != u8::MAX;
        if zero { Decoded::Byte(0) } else { Decoded::Nothing }
    }

    /// Whether no byte came since the last end.
    pub fn is_idle(&self) -> bool {
        !self.started
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;

    pub fn frame_of(message: &[u8]) -> Vec<u8> {
        let mut frame = Vec::new();
        assert!(encode(message, |piece| {
            frame.extend_from_slice(piece);
            true
        }));
        frame
    }

    fn message_of(frame: &[u8]) -> Option<Vec<u8>> {
        let mut decoder = Decoder::new();
        let mut message = Vec::new();
        for byte in frame {
            match decoder.push(*byte) {
                Decoded::Byte(byte) => message.push(byte),
                Decoded::Nothing => {}
                Decoded::End => return Some(message),
                Decoded::BrokenEnd => return None,
            }
        }
        None
    }

    /// Bytes with many zeros, or hardly any, so that all lengths of runs occur.
    fn messages() -> impl Strategy<Value = Vec<u8>> {
        let some_zeros = prop::collection::vec(0_u8..4, 0..600);
        let few_zeros = prop::collection::vec(any::<u8>(), 0..1200);
        let no_zeros = prop::collection::vec(1_u8.., 0..1200);
        prop_oneof![some_zeros, few_zeros, no_zeros]
    }

    #[test]
    fn frames_are_as_known_and_sending_stops_where_it_is_refused() {
        // Examples of the paper, and the usual corner cases at the longest run.
        let longest: Vec<u8> = (1..=254).collect();
        assert_eq!(frame_of(&[]), [1, 0]);
        assert_eq!(frame_of(&[0]), [1, 1, 0]);
        assert_eq!(frame_of(&[1, 2, 0, 3]), [3, 1, 2, 2, 3, 0]);
        assert_eq!(frame_of(&longest), [&[255][..], &longest, &[0]].concat());
        // Sending stops where it is refused.
        let mut sent = 0;
        assert!(!encode(&[1, 2, 3], |_| {
            sent += 1;
            sent < 3
        }));
        assert_eq!(sent, 3);
    }

    proptest! {
        #[test]
        fn frames_are_those_of_the_cobs_crate_and_decode_to_the_message(message in messages()) {
            let frame = frame_of(&message);
            prop_assert!(!frame[..frame.len() - 1].contains(&0));
            let (body, end) = frame.split_at(frame.len() - 1);
            prop_assert_eq!(end, &[END]);
            prop_assert_eq!(message_of(&frame), Some(message.clone()));
            // The crate's decoder reads our frames, and we read the crate's.
            prop_assert_eq!(::cobs::decode_vec(body).unwrap_or_default(), message.clone());
            let mut theirs = ::cobs::encode_vec(&message);
            theirs.push(END);
            prop_assert_eq!(message_of(&theirs), Some(message));
        }
    }
}
