//! The whole device, at the end of a line that says anything at any time, and loses its power at any time.
//!
//! Bytes are steps, each an operation, a length and so many bytes of it: raw bytes, packets whose CRC is right, steps of
//! an upload, passing time, a host that does not read, readings, restarts and power cuts. Whatever came before, a device
//! that has power answers, and has a model in force. What is decoded of a packet is the same when it is sent again.
#![no_main]

use std::ops::ControlFlow;

use libfuzzer_sys::fuzz_target;
use taxel_core::AlignedBytes;
use taxel_core::checksum::CRC_32;
use taxel_firmware::app::SessionEnd;
use taxel_firmware::link::message::{Report, Request};
use taxel_firmware::link::packet::PROTOCOL_VERSION;
use taxel_firmware::link::{cobs, packet};

#[path = "../../../firmware/tests/mock/mod.rs"]
#[expect(dead_code, unused_imports, reason = "the firmware's tests use all of it")]
mod mock;

use mock::{Device, Flash, Host, blob, request_bytes, trial_steps};

/// Most starts of the device in one run.
const MOST_STARTS: usize = 12;
/// Most turns of the loop for the bytes of one step: far more than are needed.
const MOST_TURNS: usize = 20_000;
/// Number of the requests of an upload.
const NUMBER: u16 = 9;

fuzz_target!(|bytes: &[u8]| {
    let models = [blob(3, 4), blob(4, 3), blob(5, 6)];
    let mut device = Device::new(Flash::slots_with(&models[0]));
    device.ram_words = 0;
    let mut steps = Steps(bytes);
    for _ in 0..MOST_STARTS {
        // The journal has a power of its own, which is cut alike.
        let supply = device.journal.pages()[0].supply();
        supply.borrow_mut().on(device.cut_after);
        let end = device.session(|host| Life { host }.run(&mut steps, &models));
        let ControlFlow::Continue(cut_after) = end else { return };
        device.cut_after = cut_after;
    }
});

/// Steps that are left.
struct Steps<'b>(&'b [u8]);

impl<'b> Iterator for Steps<'b> {
    type Item = (u8, &'b [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let (operation, rest) = self.0.split_first()?;
        let (length, rest) = rest.split_first().unwrap_or((&0, rest));
        let (bytes, rest) = rest.split_at(rest.len().min(usize::from(*length)));
        self.0 = rest;
        Some((*operation, bytes))
    }
}

/// Decodes a packet of a message `$kind`. What is found must be the same when it is encoded and decoded again. Messages
/// borrow, so this is written once for each kind.
macro_rules! same_again {
    ($kind:ty, $packet:expr) => {
        if let Ok(found) = packet::decode::<$kind>($packet) {
            let mut buffer = vec![0; $packet.len()];
            // Numbers may arrive longer than they need to be, but are not sent so.
            let again = packet::encode(found.number, &found.body, &mut buffer).expect("no longer");
            let again = packet::decode::<$kind>(again).expect("what was just encoded");
            // As texts, in which NaN equals NaN.
            assert_eq!(format!("{found:?}"), format!("{again:?}"));
        }
    };
}

/// A device from a start to the next.
struct Life<'d, 'b, 'm> {
    host: &'d mut Host<'b, 'm>,
}

impl Life<'_, '_, '_> {
    /// Takes steps up to a restart; breaks if none are left, else returns the operation at which the power is cut next.
    fn run(
        mut self,
        steps: &mut Steps<'_>,
        models: &[AlignedBytes; 3],
    ) -> ControlFlow<(), Option<u64>> {
        self.answers();
        for (operation, bytes) in steps.by_ref() {
            match operation % 12 {
                10 => return ControlFlow::Continue(None),
                11 => {
                    return ControlFlow::Continue(Some(u64::from(number_of(bytes) % 1024)));
                }
                operation => {
                    let end = self.step(operation, bytes, models);
                    // A first request may end a frame that the bytes have begun. The next is answered.
                    let identify = || request_bytes(NUMBER, &Request::Identify);
                    if end.or_else(|| self.send(identify())).is_some() {
                        return ControlFlow::Continue(None);
                    }
                    self.answers();
                }
            }
        }
        ControlFlow::Break(())
    }

    /// Takes a step; returns why the session ended, if it did.
    fn step(
        &mut self,
        operation: u8,
        bytes: &[u8],
        models: &[AlignedBytes; 3],
    ) -> Option<SessionEnd> {
        match operation {
            0 => self.send(bytes.to_vec()),
            1..=4 => {
                // A packet of this protocol, whatever message the bytes are.
                let covered = [&[PROTOCOL_VERSION, operation], bytes].concat();
                let packet = [&covered[..], &CRC_32.checksum(&covered).to_le_bytes()].concat();
                same_again!(Request<'_>, &packet);
                same_again!(Report<'_>, &packet);
                let mut line = Vec::new();
                cobs::encode(&packet, |piece| {
                    line.extend_from_slice(piece);
                    true
                });
                self.send(line)
            }
            5 | 6 => {
                let mut choices = bytes.iter().map(|byte| usize::from(*byte));
                let model = &models[choices.next().unwrap_or(0) % models.len()];
                let (from, count) = (choices.next().unwrap_or(0), choices.next().unwrap_or(255));
                let steps = trial_steps(model).into_iter().skip(from).take(count);
                steps.map(Request::Upload).find_map(|it| self.send(request_bytes(NUMBER, &it)))
            }
            7 => self.host.pass(number_of(bytes)),
            8 => {
                // A host that takes a few bytes more, and then reads on.
                self.host.pins_mut().room = Some(number_of(bytes) as usize % 512);
                let end = self.send(request_bytes(NUMBER, &Request::Statistics));
                self.host.pins_mut().room = None;
                end
            }
            _ => {
                let mut frame = self.host.frame();
                let readings = frame.as_flattened_mut().iter_mut();
                readings
                    .zip(bytes.as_chunks().0)
                    .for_each(|(ohm, it)| *ohm = f32::from_le_bytes(*it));
                drop(frame);
                self.host.step()
            }
        }
    }

    /// Sends bytes, and runs until the device has read them.
    fn send(&mut self, bytes: Vec<u8>) -> Option<SessionEnd> {
        self.host.pins_mut().to_device.extend(bytes);
        let mut turns = 0;
        while !self.host.pins().to_device.is_empty() {
            if let Some(end) = self.host.step() {
                return Some(end);
            }
            turns += 1;
            assert!(turns < MOST_TURNS, "the device reads no more");
        }
        self.host.pins_mut().to_host.clear();
        None
    }

    /// Checks that the device answers, and has a model in force.
    fn answers(&mut self) {
        assert!(self.host.model_crc().is_some(), "no model in force");
    }
}

/// The first four bytes as a number.
fn number_of(bytes: &[u8]) -> u32 {
    bytes.iter().take(4).fold(0, |number, byte| number << 8 | u32::from(*byte))
}
