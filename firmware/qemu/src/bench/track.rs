//! Tracks a contact, for `cargo xtask cycles`, which counts instructions as it does of the program beside this one. The
//! model in slot A has a tracker; slot B holds a frame of its readings in Ω.
#![no_std]
#![no_main]

mod region;

use core::hint::black_box;

use board_common::region::take_weights;
use cortex_m_rt::entry;
use defmt::{assert, unwrap};
use qemu_image::exit;
use qemu_image::slot::Slot;
use taxel_core::blob::Model;
use taxel_core::track::{Frame, State};
use taxel_core::{Estimate, RowStatus};

use region::{calibrate, region};

/// Most rows of a model.
const MOST_ROWS: usize = 32;

/// Frames, a millisecond apart, after which a contact has settled.
const SETTLED: u64 = 20;

#[entry]
fn main() -> ! {
    calibrate();
    // SAFETY: the slots, and the RAM for weights, are taken here only.
    let (([slot, frame], ..), ram) = unsafe { (Slot::take(), take_weights()) };
    let length = unwrap!(Model::declared_length(slot.bytes()), "slot A holds no model");
    let blob = unwrap!(slot.bytes().get(..length), "the model in slot A is cut off");
    let model = unwrap!(Model::decode(blob).ok(), "the model in slot A is unsound");
    let tracker = unwrap!(model.tracker(), "the model in slot A has no tracker");
    let shape = model.shape();
    let ram: &'static mut [f32] = bytemuck::cast_slice_mut(ram);
    ram.fill(0.0);
    let (outputs, ram) = unwrap!(ram.split_at_mut_checked(shape.rows * shape.outputs));
    let readings_ohm = unwrap!(ram.get_mut(..shape.rows * shape.inputs));
    for (reading, bytes) in readings_ohm.iter_mut().zip(frame.bytes().as_chunks().0) {
        *reading = f32::from_le_bytes(*bytes);
    }
    let mut status = [RowStatus::MissingReading; MOST_ROWS];
    let mut estimate = Estimate { outputs, status: unwrap!(status.get_mut(..shape.rows)) };
    let state = unwrap!(cortex_m::singleton!(: State = State::new()));
    let row_us = [0.0; MOST_ROWS];
    let row_us = unwrap!(row_us.get(..shape.rows));
    let at =
        |start_us| Frame { readings_ohm, reciprocals: None, start_us, row_us, ahead_us: 1000.0 };
    for frame in 0..SETTLED {
        let frame = at(1000 * frame);
        if !tracker.follow(state, &frame, &mut estimate) {
            tracker.start(state, &frame, &mut estimate);
        }
    }
    let (frame, mut explained) = (at(1000 * SETTLED), false);
    region("track", || {
        explained = black_box(&tracker).follow(black_box(state), black_box(&frame), &mut estimate);
    });
    assert!(explained, "the frame is not explained");
    exit::success()
}
