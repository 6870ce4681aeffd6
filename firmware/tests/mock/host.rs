//! The host's side of the link.

use std::cell::{Ref, RefMut};

use taxel_core::blob::{Floats, Model};
use taxel_firmware::app::{Session, SessionEnd};
use taxel_firmware::link::message::{
    Configuration, EstimateReport, ModelIdentity, Refusal, Report, Request, Statistics,
    UploadState, UploadStep,
};
use taxel_firmware::link::receive::{Received, Receiver};
use taxel_firmware::link::{cobs, packet};

use super::board::{Board, Pins};
use super::flash::Flash;
use super::models::bits;
use super::shape::{ROWS, TestFrame};
use super::source::Source;

/// A session of an application.
pub type Running<'a, 'm> = Session<'a, 'm, Board, Source, Flash, ROWS>;

/// Number of the requests of [`ask`].
const ASKED: u16 = 77;

/// Length in bytes of the chunks of an upload.
pub const CHUNK: usize = 60;

/// A trial of whatever was uploaded.
pub const TRY: UploadStep<'_> = UploadStep::Try { trial_ms: 60_000 };

/// Answer to a step of an upload, or to an undo.
pub type Answer = Result<UploadState, Refusal>;

/// The bytes of one request.
pub fn request_bytes(number: u16, request: &Request<'_>) -> Vec<u8> {
    framed(packet::encode(number, request, &mut [0; 1024]).unwrap())
}

/// A packet as bytes on the line.
pub fn framed(packet: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    assert!(cobs::encode(packet, |piece| {
        bytes.extend_from_slice(piece);
        true
    }));
    bytes
}

/// What the device answers to a request, which is as in the pattern.
macro_rules! answer {
    ($host:expr, $request:expr, $report:pat => $value:expr) => {
        $host
            .ask($request, |report| match report {
                $report => $value,
                other => panic!("{other:?}"),
            })
            .0
    };
}
pub(crate) use answer;

/// A host of a device in a session, and what the device is connected to.
pub struct Host<'a, 'm> {
    pub session: Running<'a, 'm>,
    pub board: Board,
}

