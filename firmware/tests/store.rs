//! Loading blobs from slots of flash.

use crate::mock::{ROWS, blob};
use taxel_core::blob::DecodeError;
use taxel_core::{AlignedBytes, Decoder};
use taxel_firmware::store::blob_in_slot;

type TestDecoder<'a> = Decoder<'a, ROWS>;

fn erased(length: usize) -> AlignedBytes {
    AlignedBytes::copy_of(&vec![0xFF; length])
}

#[test]
fn a_slot_without_a_whole_blob_tells_why() {
    let blob = blob(1, 40);
    let cut = AlignedBytes::copy_of(&blob[..512]);
    let load = |slot: &[u8]| TestDecoder::load(blob_in_slot(slot)).map(|_| ());
    assert_eq!(load(&erased(512)), Err(DecodeError::BadMagic));
    assert_eq!(load(&cut), Err(DecodeError::Truncated { expected: blob.len(), found: 512 }));
}
