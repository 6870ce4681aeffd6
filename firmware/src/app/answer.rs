//! Requests and their answers.

use model_core::blob::Floats;
use model_core::exp::{ExpKernel, Polynomial};

use super::model::{self, InForce};
use super::session::Session;
use super::session_end::SessionEnd;
use super::{Capture, Core};
use crate::circuit::{Constants, ConstantsFault};
use crate::link::message::{
    ConfidenceSent, Configuration, Identity, KeyState, Refusal, Report, Request, UploadState,
    UploadStep,
};
use crate::link::packet::{self, PROTOCOL_VERSION, PacketError};
use crate::link::receive::Received;
use crate::log::{info, warning};
use crate::platform::Platform;
use crate::readout::FrameSource;
use crate::seal::Key;
use crate::store::Slot;

/// Largest chunk of an upload in bytes: it leaves room for the rest of the message, and every board can keep it
/// while it writes the previous chunk.
const LARGEST_CHUNK_BYTES: usize = 512;

const fn chunk_bytes(message_bytes: usize) -> usize {
    let room = message_bytes.saturating_sub(24) / 4 * 4;
    if room < LARGEST_CHUNK_BYTES { room } else { LARGEST_CHUNK_BYTES }
}

impl<P: Platform, F: FrameSource, S: Slot, const ROWS: usize> Session<'_, '_, P, F, S, ROWS> {
    /// Receives bytes until a frame is complete or no more bytes are there, and answers the frame's request.
    pub(super) fn serve_link(&mut self) -> Option<SessionEnd> {
        let app = &mut *self.app;
        // Bounded, so that a host that never pauses does not keep the sensor from being scanned.
        for _ in 0..app.core.capacity.message_bytes() {
            let byte = app.core.line.platform().receive()?;
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
        let packet = match received {
            Received::Frame(bytes) => packet::decode::<Request<'_>>(bytes),
            Received::Broken | Received::TooLong => Err(PacketError::Damaged),
        };
        let (number, request) = match packet {
            Ok(packet) => (packet.number, packet.body),
            Err(error) => {
                self.reject(error);
                return None;
            }
        };
        self.statistics.requests = self.statistics.requests.saturating_add(1);
        if !request.only_asks() {
            self.lease.hear(self.line.platform().now_us());
        }
        let mut end = None;
        let report = match request {
            Request::Identify => Ok(Report::Identity(self.identity(model, spare))),
            Request::Statistics => Ok(Report::Statistics(self.statistics)),
            Request::Configuration => Ok(self.configuration()),
            Request::Configure { configuration, lease_ms } => {
                self.configure(configuration, lease_ms)
            }
            Request::Resume => {
                self.resume();
                Ok(self.configuration())
            }
            Request::CaptureBaseline { frames } => match self.capture_baseline(number, frames) {
                Ok(()) => return None,
                Err(refusal) => Err(refusal),
            },
            Request::Decode { frame, readings_ohm } => {
                match self.decode_readings(number, frame, readings_ohm, model) {
                    Ok(()) => return None,
                    Err(refusal) => Err(refusal),
                }
            }
            Request::SetBaseline { readings_ohm } => {
                match self.set_baseline(number, readings_ohm, model) {
                    Ok(()) => return None,
                    Err(refusal) => Err(refusal),
                }
            }
            Request::Upload(UploadStep::Confirm) if self.trial.is_going_on() => {
                self.trial.confirm(number);
                return Some(SessionEnd::Confirm);
            }
            Request::Upload(step) => self
                .upload_step(step, model, spare, &mut end)
                .map(|()| Report::Upload(self.upload.state())),
            Request::Undo { crc_32 } => self
                .undo(crc_32, model, spare, &mut end)
                .map(|crc_32| Report::Upload(UploadState::Confirmed { crc_32 })),
            Request::Restart => {
                info!("restart asked for");
                end = Some(SessionEnd::Restart);
                Ok(Report::Restarting)
            }
            Request::Constants => {
                self.send_constants(number);
                return None;
            }
            Request::SetConstants(constants) => match self.set_constants(constants, model) {
                Ok(()) => {
                    self.send_constants(number);
                    return None;
                }
                Err(fault) => Err(Refusal::Constants(fault)),
            },
            Request::Kept => Ok(Report::Kept(self.kept())),
            Request::Keep(setting) => self.keep(setting).map(|()| Report::Kept(self.kept())),
            Request::Forget(setting) => self.forget(setting).map(|()| Report::Kept(self.kept())),
            Request::Provision { key } => self.provision(&key, &mut end),
        };
        self.line.send(number, &report.unwrap_or_else(Report::Refused), &mut self.statistics);
        end
    }

    /// Prepares `spare` for a blob of `length` bytes. The watchdog is fed just before and after an erase, which may take
    /// half of its period.
    fn begin_upload<S: Slot>(&mut self, spare: &mut S, length: usize) -> Result<(), Refusal> {
        let now_us = self.now_us();
        let mut is_erased = false;
        let platform = self.line.platform();
        let begun = self.upload.begin(spare, length, now_us, || {
            platform.feed_watchdog();
            is_erased = true;
        });
        if is_erased {
            let erases = &mut self.statistics.slot_erases;
            *erases = erases.saturating_add(1);
        }
        begun
    }

    /// Sets the device's key. Models without a seal are left at once, and not only at the next restart.
    fn provision(
        &mut self,
        key: &Key,
        end: &mut Option<SessionEnd>,
    ) -> Result<Report<'static>, Refusal> {
        if self.trial.is_going_on() {
            return Err(Refusal::OnTrial);
        }
        let had_none = self.authenticity.key_state() == KeyState::None;
        let platform = self.line.platform();
        if had_none {
            platform.feed_watchdog(); // it may erase flash
        }
        self.authenticity.provision(platform.key_area(), key)?;
        if had_none {
            info!("the device has a key from now on");
            self.upload.forget();
            *end = Some(SessionEnd::NewModel);
        }
        Ok(Report::Provisioned)
    }

