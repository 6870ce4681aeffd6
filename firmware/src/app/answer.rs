//! Requests and their answers.

use taxel_core::blob::Floats;

use super::Core;
use super::link::Link;
use super::model::InForce;
use super::models::Models;
use super::sensor::Scan;
use super::session::Session;
use super::session_end::SessionEnd;
use crate::circuit::ConstantsFault;
use crate::link::message::{ConfidenceSent, Identity, Refusal, Report, Request, UploadState};
use crate::link::packet::{self, PROTOCOL_VERSION, PacketError};
use crate::link::receive::Received;
use crate::log::info;
use crate::platform::Platform;
use crate::readout::{FrameSource, RowTimes};
use crate::store::Slot;

impl<P: Platform, F: FrameSource, S: Slot, const ROWS: usize> Session<'_, '_, P, F, S, ROWS> {
    /// Receives bytes until a frame is complete or no more bytes are there, and answers the frame's request.
    pub(super) fn serve_link(&mut self) -> Option<SessionEnd> {
        let app = &mut *self.app;
        // Bounded, so that a host that never pauses does not keep the sensor from being scanned.
        for _ in 0..app.core.models.capacity.message_bytes() {
            let byte = app.core.link.platform().receive()?;
            if let Some(received) = app.receiver.push(byte) {
                return app.core.answer(received, &self.model, self.spare);
            }
        }
        None
    }
}

impl<P: Platform, F: FrameSource, const ROWS: usize> Core<'_, P, F, ROWS> {
    fn answer<S: Slot>(
        &mut self,
        received: Received<'_>,
        model: &InForce<'_, ROWS>,
        spare: &mut S,
    ) -> Option<SessionEnd> {
        let (number, request) = self.open(received)?;
        let Self { sensor, models, link, work } = self;
        let wires_crc_32 = sensor.wiring.crc_32;
        let mut end = None;
        // Nothing is sent for `Ok(None)`: the answer takes a while.
        let report = match request {
            Request::Identify => {
                Ok(Some(Report::Identity(models.identity(model, wires_crc_32, spare, link))))
            }
            Request::Statistics => Ok(Some(Report::Statistics(link.statistics))),
            Request::Configuration => Ok(Some(Report::Configuration(sensor.configuration))),
            Request::Configure(wanted) => sensor
                .configure(wanted, link)
                .map(|()| Some(Report::Configuration(sensor.configuration))),
            Request::Resume => {
                sensor.resume(link);
                Ok(Some(Report::Configuration(sensor.configuration)))
            }
            Request::CaptureBaseline { frames } => {
                sensor.begin_capture(number, frames, link).map(|()| None)
            }
            Request::Decode { frame, start_us, readings_ohm } => {
                sensor.set_frame(readings_ohm).map(|()| {
                    let decoder = model.decoder.as_ref();
                    let sent = ConfidenceSent::Deviations;
                    // Filter and tracker of scans are left alone: anybody may ask for a decoding.
                    let series = sensor.configuration.frame_period_us == 0;
                    let scan = Scan { start_us, missed: 0, row_times: RowTimes::default() };
                    let scan = series.then_some(scan);
                    let (mut flags, _) = work.decode(sensor, scan, true, link, model);
                    let novelty = work.assess(sensor.frame(), link, decoder, sent, &mut flags);
                    work.send_estimate(number, (frame, start_us), flags, (novelty, sent), link);
                    None
                })
            }
            Request::SetBaseline { readings_ohm } => sensor.set_frame(readings_ohm).map(|()| {
                sensor.take_baseline(link);
                work.take_baseline(&sensor.baseline);
                Some(Report::Baseline { readings_ohm: Floats::new(sensor.baseline.mean()) })
            }),
            Request::Upload(step) => models
                .upload_step(step, model, spare, link, &mut end)
                .map(|state| Some(Report::Upload(state))),
            Request::Undo { crc_32 } => models
                .undo(crc_32, model, spare, link, &mut end)
                .map(|crc_32| Some(Report::Upload(UploadState::Confirmed { crc_32 }))),
            Request::Restart => {
                info!("restart asked for");
                end = Some(SessionEnd::Restart);
                Ok(Some(Report::Restarting))
            }
            Request::SetBrownOut if link.platform().set_brown_out() => {
                end = Some(SessionEnd::Restart);
                Ok(Some(Report::Restarting))
            }
            Request::SetBrownOut => Err(Refusal::Flash),
            Request::Diagnose => {
                sensor.diagnose().map(Report::Diagnosis).map(Some).ok_or(Refusal::Unknown)
            }
            Request::Constants => {
                let constants = sensor.source.constants().map(Report::Constants);
                constants.map(Some).ok_or(Refusal::Constants(ConstantsFault::Fixed))
            }
            Request::SetConstants(constants) => match sensor.set_constants(constants, link) {
                Ok(changed) => {
                    if changed {
                        work.take_baseline(&sensor.baseline);
                    }
                    Ok(sensor.source.constants().map(Report::Constants))
                }
                Err(fault) => Err(Refusal::Constants(fault)),
            },
            Request::Kept => Ok(Some(Report::Kept(link.kept()))),
            Request::Keep(setting) => {
                sensor.keep(setting, link).map(|()| Some(Report::Kept(link.kept())))
            }
            Request::Forget(setting) => {
                link.forget(setting).map(|()| Some(Report::Kept(link.kept())))
            }
        };
        match report {
            Ok(Some(report)) => _ = link.send(number, &report),
            Ok(None) => {}
            Err(refusal) => _ = link.send(number, &Report::Refused(refusal)),
        }
        end
    }

    /// Takes a request with its number out of its packet. What is no request is refused.
    fn open<'r>(&mut self, received: Received<'r>) -> Option<(u16, Request<'r>)> {
        let packet = match received {
            Received::Frame(bytes) => packet::decode(bytes),
            Received::Broken | Received::TooLong => Err(PacketError::Damaged),
        };
        match packet {
            Ok(packet) => {
                let requests = &mut self.link.statistics.requests;
                *requests = requests.saturating_add(1);
                Some((packet.number, packet.body))
            }
            Err(error) => {
                self.reject(error);
                None
            }
        }
    }

    /// Counts a frame that is no valid request, and refuses it if it is a whole packet.
    fn reject(&mut self, error: PacketError) {
        let link = &mut self.link;
        link.statistics.bad_packets = link.statistics.bad_packets.saturating_add(1);
        let (number, refusal) = match error {
            PacketError::Damaged => return,
            PacketError::OtherVersion { number, .. } => {
                (number, Refusal::Version(PROTOCOL_VERSION))
            }
            PacketError::NotAMessage { number } => (number, Refusal::Unknown),
        };
        link.send(number, &Report::Refused(refusal));
    }
}

impl Models {
    fn identity<'i, P: Platform, S: Slot, const ROWS: usize>(
        &self,
        model: &'i InForce<'_, ROWS>,
        wires_crc_32: u32,
        spare: &S,
        link: &mut Link<'_, P>,
    ) -> Identity<'i> {
        Identity {
            board: P::BOARD,
            firmware: env!("CARGO_PKG_VERSION"),
            rows: self.capacity.rows as u8,
            columns: self.capacity.columns as u8,
            outputs: self.capacity.outputs as u8,
            model: model.identity,
            model_name: model.name(),
            slot_bytes: spare.bytes().len() as u32,
            chunk_bytes: self.capacity.chunk_bytes() as u16,
            memory: link.platform().memory(),
            unique_id: link.platform().unique_id(),
            wires_crc_32,
        }
    }
}
