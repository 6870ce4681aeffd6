//! A device scans the wires that its model's inputs are named after, in any order, any set: on a virtual board, of which
//! every reading has its place.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use taxel_core::Decoder;
use taxel_core::blob::{Columns, Metadata, ModelShape};
use taxel_data::{Purpose, Random, Silent, Stream};
use taxel_firmware::link::message::{Configuration, Report};
use taxel_firmware::readout::{FrameSource, ScanReport, ScanSettings, Selection};
use taxel_rig::device::{Device, upload};
use taxel_simulate::World;

use crate::virtual_board::{Series, VirtualBoard, VirtualScanner, WIRES, all_readings};
use crate::virtual_device::mailbox::pair;
use crate::virtual_device::{Line, run_with};

#[path = "../../../firmware/tests/mock/row_model.rs"]
mod row_model;

use row_model::blob_of_a_row;

/// The firmware's scanner on a virtual board with a pressed sensor, in whatever thread scans it.
#[derive(Clone)]
struct Pressed;

/// The firmware's scanner, and the pressed sensor before it.
fn scanner() -> VirtualScanner {
    let board = VirtualBoard::new(Series::NONE);
    board.set_readings(all_readings(&World::press(), 1).lines().next().unwrap());
    board.scanner()
}

impl FrameSource for Pressed {
    fn scan(
        &mut self,
        settings: ScanSettings,
        wires: Selection<'_>,
        frame: &mut [f32],
    ) -> ScanReport {
        thread_local! {
            static SCANNER: RefCell<VirtualScanner> = RefCell::new(scanner());
        }
        SCANNER.with_borrow_mut(|scanner| scanner.scan(settings, wires, frame))
    }
}

/// A random subset of the cells between random wires, in a random order, by index in a frame of all wires.
fn cells(random: &mut Random) -> Vec<usize> {
    let mut some = |of: usize| -> Vec<usize> {
        let share = 1 + random.below(4);
        (0..of).filter(|_| random.below(4) < share).collect()
    };
    let (rows, columns) = (some(8), some(18));
    let between = |row: &usize| columns.iter().map(|column| 18 * row + column).collect::<Vec<_>>();
    let mut cells: Vec<usize> = rows.iter().flat_map(between).collect();
    if random.below(2) == 0 {
        cells.retain(|_| random.below(3) > 0);
    }
    if random.below(4) > 0 {
        for last in (1..cells.len()).rev() {
            cells.swap(last, random.below(last + 1));
        }
    }
    if cells.is_empty() { vec![random.below(144)] } else { cells }
}

#[test]
fn fifty_random_subsets_of_wires_are_read_and_decoded_as_on_the_virtual_board() {
    let mut readings_ohm = vec![f32::NAN; 144];
    scanner().scan(Configuration::DEFAULT.scan, WIRES, &mut readings_ohm);
    let different: BTreeSet<u32> = readings_ohm.iter().map(|ohm| ohm.to_bits()).collect();
    assert!(different.len() > 100, "readings of other places must show");

    let (near, far) = pair();
    run_with(far, Line { one_in: None }, &[], Pressed);
    let mut device = Device::new(near).unwrap();
    device.patience = Duration::from_secs(5);
    let mut random = Random::new(11, Stream::Test, Purpose::Damage, 0, 0);
    let mut in_order = 0;
    for subset in 0..50 {
        let cells = cells(&mut random);
        in_order += usize::from(cells.is_sorted());
        let name = |cell: &usize| format!("r{}c{}_ohm", cell / 18 + 1, cell % 18 + 1);
        let names: Vec<String> = cells.iter().map(name).collect();
        let (shape, text) =
            (ModelShape { rows: 1, inputs: cells.len(), outputs: 2 }, names.join("\n"));
        let metadata = Metadata { input_names: Columns(&text), ..Metadata::unnamed(shape) };
        let blob = blob_of_a_row(shape, metadata);
        let identity = upload::replace(&mut device, &blob, &Silent).unwrap();
        let is_grid = cells.iter().enumerate().all(|(place, cell)| place == *cell);
        assert_eq!(identity.wires().is_some(), is_grid, "{names:?}");

        let expected: Vec<f32> = cells.iter().map(|cell| readings_ohm[*cell]).collect();
        let outputs = Decoder::<1>::load(&blob).unwrap().decode(&*expected).unwrap().outputs;
        let scanning = Configuration {
            frame_period_us: 1000,
            send_readings: true,
            send_estimates: true,
            ..Configuration::DEFAULT
        };
        let (readings, estimate) = device
            .while_paused(|device| {
                device.configure(scanning)?;
                let mut readings = None;
                device.hear(Instant::now() + Duration::from_secs(10), |_, report| match report {
                    Report::Readings { readings_ohm, .. } => {
                        readings = Some(readings_ohm.iter().map(f32::to_bits).collect::<Vec<_>>());
                        None
                    }
                    Report::Estimate(estimate) => {
                        let outputs = estimate.outputs.iter().map(f32::to_bits).collect::<Vec<_>>();
                        readings.take().map(|readings| (readings, outputs))
                    }
                    _ => None,
                })
            })
            .unwrap()
            .expect("frames");
        let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(readings, bits(&expected), "subset {subset}: {names:?}");
        assert_eq!(estimate, bits(&outputs), "subset {subset}: {names:?}");
    }
    assert!((2..48).contains(&in_order), "{in_order} subsets in the order of their wires");
}
