//! Loading blobs from slots of flash.

use firmware::store::blob_in_slot;
use mock_board::{ROWS, blob, frame_at_rest};
use model_core::blob::DecodeError;
use model_core::{AlignedBytes, Decoder};

type TestDecoder<'a> = Decoder<'a, ROWS>;

fn erased(length: usize) -> AlignedBytes {
    AlignedBytes::copy_of(&vec![0xFF; length])
}

#[test]
fn a_blob_loads_from_a_larger_erased_slot() {
    let blob = blob(1, 4);
    let mut slot = erased(128 * 1024);
    slot[..blob.len()].copy_from_slice(&blob);

    assert_eq!(blob_in_slot(&slot), &blob[..]);
    let decoder = TestDecoder::load(blob_in_slot(&slot)).unwrap();
    let expected = TestDecoder::load(&blob).unwrap().decode(frame_at_rest().as_flattened());
    assert_eq!(decoder.decode(frame_at_rest().as_flattened()), expected);

    // The slot as a whole is not a blob.
    let error = TestDecoder::load(&slot).unwrap_err();
    assert_eq!(error, DecodeError::TrailingBytes { extra: slot.len() - blob.len() });
}

#[test]
fn a_slot_without_a_whole_blob_tells_why() {
    let blob = blob(1, 40);
    let cut = AlignedBytes::copy_of(&blob[..512]);
    let load = |slot: &[u8]| TestDecoder::load(blob_in_slot(slot)).map(|_| ());
    assert_eq!(load(&erased(512)), Err(DecodeError::BadMagic));
    assert_eq!(load(&cut), Err(DecodeError::Truncated { expected: blob.len(), found: 512 }));
}