impl Host<'_, '_> {
    /// State of the board.
    pub fn pins(&self) -> Ref<'_, Pins> {
        self.board.pins.borrow()
    }

    /// The same, to be changed.
    pub fn pins_mut(&self) -> RefMut<'_, Pins> {
        self.board.pins.borrow_mut()
    }

    /// The frame that the sensor shows, in Ω.
    pub fn frame(&self) -> RefMut<'_, TestFrame> {
        self.board.frame.borrow_mut()
    }

    /// Runs a turn of the loop.
    pub fn step(&mut self) -> Option<SessionEnd> {
        self.session.step()
    }

    /// Runs so many turns of the loop.
    pub fn turn(&mut self, times: u32) {
        for _ in 0..times {
            self.step();
        }
    }

    /// Runs turns of the loop until this time.
    pub fn run_until(&mut self, end_us: u32) {
        while self.pins().now_us < end_us {
            assert_eq!(self.step(), None);
        }
    }

    /// Runs turns of the loop for so many µs.
    pub fn run_for(&mut self, us: u32) {
        let now_us = self.pins().now_us;
        self.run_until(now_us + us);
    }

    /// Lets so many µs pass, and runs a turn of the loop.
    pub fn pass(&mut self, us: u32) -> Option<SessionEnd> {
        let now_us = self.pins().now_us;
        self.pins_mut().now_us = now_us.wrapping_add(us);
        self.step()
    }

    /// Runs turns of the loop until the device has read all bytes sent to it, or the session ends.
    fn settle(&mut self) -> Option<SessionEnd> {
        while !self.pins().to_device.is_empty() {
            if let Some(end) = self.step() {
                return Some(end);
            }
        }
        None
    }

    /// Passes each report that the device has sent to `read`, with its number; returns what it first makes of one. What is
    /// no whole report is passed over.
    pub fn find<T>(&self, mut read: impl FnMut(u16, Report<'_>) -> Option<T>) -> Option<T> {
        let mut receiver = Receiver::new([0; 1024]);
        self.pins().to_host.iter().find_map(|byte| {
            let Some(Received::Frame(bytes)) = receiver.push(*byte) else { return None };
            let packet = packet::decode::<Report<'_>>(bytes).ok()?;
            read(packet.number, packet.body)
        })
    }

    /// Reports that the device has sent, all of them whole: the number and debug text of each.
    pub fn reports(&self) -> Vec<(u16, String)> {
        let mut reports = Vec::new();
        self.find(|number, report| {
            reports.push((number, format!("{report:?}")));
            None::<()>
        });
        let frames = self.pins().to_host.split(|byte| *byte == cobs::END).count() - 1;
        assert_eq!(reports.len(), frames, "{reports:?}");
        reports
    }

    /// Debug texts of the reports with this number.
    pub fn answers(&self, number: u16) -> Vec<String> {
        let reports = self.reports().into_iter();
        reports.filter(|(found, _)| *found == number).map(|(_, text)| text).collect()
    }

    /// Sends `request` and passes the answer to `read`. All that the device has sent before is forgotten, and so is the answer.
    pub fn ask<T>(
        &mut self,
        request: &Request<'_>,
        read: impl FnOnce(Report<'_>) -> T,
    ) -> (T, Option<SessionEnd>) {
        self.pins_mut().to_host.clear();
        self.pins_mut().to_device.extend(request_bytes(ASKED, request));
        let end = self.settle();
        let mut read = Some(read);
        let found =
            self.find(
                |number, report| {
                    if number == ASKED { read.take().map(|read| read(report)) } else { None }
                },
            );
        let found = found.unwrap_or_else(|| panic!("no answer in {:?}", self.reports()));
        self.pins_mut().to_host.clear();
        (found, end)
    }

    /// Sends `request`, whatever the answer.
    pub fn tell(&mut self, request: &Request<'_>) {
        self.ask(request, |_| ());
    }

    /// Brings a configuration into force.
    pub fn configure(&mut self, configuration: Configuration) {
        self.tell(&Request::Configure(configuration));
    }

    /// Sends `request` with this number, and lets the device read it.
    pub fn send(&mut self, number: u16, request: &Request<'_>) {
        self.pins_mut().to_device.extend(request_bytes(number, request));
        self.settle();
    }

    /// What the device refuses `request` for.
    pub fn refusal(&mut self, request: &Request<'_>) -> Refusal {
        answer!(self, request, Report::Refused(refusal) => refusal)
    }

    /// What `read` makes of the answer to readings of a frame that began at `start_us`.
    pub fn estimate<T>(
        &mut self,
        start_us: u64,
        readings_ohm: &[f32],
        read: impl FnOnce(EstimateReport<'_>) -> T,
    ) -> T {
        let readings_ohm = Floats::new(readings_ohm);
        let request = Request::Decode { frame: 5, start_us, readings_ohm };
        answer!(self, &request, Report::Estimate(it) => {
            assert_eq!((it.frame, it.start_us), (5, start_us));
            read(it)
        })
    }

    /// Flags, row status and bits of the outputs of the answer to a frame.
    pub fn decode(&mut self, frame: &TestFrame) -> (u8, Vec<u8>, Vec<u32>) {
        self.estimate(0, frame.as_flattened(), |it| {
            (it.flags, it.row_status.to_vec(), bits(it.outputs.iter()))
        })
    }

    /// Whether these readings are a contact.
    pub fn is_contact(&mut self, readings_ohm: &[f32]) -> bool {
        self.estimate(0, readings_ohm, |it| it.flags & EstimateReport::CONTACT != 0)
    }

    /// Brings a baseline into force.
    pub fn set_baseline(&mut self, readings_ohm: &[f32]) {
        self.tell(&Request::SetBaseline { readings_ohm: Floats::new(readings_ohm) });
    }

    /// The device's counters.
    pub fn statistics(&mut self) -> Statistics {
        answer!(self, &Request::Statistics, Report::Statistics(it) => it)
    }

    /// The model in force.
    pub fn model(&mut self) -> Option<ModelIdentity> {
        answer!(self, &Request::Identify, Report::Identity(identity) => identity.model)
    }

    /// The CRC-32 of the model in force.
    pub fn model_crc(&mut self) -> Option<u32> {
        self.model().map(|model| model.crc_32)
    }

    /// Carries out steps of an upload until one is refused or ends the session; returns the last answer, and the end.
    pub fn upload<'s>(
        &mut self,
        steps: impl IntoIterator<Item = &'s UploadStep<'s>>,
    ) -> (Answer, Option<SessionEnd>) {
        let mut last = (Ok(UploadState::Idle), None);
        for step in steps {
            last = self.ask(&Request::Upload(*step), upload_answer);
            if last.0.is_err() || last.1.is_some() {
                break;
            }
        }
        last
    }

    /// Leaves the model with the CRC-32 `left` for the one before it.
    pub fn undo(&mut self, left: u32) -> (Answer, Option<SessionEnd>) {
        self.ask(&Request::Undo { crc_32: left }, upload_answer)
    }
}

fn upload_answer(report: Report<'_>) -> Answer {
    match report {
        Report::Upload(state) => Ok(state),
        Report::Refused(refusal) => Err(refusal),
        other => panic!("{other:?}"),
    }
}

/// The first step of an upload of `blob`.
pub fn begin(blob: &[u8]) -> UploadStep<'_> {
    UploadStep::Begin { head: &blob[..Model::HEAD_BYTES] }
}

/// The steps of an upload of `blob`, until it is on trial.
pub fn trial_steps(blob: &[u8]) -> Vec<UploadStep<'_>> {
    let chunks = blob.chunks(CHUNK).enumerate();
    let chunks = chunks.map(|(i, bytes)| UploadStep::Chunk { offset: (i * CHUNK) as u32, bytes });
    [begin(blob)].into_iter().chain(chunks).chain([TRY]).collect()
}