    /// Puts constants in force. A baseline that was read with others means nothing any more.
    fn set_constants(
        &mut self,
        constants: Constants<'_>,
        model: &InForce<'_, ROWS>,
    ) -> Result<(), ConstantsFault> {
        let before = self.constants_crc();
        self.source.set_constants(constants)?;
        if self.constants_crc() != before {
            self.give_up_capture();
            self.baseline.restart(self.wires.readings());
            self.load_baseline();
            self.decode_baseline(model.decoder.as_ref());
        }
        Ok(())
    }

    fn send_constants(&mut self, number: u16) {
        let constants = self.source.constants().ok_or(Refusal::Constants(ConstantsFault::Fixed));
        let report = constants.map_or_else(Report::Refused, Report::Constants);
        self.line.send(number, &report, &mut self.statistics);
    }

    /// Counts a frame that is no valid request, and refuses it if it is a whole packet.
    fn reject(&mut self, error: PacketError) {
        self.statistics.bad_packets = self.statistics.bad_packets.saturating_add(1);
        let (number, refusal) = match error {
            PacketError::Damaged => return,
            PacketError::OtherVersion { number, .. } => {
                (number, Refusal::Version(PROTOCOL_VERSION))
            }
            PacketError::NotAMessage { number } => (number, Refusal::Unknown),
        };
        self.line.send(number, &Report::Refused(refusal), &mut self.statistics);
    }

    fn identity<'i, S: Slot>(&mut self, model: &'i InForce<'_, ROWS>, spare: &S) -> Identity<'i> {
        Identity {
            board: P::BOARD,
            firmware: env!("CARGO_PKG_VERSION"),
            rows: self.capacity.rows as u8,
            columns: self.capacity.columns as u8,
            outputs: self.capacity.outputs as u8,
            kernel: Polynomial::NAME,
            model: model.identity,
            model_name: model.name(),
            slot_bytes: self.authenticity.capacity(spare.bytes()) as u32,
            chunk_bytes: chunk_bytes(self.capacity.message_bytes()) as u16,
            memory: self.line.platform().memory(),
            key: self.authenticity.key_state(),
            highest_version: self.authenticity.highest(),
        }
    }

