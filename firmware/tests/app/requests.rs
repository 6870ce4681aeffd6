//! Requests that many tests make, and what their answers must be.

use taxel_core::Decoder;
use taxel_firmware::link::message::Request;

use crate::mock::*;

/// Bits of the outputs of taxel-core itself.
pub fn expected(blob: &[u8], frame: &TestFrame) -> Vec<u32> {
    let decoder = Decoder::<ROWS>::load(blob).unwrap();
    bits(decoder.decode(frame.as_flattened()).unwrap().outputs)
}

pub fn bits(values: impl IntoIterator<Item = f32>) -> Vec<u32> {
    values.into_iter().map(f32::to_bits).collect()
}

/// Asks for an estimate of `frame`, and returns its flags, row status and bits.
pub fn decode(host: &mut Host<'_, '_>, frame: &TestFrame) -> (u8, Vec<u8>, Vec<u32>) {
    host.estimate(0, frame.as_flattened(), |it| {
        (it.flags, it.row_status.to_vec(), bits(it.outputs.iter()))
    })
}

/// Captures a baseline of `frames` scans, and returns the answer. Then sets a configuration that scans only on request.
pub fn capture(host: &mut Host<'_, '_>, frames: u16) -> String {
    host.configure(every(100));
    host.send(9, &Request::CaptureBaseline { frames });
    while host.answers(9).is_empty() {
        assert_eq!(host.step(), None);
        assert!(host.pins().now_us < 1_000_000, "no answer");
    }
    let answer = host.answers(9).remove(0);
    host.configure(quiet());
    answer
}
