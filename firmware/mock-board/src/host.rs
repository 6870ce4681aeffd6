//! The host's side of the link.

use firmware::app::{Leave, Session};
use firmware::link::message::{Configuration, Report, Request, UploadStep};
use firmware::link::receive::{Received, Receiver};
use firmware::link::{cobs, packet};
use firmware::store::Slot;
use model_core::blob::Model;

use crate::board::Board;
use crate::shape::ROWS;
use crate::source::Source;

/// Number of the requests of [`ask`].
const ASKED: u16 = 77;

/// A request for a configuration of the device's own.
#[must_use]
pub fn configure(configuration: Configuration) -> Request<'static> {
    Request::Configure { configuration, lease_ms: 0 }
}

/// The bytes of one request.
///
/// # Panics
/// The request is longer than 1 KiB.
#[must_use]
pub fn request_bytes(number: u16, request: &Request<'_>) -> Vec<u8> {
    let mut buffer = [0; 1024];
    let packet = packet::encode(number, request, &mut buffer).unwrap();
    let mut bytes = Vec::new();
    assert!(cobs::encode(packet, |byte| {
        bytes.push(byte);
        true
    }));
    bytes
}

/// Reports that the host finds in a device's bytes: the number and debug text of each.
///
/// # Panics
/// A report is not whole.
#[must_use]
pub fn reports(bytes: &[u8]) -> Vec<(u16, String)> {
    let mut receiver = Receiver::new([0; 1024]);
    let mut reports = Vec::new();
    for byte in bytes {
        match receiver.push(*byte) {
            Some(Received::Frame(bytes)) => {
                let packet = packet::decode::<Report<'_>>(bytes).expect("a whole report");
                reports.push((packet.number, format!("{:?}", packet.body)));
            }
            Some(other) => panic!("the device sent {other:?}"),
            None => {}
        }
    }
    reports
}

/// Runs turns of the loop until the device has read all bytes sent to it, or the session ends.
pub fn settle<S: Slot>(
    session: &mut Session<'_, '_, Board, Source, S, ROWS>,
    board: &Board,
) -> Option<Leave> {
    while !board.pins.borrow().to_device.is_empty() {
        if let Some(leave) = session.step() {
            return Some(leave);
        }
    }
    None
}

/// Sends `request` and passes the answer to `read`. All that the device has sent before is forgotten.
///
/// # Panics
/// There is no answer, or a report is not whole.
pub fn ask<T, S: Slot>(
    session: &mut Session<'_, '_, Board, Source, S, ROWS>,
    board: &Board,
    request: &Request<'_>,
    read: impl FnOnce(Report<'_>) -> T,
) -> (T, Option<Leave>) {
    board.pins.borrow_mut().to_host.clear();
    board.pins.borrow_mut().to_device.extend(request_bytes(ASKED, request));
    let leave = settle(session, board);
    let answer = std::mem::take(&mut board.pins.borrow_mut().to_host);
    let mut receiver = Receiver::new([0; 1024]);
    for byte in &answer {
        if let Some(Received::Frame(bytes)) = receiver.push(*byte) {
            let packet = packet::decode::<Report<'_>>(bytes).expect("a whole report");
            if packet.number == ASKED {
                return (read(packet.body), leave);
            }
        }
    }
    panic!("no answer to {request:?} in {:?}", reports(&answer));
}

/// The CRC-32 of the model in force.
///
/// # Panics
/// The device does not tell its identity.
pub fn model_crc<S: Slot>(
    session: &mut Session<'_, '_, Board, Source, S, ROWS>,
    board: &Board,
) -> Option<u32> {
    let read = |report: Report<'_>| match report {
        Report::Identity(identity) => identity.model.map(|model| model.crc_32),
        other => panic!("{other:?}"),
    };
    ask(session, board, &Request::Identify, read).0
}

/// The first step of an upload of `blob`.
///
/// # Panics
/// The blob is shorter than its head.
#[must_use]
pub fn begin(blob: &[u8]) -> UploadStep<'_> {
    UploadStep::Begin { head: &blob[..Model::HEAD_BYTES] }
}

/// The steps of an upload of `blob` in chunks of `chunk` bytes.
///
/// # Panics
/// The blob is shorter than its head, or `chunk` is 0.
#[must_use]
pub fn upload_steps(blob: &[u8], chunk: usize) -> Vec<UploadStep<'_>> {
    let mut steps = vec![begin(blob)];
    steps.extend(
        blob.chunks(chunk)
            .enumerate()
            .map(|(i, bytes)| UploadStep::Chunk { offset: (i * chunk) as u32, bytes }),
    );
    steps.push(UploadStep::Commit);
    steps
}