    fn configuration(&mut self) -> Report<'static> {
        let lease_left_ms = self.lease.left_ms(self.line.platform().now_us());
        Report::Configuration { configuration: self.configuration, lease_left_ms }
    }

    fn configure(
        &mut self,
        configuration: Configuration,
        lease_ms: u32,
    ) -> Result<Report<'static>, Refusal> {
        configuration.check().map_err(Refusal::Configuration)?;
        if lease_ms == 0 {
            self.own_configuration = configuration;
        }
        self.lease.set(lease_ms);
        self.put_in_force(configuration);
        Ok(self.configuration())
    }

    /// Ends a lease: puts the device's own configuration in force.
    fn resume(&mut self) {
        self.lease.set(0);
        self.put_in_force(self.own_configuration);
    }

    /// Ends what a host has begun and not gone on with, when the clock shows `now_us`.
    pub(super) fn end_leases(&mut self, now_us: u32) {
        if self.lease.has_ended(now_us) {
            warning!("the host is silent: back to the own configuration");
            self.resume();
        }
        if self.lease.has_upload_ended(now_us) && self.upload.is_receiving() {
            self.upload.abort();
        }
    }

    /// Scans by `configuration` from now on. Nothing changes if it is in force already.
    fn put_in_force(&mut self, configuration: Configuration) {
        if configuration == self.configuration {
            return;
        }
        self.configuration = configuration;
        self.give_up_capture();
        self.sensor_answers |= configuration.frame_period_us == 0; // it is not scanned any more
        self.clock.restart(self.line.platform().now_us());
        info!("configured: a frame every {=u32} us", configuration.frame_period_us);
    }

    fn capture_baseline(&mut self, number: u16, frames: u16) -> Result<(), Refusal> {
        if frames == 0 || self.configuration.frame_period_us == 0 {
            return Err(Refusal::Baseline);
        }
        let is_repeated = |capture: Capture| (capture.number, capture.frames) == (number, frames);
        if self.capture.is_some_and(is_repeated) {
            return Ok(()); // the answer takes a while
        }
        self.give_up_capture();
        self.baseline.restart(self.wires.readings());
        self.capture = Some(Capture { number, frames, left: frames });
        Ok(())
    }

    /// Refuses the request that waits for a baseline, if there is one: no baseline will come.
    pub(super) fn give_up_capture(&mut self) {
        if let Some(Capture { number, .. }) = self.capture.take() {
            self.baseline.restart(self.wires.readings());
            self.line.send(number, &Report::Refused(Refusal::Baseline), &mut self.statistics);
        }
    }

    fn set_baseline(
        &mut self,
        number: u16,
        readings_ohm: Floats<'_>,
        model: &InForce<'_, ROWS>,
    ) -> Result<(), Refusal> {
        self.check_length(readings_ohm)?;
        self.give_up_capture();
        self.set_frame(readings_ohm.iter());
        self.baseline.restart(self.wires.readings());
        self.baseline.add(self.frame);
        self.decode_baseline(model.decoder.as_ref());
        let report = Report::Baseline { readings_ohm: Floats::new(self.baseline.mean()) };
        self.line.send(number, &report, &mut self.statistics);
        Ok(())
    }

    /// Checks that there are as many readings as are scanned.
    fn check_length(&self, readings_ohm: Floats<'_>) -> Result<(), Refusal> {
        let expected = self.wires.readings();
        if readings_ohm.0.len() == 4 * expected {
            Ok(())
        } else {
            Err(Refusal::FrameLength { expected: expected as u16 })
        }
    }

    fn decode_readings(
        &mut self,
        number: u16,
        frame: u32,
        readings_ohm: Floats<'_>,
        model: &InForce<'_, ROWS>,
    ) -> Result<(), Refusal> {
        self.check_length(readings_ohm)?;
        self.set_frame(readings_ohm.iter());
        let decoder = model.decoder.as_ref();
        let (mut flags, _) = self.decode(decoder);
        let sent = ConfidenceSent::Deviations;
        let novelty = self.assess(decoder, sent, &mut flags);
        self.send_estimate(number, frame, 0, flags, (novelty, sent));
        Ok(())
    }

    fn upload_step<S: Slot>(
        &mut self,
        step: UploadStep<'_>,
        model: &InForce<'_, ROWS>,
        spare: &mut S,
        end: &mut Option<SessionEnd>,
    ) -> Result<(), Refusal> {
        match step {
            UploadStep::Begin { head } => {
                if self.trial.is_going_on() {
                    return Err(Refusal::OnTrial); // the spare slot has the previous model
                }
                let length = model::check_head(self.capacity, head).map_err(Refusal::BadModel)?;
                if model.generation() == u32::MAX {
                    return Err(Refusal::LastGeneration);
                }
                let most = self.authenticity.capacity(spare.bytes());
                if length > most {
                    return Err(Refusal::TooLarge { slot_bytes: most as u32 });
                }
                info!("upload of {=usize} bytes begins", length);
                self.begin_upload(spare, length)
            }
            UploadStep::Chunk { offset, bytes } => self.upload.chunk(spare, offset, bytes),
            UploadStep::Abort => {
                if self.end_trial() {
                    *end = Some(SessionEnd::NewModel);
                }
                self.upload.abort();
                Ok(())
            }
            UploadStep::Try { seal } => {
                if self.trial.is_going_on() {
                    return Ok(()); // the host repeats the request, because the answer was lost
                }
                let blob = self.upload.complete(spare)?;
                let checked = model::check(self.capacity, blob).map_err(Refusal::BadModel);
                let checked = checked.and_then(|model| {
                    self.authenticity.check(blob, seal)?;
                    Ok(model.crc())
                });
                let crc_32 = checked.inspect_err(|_| {
                    warning!("uploaded model refused");
                    self.upload.abort();
                })?;
                if let Some(seal) = seal {
                    self.upload.seal(spare, &seal)?;
                }
                info!("model {=u32:08x} on trial", crc_32);
                self.upload.begin_trial(crc_32);
                // Without a model, slot 1 is the spare one.
                self.trial.begin(model.identity.map_or(1, |model| 1 - model.slot.min(1)));
                *end = Some(SessionEnd::NewModel);
                Ok(())
            }
            // Nothing is on trial. The answer was lost, if it was confirmed.
            UploadStep::Confirm => match self.upload.state() {
                UploadState::Confirmed { .. } => Ok(()),
                _ => Err(Refusal::NoUpload),
            },
        }
    }
}
