//! Decodes a frame, for `cargo xtask cycles`, which traces this program and counts the instructions of each region. The
//! model lies in slot A, and may have any shape; a frame of its readings in Ω lies in slot B.
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
use taxel_core::filter::{Settings, State};
use taxel_core::{Decoder, Estimate, Frame, RowStatus};

use region::{calibrate, region};

/// Most rows of a model.
const MOST_ROWS: usize = 32;

/// Splits so many `floats`, filled with 0, off the `ram`.
fn split(ram: &'static mut [f32], floats: usize) -> [&'static mut [f32]; 2] {
    let (taken, rest) =
        unwrap!(ram.split_at_mut_checked(floats), "the model is too large for the RAM");
    taken.fill(0.0);
    [taken, rest]
}

#[entry]
fn main() -> ! {
    calibrate();
    // SAFETY: the slots, and the RAM for weights, are taken here only.
    let (([slot, frame], ..), ram) = unsafe { (Slot::take(), take_weights()) };
    let ram: &'static mut [f32] = bytemuck::cast_slice_mut(ram);
    let length = unwrap!(Model::declared_length(slot.bytes()), "slot A holds no model");
    let blob = unwrap!(slot.bytes().get(..length), "the model in slot A is cut off");
    let model = unwrap!(Model::decode(blob).ok(), "the model in slot A is unsound");
    let shape = model.shape();
    let [readings, ram] = split(ram, shape.rows * shape.inputs);
    let bytes = frame.bytes().as_chunks().0;
    readings
        .iter_mut()
        .zip(bytes)
        .for_each(|(reading, bytes)| *reading = f32::from_le_bytes(*bytes));
    let decoder: Decoder<'_, MOST_ROWS> = unwrap!(Decoder::new(model).ok(), "too many rows");
    let [scratch, ram] = split(ram, decoder.scratch_floats());
    let mut status = [RowStatus::MissingReading; MOST_ROWS];
    let [outputs, ram] = split(ram, shape.rows * shape.outputs);
    let mut estimate = Estimate { outputs, status: unwrap!(status.get_mut(..shape.rows)) };

    region("frame", || {
        let frame = Frame { readings_ohm: black_box(readings), reciprocals: &[] };
        let _ = black_box(&decoder).decode_into(frame, black_box(scratch), &mut estimate);
    });
    assert!(estimate.status.iter().all(|row| *row == RowStatus::Decoded), "a row is not decoded");

    let settings = Settings { time_constant_us: 5000, lead_us: 1000 };
    let [tracks, _] = split(ram, 2 * shape.rows * shape.outputs);
    let tracks = tracks.as_chunks_mut().0;
    let mut state = State::new(tracks);
    state.filter(settings, 0, &mut estimate);
    region("filter", || {
        black_box(&mut state).filter(black_box(settings), 1000, black_box(&mut estimate));
    });
    exit::success()
}
