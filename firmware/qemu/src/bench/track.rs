//! What a board does with a frame behind its sums while it tracks a contact, for `cargo xtask cycles`, which counts
//! instructions as it does of the program beside this one. The model in slot A has a tracker; slot B holds a frame of its
//! readings in Ω.
#![no_std]
#![no_main]

mod region;

use core::hint::black_box;

use board_common::region::take_weights;
use cortex_m_rt::entry;
use defmt::{assert, unwrap};
use qemu_image::exit;
use qemu_image::slot::Slot;
use taxel_core::blob::{Floats, Model};
use taxel_core::track::{Frame, State};
use taxel_core::{ColumnWires, Estimate, RowStatus, RowWire};
use taxel_firmware::circuit::ZeroPotential;
use taxel_firmware::link::message::{EstimateReport, Report};
use taxel_firmware::link::{cobs, packet};
use taxel_firmware::readout::{
    FrameSource, PassScanner, RowTimes, ScanSettings, Scanning, Selection, Sequencer,
    SequencerFault,
};

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
    if (shape.rows, shape.inputs) == (ROWS, COLUMNS) {
        convert_sums();
    }
    let mut status = [RowStatus::MissingReading; MOST_ROWS];
    let mut estimate = Estimate { outputs, status: unwrap!(status.get_mut(..shape.rows)) };
    let state = unwrap!(cortex_m::singleton!(: State = State::new()));
    let row_us = [0.0; MOST_ROWS];
    let row_us = unwrap!(row_us.get(..shape.rows));
    let at = |start_us| Frame { readings_ohm, reciprocals: None, start_us, row_us };
    for frame in 0..SETTLED {
        let frame = at(1000 * frame);
        if !tracker.follow(state, &frame) {
            tracker.start(state, &frame, &estimate);
        }
    }
    let (frame, mut explained) = (at(1000 * SETTLED), false);
    region("follow", || {
        explained = black_box(&tracker).follow(black_box(state), black_box(&frame));
    });
    region("write", || {
        black_box(&tracker).write(black_box(state), black_box(1000.0), &mut estimate);
    });
    assert!(explained, "the frame is not explained");
    report(&estimate);
    exit::success()
}

/// Makes a report of the `estimate`, and puts it into a ring as the NUCLEO-F446RE does.
fn report(estimate: &Estimate<'_>) {
    let buffer = unwrap!(cortex_m::singleton!(: [u8; 2048] = [0; 2048]));
    let ring = unwrap!(cortex_m::singleton!(: [u8; 2048] = [0; 2048]));
    let row_status = [0; MOST_ROWS];
    let mut queued = 0;
    region("report", || {
        let report = Report::Estimate(EstimateReport {
            frame: 1,
            start_us: 1,
            flags: 0,
            row_status: unwrap!(row_status.get(..estimate.status.len())),
            outputs: Floats::new(black_box(estimate.outputs)),
            novelty: None,
            deviation: Floats::new(&[]),
        });
        let bytes = unwrap!(packet::encode(packet::UNASKED, &report, buffer));
        cobs::encode(bytes, |piece| {
            for byte in piece {
                if let Some(place) = ring.get_mut(queued) {
                    *place = *byte;
                }
                queued = (queued + 1) % 2048;
            }
            true
        });
    });
    assert!(queued > 4 * estimate.outputs.len(), "the report is too short");
}

/// Wires of the board's image.
const ROWS: usize = 8;
const COLUMNS: usize = 18;

/// Sums of samples as of the paper's sensor at rest.
struct Sums;

impl Sequencer<COLUMNS> for Sums {
    const FULL_SCALE_COUNTS: u16 = 4095;
    const MOST_SAMPLES: u16 = 16;

    fn start(&mut self, _: &[Option<RowWire>], _: u32, _: u16) {}

    fn poll(&mut self, sums: &mut [[u32; COLUMNS]]) -> Option<Result<(), SequencerFault>> {
        let (idle, rows) = sums.split_first_mut()?;
        idle.fill(12 * 250);
        rows.as_flattened_mut().fill(12 * 2000);
        Some(Ok(()))
    }

    fn stop(&mut self) {}

    fn line_times(&self, _: usize, _: ScanSettings) -> RowTimes {
        RowTimes::default()
    }
}

/// Turns the sums of a scan of 8 × 18 wires into Ω.
fn convert_sums() {
    let sums =
        unwrap!(cortex_m::singleton!(: [[u32; COLUMNS]; ROWS + 1] = [[0; COLUMNS]; ROWS + 1]));
    let mut scanner =
        PassScanner::<_, ROWS, { ROWS + 1 }, COLUMNS>::new(Sums, ZeroPotential::TYPICAL, sums);
    let Scanning::Runs(scanner) = scanner.scanning() else { return };
    let rows: [RowWire; ROWS] = core::array::from_fn(RowWire);
    let wires = Selection { rows: &rows, columns: ColumnWires::first(COLUMNS) };
    scanner.start(ScanSettings { settling_us: 1, oversampling: 12 }, wires);
    scanner.poll();
    let mut frame = [0.0; ROWS * COLUMNS];
    region("readings", || {
        black_box(&mut *scanner).take(black_box(&mut frame));
    });
    assert!(frame.iter().all(|ohm| ohm.is_finite()), "a reading is missing");
}
