//! Uploads to a device that answers by a script.

use std::cell::Cell;
use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};
use std::rc::Rc;

use taxel_data::Silent;
use taxel_firmware::link::message::{Configuration, Identity, ModelIdentity, Statistics};
use taxel_firmware::link::packet;
use taxel_firmware::link::receive::{Received, Receiver};

use super::*;
use crate::device::{Wire, framed};

/// Line whose other end answers each request by `script`, not before it has had its `time_to_answer`.
struct Scripted<S> {
    script: S,
    receiver: Receiver<Vec<u8>>,
    answers: VecDeque<u8>,
    time_to_answer: Duration,
    asked: Instant,
}

impl<S: FnMut(&Request<'_>) -> Report<'static>> Write for Scripted<S> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.asked = Instant::now();
        for byte in bytes {
            let Some(Received::Frame(frame)) = self.receiver.push(*byte) else { continue };
            let request = packet::decode::<Request<'_>>(frame).expect("a request");
            let mut buffer = [0; 512];
            let report = (self.script)(&request.body);
            let answer = packet::encode(request.number, &report, &mut buffer).expect("room");
            self.answers.extend(framed(answer));
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl<S> Read for Scripted<S> {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        if self.asked.elapsed() < self.time_to_answer {
            std::thread::sleep(Duration::from_millis(1));
            return Err(ErrorKind::TimedOut.into());
        }
        match self.answers.read(bytes)? {
            0 => Err(ErrorKind::TimedOut.into()),
            count => Ok(count),
        }
    }
}

impl<S: FnMut(&Request<'_>) -> Report<'static>> Wire for Scripted<S> {
    fn set_read_timeout(&mut self, _: Duration) -> std::io::Result<()> {
        Ok(())
    }
}

fn device(script: impl FnMut(&Request<'_>) -> Report<'static> + 'static) -> Device {
    slow_device(Duration::ZERO, script)
}

fn slow_device(
    time_to_answer: Duration,
    script: impl FnMut(&Request<'_>) -> Report<'static> + 'static,
) -> Device {
    let receiver = Receiver::new(vec![0; 4096]);
    let (answers, asked) = (VecDeque::new(), Instant::now());
    Device::new(Scripted { script, receiver, answers, time_to_answer, asked }).unwrap()
}

#[test]
fn a_restart_waits_for_a_device_that_is_slow_to_answer() {
    let mut device = slow_device(Duration::from_millis(150), |request| match request {
        Request::Restart => Report::Restarting,
        _ => identity(false),
    });
    device.patience = Duration::from_secs(5);
    assert_eq!(device.restart().unwrap().board, "scripted");
}

/// Device of one reading whose model has the CRC-32 7.
pub fn identity(on_trial: bool) -> Report<'static> {
    let model =
        ModelIdentity { crc_32: 7, rows: 1, inputs: 1, outputs: 1, on_trial, ..Default::default() };
    Report::Identity(Identity { board: "scripted", model: Some(model), ..Default::default() })
}

#[test]
fn a_model_that_decodes_no_frame_is_given_up() {
    for (flags, is_seen) in [(0, true), (EstimateReport::NO_MODEL, false)] {
        let mut device = device(move |request| match request {
            Request::Identify => identity(true),
            _ => Report::Estimate(EstimateReport { flags, ..Default::default() }),
        });
        assert_eq!(see_estimate(&mut device, 7).is_ok(), is_seen);
    }
}

#[test]
fn a_model_that_is_still_on_trial_is_not_told_as_confirmed() {
    for on_trial in [false, true] {
        let mut device = device(move |request| match request {
            Request::Identify => identity(on_trial),
            _ => Report::Upload(UploadState::Confirmed { crc_32: 7 }),
        });
        assert_eq!(confirm(&mut device).is_err(), on_trial);
    }
}

#[test]
fn an_upload_waits_for_two_frames_of_the_new_model() {
    let configuration = Configuration { frame_period_us: 1000, ..Configuration::DEFAULT };
    let asked = Rc::new(Cell::new(0));
    let counted = asked.clone();
    let mut device = device(move |request| {
        if *request == Request::Configuration {
            return Report::Configuration(configuration);
        }
        counted.set(counted.get() + 1);
        Report::Statistics(Statistics { frames_decoded: counted.get(), ..Statistics::default() })
    });
    see_frames(&mut device).unwrap();
    assert_eq!(asked.get(), 3);
}

#[test]
fn a_trial_that_nobody_ended_does_not_block_an_upload() {
    let (mut on_trial, received) = (true, Rc::new(Cell::new(0)));
    let taken = received.clone();
    let mut device = device(move |request| match request {
        Request::Upload(UploadStep::Begin { .. }) if on_trial => Report::Refused(Refusal::OnTrial),
        Request::Upload(UploadStep::Abort) => {
            on_trial = false;
            Report::Upload(UploadState::Idle)
        }
        Request::Upload(UploadStep::Chunk { bytes, .. }) => {
            taken.set(taken.get() + bytes.len() as u32);
            Report::Upload(UploadState::Receiving { received: taken.get() })
        }
        Request::Upload(UploadStep::Try { .. }) => {
            Report::Upload(UploadState::OnTrial { crc_32: 7 })
        }
        _ => Report::Upload(UploadState::Receiving { received: 0 }),
    });
    let outcome = send(&mut device, &[1; 8], 4, &Silent).unwrap();
    assert_eq!(outcome, Ok(UploadState::OnTrial { crc_32: 7 }));
    assert_eq!(received.get(), 8);
}

#[test]
fn a_trial_is_prolonged_by_minutes() {
    let asked = Rc::new(Cell::new(0));
    let seen = Rc::clone(&asked);
    let mut device = device(move |request| {
        if let Request::Upload(UploadStep::Try { trial_ms }) = request {
            seen.set(*trial_ms);
        }
        Report::Upload(UploadState::OnTrial { crc_32: 7 })
    });
    prolong_trial(&mut device, 5).unwrap();
    assert_eq!(asked.get(), 300_000);
}
