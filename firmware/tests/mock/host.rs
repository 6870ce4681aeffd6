//! The host's side of the link.

use taxel_core::blob::Model;
use taxel_firmware::app::{Session, SessionEnd};
use taxel_firmware::link::message::{
    ModelIdentity, Refusal, Report, Request, Statistics, UploadState, UploadStep,
};
use taxel_firmware::link::receive::{Received, Receiver};
use taxel_firmware::link::{cobs, packet};

use super::board::Board;
use super::flash::Flash;
use super::shape::ROWS;
use super::source::Source;

/// A session of an application in memory of any lifetime.
pub type Running<'a, 'm> = Session<'a, 'm, Board, Source, Flash, ROWS>;

/// A session of an application whose memory is never freed.
pub type TestSession<'a> = Running<'a, 'static>;

/// Number of the requests of [`ask`].
const ASKED: u16 = 77;

/// Answer to a step of an upload, or to an undo.
pub type Answer = Result<UploadState, Refusal>;

/// The bytes of one request.
pub fn request_bytes(number: u16, request: &Request<'_>) -> Vec<u8> {
    framed(packet::encode(number, request, &mut [0; 1024]).unwrap())
}

/// A packet as bytes on the line.
pub fn framed(packet: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    assert!(cobs::encode(packet, |byte| {
        bytes.push(byte);
        true
    }));
    bytes
}

/// Passes each report in a device's bytes to `read`, with its number; returns what it first makes of one. What is no whole
/// report is passed over.
pub fn find_report<T>(
    bytes: &[u8],
    mut read: impl FnMut(u16, Report<'_>) -> Option<T>,
) -> Option<T> {
    let mut receiver = Receiver::new([0; 1024]);
    bytes.iter().find_map(|byte| {
        let Some(Received::Frame(bytes)) = receiver.push(*byte) else { return None };
        let packet = packet::decode::<Report<'_>>(bytes).ok()?;
        read(packet.number, packet.body)
    })
}

/// Reports that the host finds in a device's bytes: the number and debug text of each.
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
pub fn settle(session: &mut Running<'_, '_>, board: &Board) -> Option<SessionEnd> {
    while !board.pins.borrow().to_device.is_empty() {
        if let Some(end) = session.step() {
            return Some(end);
        }
    }
    None
}

/// Sends `request` and passes the answer to `read`. All that the device has sent before is forgotten.
pub fn ask<T>(
    session: &mut Running<'_, '_>,
    board: &Board,
    request: &Request<'_>,
    read: impl FnOnce(Report<'_>) -> T,
) -> (T, Option<SessionEnd>) {
    board.pins.borrow_mut().to_host.clear();
    board.pins.borrow_mut().to_device.extend(request_bytes(ASKED, request));
    let end = settle(session, board);
    let answer = std::mem::take(&mut board.pins.borrow_mut().to_host);
    let mut read = Some(read);
    let found = find_report(&answer, |number, report| {
        if number == ASKED { read.take().map(|read| read(report)) } else { None }
    });
    let found = found.unwrap_or_else(|| panic!("no answer in {:?}", reports(&answer)));
    (found, end)
}

/// What the device answers to a request, which is as in the pattern.
macro_rules! answer {
    ($session:expr, $board:expr, $request:expr, $report:pat => $value:expr) => {
        crate::mock::ask($session, $board, $request, |report| match report {
            $report => $value,
            other => panic!("{other:?}"),
        })
        .0
    };
}
pub(crate) use answer;

/// Sends `request`, whatever the answer.
pub fn tell(session: &mut Running<'_, '_>, board: &Board, request: &Request<'_>) {
    ask(session, board, request, |_| ());
}

/// Sends `request` with this number, and lets the device read it.
pub fn send(session: &mut Running<'_, '_>, board: &Board, number: u16, request: &Request<'_>) {
    board.pins.borrow_mut().to_device.extend(request_bytes(number, request));
    settle(session, board);
}

/// Runs so many turns of the loop.
pub fn turn(session: &mut Running<'_, '_>, times: u32) {
    for _ in 0..times {
        session.step();
    }
}

/// Runs turns of the loop until this time.
pub fn run_until(session: &mut Running<'_, '_>, board: &Board, end_us: u32) {
    while board.pins.borrow().now_us < end_us {
        assert_eq!(session.step(), None);
    }
}

/// The device's counters.
pub fn statistics(session: &mut Running<'_, '_>, board: &Board) -> Statistics {
    answer!(session, board, &Request::Statistics, Report::Statistics(it) => it)
}

/// The model in force.
pub fn model(session: &mut Running<'_, '_>, board: &Board) -> Option<ModelIdentity> {
    answer!(session, board, &Request::Identify, Report::Identity(identity) => identity.model)
}

/// The CRC-32 of the model in force.
pub fn model_crc(session: &mut Running<'_, '_>, board: &Board) -> Option<u32> {
    model(session, board).map(|model| model.crc_32)
}

/// The first step of an upload of `blob`.
pub fn begin(blob: &[u8]) -> UploadStep<'_> {
    UploadStep::Begin { head: &blob[..Model::HEAD_BYTES] }
}

/// The steps of an upload of `blob` in chunks of `chunk` bytes, until it is on trial.
pub fn upload_steps(blob: &[u8], chunk: usize) -> Vec<UploadStep<'_>> {
    let mut steps = vec![begin(blob)];
    steps.extend(
        blob.chunks(chunk)
            .enumerate()
            .map(|(i, bytes)| UploadStep::Chunk { offset: (i * chunk) as u32, bytes }),
    );
    steps.push(UploadStep::Try { trial_ms: 60_000 });
    steps
}

/// The same in chunks of 100 bytes.
pub fn trial_steps(blob: &[u8]) -> Vec<UploadStep<'_>> {
    upload_steps(blob, 100)
}

/// The same, and its confirmation.
pub fn confirmed_steps(blob: &[u8]) -> Vec<UploadStep<'_>> {
    let mut steps = trial_steps(blob);
    steps.push(UploadStep::Confirm);
    steps
}

/// Carries out one step of an upload.
pub fn upload_step(
    session: &mut Running<'_, '_>,
    board: &Board,
    step: UploadStep<'_>,
) -> (Answer, Option<SessionEnd>) {
    ask(session, board, &Request::Upload(step), upload_answer)
}

/// Leaves the model with the CRC-32 `left` for the one before it.
pub fn undo(
    session: &mut Running<'_, '_>,
    board: &Board,
    left: u32,
) -> (Answer, Option<SessionEnd>) {
    ask(session, board, &Request::Undo { crc_32: left }, upload_answer)
}

fn upload_answer(report: Report<'_>) -> Answer {
    match report {
        Report::Upload(state) => Ok(state),
        Report::Refused(refusal) => Err(refusal),
        other => panic!("{other:?}"),
    }
}
