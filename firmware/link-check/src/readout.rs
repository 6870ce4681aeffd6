//! Calls every way of reading a frame, with pins and buses that are opaque to the optimiser.

use core::array;

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{self, OutputPin};
use embedded_hal::spi::{self, Operation, SpiDevice};
use taxel_core::{ColumnWires, RowWire};
use taxel_firmware::circuit::ZeroPotential;
use taxel_firmware::readout::{
    Baseline, FrameSource, Mcp3208s, PassScanner, ScanSettings, Scanner, Selection, Sequencer,
    SequencerFault, ShiftRegister595, add_samples,
};
use taxel_firmware::timing;

use crate::minimal;
use crate::opaque::opaque;

/// Pin, bus, clock and converter in one, which may fail or return anything.
#[derive(Clone, Copy)]
struct Part;

impl digital::ErrorType for Part {
    type Error = digital::ErrorKind;
}

impl OutputPin for Part {
    fn set_low(&mut self) -> Result<(), Self::Error> {
        opaque(Ok(()))
    }

    fn set_high(&mut self) -> Result<(), Self::Error> {
        opaque(Ok(()))
    }
}

impl spi::ErrorType for Part {
    type Error = spi::ErrorKind;
}

impl SpiDevice for Part {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Self::Error> {
        for operation in operations {
            if let Operation::TransferInPlace(bytes) = operation {
                bytes.iter_mut().for_each(|byte| *byte = opaque(*byte));
            }
        }
        opaque(Ok(()))
    }
}

impl DelayNs for Part {
    fn delay_ns(&mut self, ns: u32) {
        opaque(ns);
    }
}

fn scan() {
    let drive = ShiftRegister595::<_, 8> { data: Part, clock: Part, latch: Part };
    let circuit = opaque(ZeroPotential::TYPICAL);
    let mut scanner =
        Scanner::<_, _, _, 8, 18>::new(drive, Mcp3208s { chips: [Part; 3] }, Part, circuit);
    let settings = ScanSettings { settling_us: opaque(46), oversampling: opaque(2) };
    let rows: [RowWire; 8] = array::from_fn(|_| RowWire(opaque(0)));
    let wires = Selection { rows: &rows, columns: ColumnWires(opaque(0x24904)) };
    let mut frame = [0.0; 144];
    let Some(frame) = frame.get_mut(..opaque(144)) else { return };
    opaque(scanner.scan(settings, wires, frame).failed_samples);

    let mut memory = [0.0; 144];
    let mut baseline = Baseline::new(&mut memory);
    baseline.restart(opaque(144));
    baseline.add(frame);
    baseline.add(frame);
    opaque(baseline.frames());
    opaque(baseline.largest_relative_deviation(frame));
}

impl Sequencer<18> for Part {
    const FULL_SCALE_COUNTS: u16 = 4095;
    const MOST_SAMPLES: u16 = timing::ONCHIP_SAMPLES;

    fn start(&mut self, rows: &[Option<RowWire>], settling_us: u32, samples: u16) {
        opaque((rows, timing::RowCounts::new(settling_us, samples, opaque(180))));
    }

    fn poll(&mut self, sums: &mut [[u32; 18]]) -> Option<Result<(), SequencerFault>> {
        add_samples(&opaque([4000; 36]), opaque(1), sums);
        opaque(None)
    }

    fn stop(&mut self) {
        opaque(());
    }
}

fn scan_by_passes() {
    let mut sums = [[0; 18]; 9];
    let circuit = ZeroPotential::<8, 18>::TYPICAL;
    let mut scanner = PassScanner::new(Part, circuit, &mut sums);
    let rows: [RowWire; 8] = array::from_fn(|row| RowWire(opaque(row)));
    let wires = Selection { rows: &rows, columns: ColumnWires(opaque(0x3_FFFF)) };
    let settings = ScanSettings { settling_us: opaque(20), oversampling: opaque(12) };
    let mut frame = [0.0; 144];
    opaque(scanner.scan(settings, wires, &mut frame));
    if scanner.start(settings, wires) && scanner.poll() {
        opaque(scanner.take(&mut frame));
    }
    scanner.stop();
    opaque(frame);
}

pub fn exercise() {
    scan_by_passes();
    scan();

    let mut sensor = minimal::Sensor::new([Part; 3], [Part; 3], Part);
    opaque(sensor.estimate_dz_mm());

    let plan = timing::ScanPlan {
        rows: opaque(8),
        columns: opaque(18),
        board_columns: opaque(18),
        settling_us: opaque(20),
        oversampling: opaque(2),
        pass_samples: opaque(16),
        sample_ns: timing::spi_transfer_ns(opaque(3), opaque(1_000_000)),
        reading_ns: opaque(1_000),
        row_ns: opaque(5_000),
        between_passes_ns: opaque(61_000),
    };
    opaque(plan.scan_us());
    opaque(plan.longest_us());
    opaque(plan.most_oversampling(opaque(10_000)));
}
