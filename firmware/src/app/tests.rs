//! What only years of frames, or a state that no request can set, would show.

use super::*;
use crate::circuit::{Constants, ConstantsFault};
use crate::link::message::{EstimateReport, Memory, Report, Setting};
use crate::link::packet;
use crate::platform::Port;
use crate::readout::{ScanReport, ScanSettings, Selection};
use crate::settings::{KeepError, Keeper};
use crate::store::FlashError;

/// A board that keeps nothing. Each look at its clock takes a period.
#[derive(Default)]
struct Board {
    now_us: u32,
    sent: Vec<u8>,
    nothing: Nothing,
    key: Blank,
}

#[derive(Default)]
struct Nothing;

impl Keeper for Nothing {
    fn make_firm(&mut self) -> Result<(), KeepError> {
        Ok(())
    }

    fn read<'b>(&mut self, _: Setting, _: &'b mut [u8]) -> Option<&'b [u8]> {
        None
    }

    fn keep(&mut self, _: Setting, _: &[&[u8]]) -> Result<bool, KeepError> {
        Err(KeepError::Failed)
    }
}

impl Port for Board {
    fn now_us(&mut self) -> u32 {
        self.now_us = self.now_us.wrapping_add(1000);
        self.now_us
    }

    fn receive(&mut self) -> Option<u8> {
        None
    }

    fn send(&mut self, byte: u8) -> bool {
        self.sent.push(byte);
        true
    }
}

impl Platform for Board {
    type Settings = Nothing;
    type KeyArea = Blank;

    const BOARD: &'static str = "test";

    fn feed_watchdog(&mut self) {}

    fn memory(&self) -> Memory {
        Memory::default()
    }

    fn settings(&mut self) -> &mut Nothing {
        &mut self.nothing
    }

    fn key_area(&mut self) -> &mut Blank {
        &mut self.key
    }
}

/// A sensor at rest.
struct Sensor;

impl FrameSource for Sensor {
    fn scan(&mut self, _: ScanSettings, _: Selection<'_>, frame: &mut [f32]) -> ScanReport {
        frame.fill(60.0);
        ScanReport { failed_samples: 1 }
    }

    fn constants(&self) -> Option<Constants<'_>> {
        None
    }

    fn set_constants(&mut self, _: Constants<'_>) -> Result<(), ConstantsFault> {
        Err(ConstantsFault::Fixed)
    }
}

#[derive(Default)]
struct Blank;

impl Slot for Blank {
    fn bytes(&self) -> &[u8] {
        &[]
    }

    fn erase(&mut self) -> Result<(), FlashError> {
        Err(FlashError)
    }

    fn write(&mut self, _: usize, _: &[u8]) -> Result<(), FlashError> {
        Err(FlashError)
    }
}

/// Numbers of the frames in these bytes.
fn frames(bytes: &[u8]) -> Vec<u32> {
    let mut receiver = Receiver::new(vec![0; 256]);
    let mut frames = Vec::new();
    for byte in bytes {
        let Some(crate::link::receive::Received::Frame(bytes)) = receiver.push(*byte) else {
            continue;
        };
        if let Report::Estimate(EstimateReport { frame, .. }) =
            packet::decode::<Report<'_>>(bytes).unwrap().body
        {
            frames.push(frame);
        }
    }
    frames
}

#[test]
fn frames_are_numbered_on_past_2_to_the_32_and_other_counters_stop_at_their_largest_value() {
    let mut buffers = Buffers::<2, 3, 2, 256>::new();
    let configuration = Configuration { frame_period_us: 1000, ..Configuration::DEFAULT };
    let mut app: App<'_, _, _, 2> = App::new(Board::default(), Sensor, configuration, &mut buffers);
    let s = &mut app.core.statistics;
    s.frames_scanned = u32::MAX - 2;
    (s.frames_missed, s.failed_samples) = (u32::MAX - 1, u32::MAX - 1);
    let mut slots = [Blank, Blank];
    let mut session = Session::start(&mut app, &mut slots, &mut []);
    for _ in 0..6 {
        assert_eq!(session.step(), None);
    }
    let _ = session;
    assert_eq!(frames(&app.platform().sent), [u32::MAX - 1, u32::MAX, 0, 1, 2, 3]);
    let s = app.core.statistics;
    assert_eq!((s.frames_scanned, s.frames_missed, s.failed_samples), (3, u32::MAX, u32::MAX));
}
