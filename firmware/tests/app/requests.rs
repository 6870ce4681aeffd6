//! Requests that many tests make, and what their answers must be.

use taxel_core::Decoder;
use taxel_core::blob::Floats;
use taxel_firmware::link::message::{Report, Request};

use crate::mock::*;

/// Outputs of taxel-core itself.
pub fn expected(blob: &[u8], frame: &TestFrame) -> [[f32; OUTPUTS]; ROWS] {
    let decoder = Decoder::<ROWS>::load(blob).unwrap();
    let outputs = decoder.decode(frame.as_flattened()).unwrap().outputs;
    std::array::from_fn(|row| outputs.as_chunks().0[row])
}

pub fn bits(values: impl Iterator<Item = f32>) -> Vec<u32> {
    values.map(f32::to_bits).collect()
}

/// Asks for an estimate of `frame`, and returns its flags, row status and bits.
pub fn decode(
    session: &mut Running<'_, '_>,
    board: &Board,
    frame: &TestFrame,
) -> (u8, Vec<u8>, Vec<u32>) {
    decode_at(session, board, 0, frame)
}

/// The same for a frame that began at this time.
pub fn decode_at(
    session: &mut Running<'_, '_>,
    board: &Board,
    start_us: u64,
    frame: &TestFrame,
) -> (u8, Vec<u8>, Vec<u32>) {
    let readings_ohm = Floats::new(frame.as_flattened());
    let request = Request::Decode { frame: 5, start_us, readings_ohm };
    answer!(session, board, &request, Report::Estimate(e) => {
        assert_eq!((e.frame, e.start_us), (5, start_us));
        (e.flags, e.row_status.to_vec(), bits(e.outputs.iter()))
    })
}

/// Captures a baseline of `frames` scans, and returns the answer. Then sets a configuration that scans only on request.
pub fn capture(session: &mut Running<'_, '_>, board: &Board, frames: u16) -> String {
    tell(session, board, &Request::Configure(every(100)));
    send(session, board, 9, &Request::CaptureBaseline { frames });
    let answer = loop {
        let all = reports(&board.pins.borrow().to_host);
        if let Some((_, text)) = all.into_iter().find(|(number, _)| *number == 9) {
            break text;
        }
        assert_eq!(session.step(), None);
        assert!(board.pins.borrow().now_us < 1_000_000, "no answer");
    };
    tell(session, board, &Request::Configure(quiet()));
    answer
}
