//! Receiving packets from a stream of arbitrary bytes.

use super::cobs::{Decoded, Decoder};

/// Outcome of receiving the bytes up to the end of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Received<'a> {
    /// A decoded frame: the bytes of a packet, unless they are damaged.
    Frame(&'a [u8]),
    /// A frame with bytes missing.
    Broken,
    /// A frame longer than the receiver's memory, which was skipped.
    TooLong,
}

/// Receiver of frames that are at most as long as its memory `B` of bytes, CRC included.
#[derive(Debug, Clone)]
pub struct Receiver<B> {
    cobs: Decoder,
    memory: B,
    /// Number of bytes of the message so far.
    length: usize,
    /// Whether the message has been returned, so that the next one overwrites it.
    ended: bool,
    too_long: bool,
}

impl<B: AsMut<[u8]>> Receiver<B> {
    /// Makes a receiver that has received nothing, with `memory` for one message.
    pub const fn new(memory: B) -> Self {
        Self { cobs: Decoder::new(), memory, length: 0, ended: false, too_long: false }
    }

    /// Takes one byte, and at the end of a frame returns its outcome. Zeros between frames are ignored.
    pub fn push(&mut self, byte: u8) -> Option<Received<'_>> {
        let idle = self.cobs.is_idle();
        if core::mem::take(&mut self.ended) {
            self.length = 0;
        }
        match self.cobs.push(byte) {
            Decoded::Nothing => None,
            Decoded::Byte(byte) => {
                match self.memory.as_mut().get_mut(self.length) {
                    Some(place) => {
                        *place = byte;
                        self.length += 1;
                    }
                    None => self.too_long = true,
                }
                None
            }
            Decoded::BrokenEnd if idle => None,
            end => {
                self.ended = true;
                if core::mem::take(&mut self.too_long) {
                    Some(Received::TooLong)
                } else if end == Decoded::BrokenEnd {
                    Some(Received::Broken)
                } else {
                    let message = self.memory.as_mut().get(..self.length).unwrap_or_default();
                    Some(Received::Frame(message))
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::cobs::tests::frame_of as frame;

    /// Outcomes of a receiver of four bytes for `stream`.
    fn received(stream: &[u8]) -> Vec<Result<Vec<u8>, &'static str>> {
        let mut receiver = Receiver::new([0; 4]);
        let mut all = Vec::new();
        for byte in stream {
            all.extend(receiver.push(*byte).map(|received| match received {
                Received::Frame(bytes) => Ok(bytes.to_vec()),
                Received::Broken => Err("broken"),
                Received::TooLong => Err("too long"),
            }));
        }
        all
    }

    #[test]
    fn frames_arrive_one_by_one_and_what_is_too_long_or_cut_is_told() {
        let stream = [frame(&[1, 2]), vec![0, 0], frame(&[0, 0, 0, 4]), frame(&[])].concat();
        assert_eq!(received(&stream), [Ok(vec![1, 2]), Ok(vec![0, 0, 0, 4]), Ok(vec![])]);
        let stream = [frame(&[1; 5]), vec![3, 1, 0], frame(&[7; 4])].concat();
        assert_eq!(received(&stream), [Err("too long"), Err("broken"), Ok(vec![7; 4])]);
    }

    #[test]
    fn after_anything_the_next_frame_but_one_arrives() {
        for rubbish in [&[9, 9][..], &[255; 300], &[1, 1, 1, 1, 1, 1, 1, 1], &[4, 4, 4, 4, 4]] {
            let stream = [rubbish, &frame(&[1])[..], &frame(&[2, 3])[..]].concat();
            let found = received(&stream);
            assert_eq!(found.last(), Some(&Ok(vec![2, 3])), "{rubbish:?}");
            assert!(found.len() <= 2, "{rubbish:?}: {found:?}");
        }
    }
}
