//! The sensor and its circuit.

use taxel_firmware::circuit::{Constants, ConstantsFault, ZeroPotential};
use taxel_firmware::readout::{
    Diagnosis, FrameSource, RowTimes, RunningSource, ScanReport, ScanSettings, Scanning, Selection,
    WaitingSource,
};

use super::board::Board;
use super::shape::{COLS, ROWS};

/// Least time in µs of a scan.
const SCAN_US: u32 = 10;

/// A sensor that shows the same frame until it is given another. Its circuit's constants change nothing.
#[derive(Clone)]
pub struct Source {
    circuit: ZeroPotential<ROWS, COLS>,
    board: Board,
    /// What a scan by itself has read, and the time in µs at which it ends.
    under_way: Option<(Vec<f32>, u32)>,
    /// What one that has ended has read.
    ended: Option<Vec<f32>>,
}

impl Source {
    /// The sensor of `board`.
    pub fn new(board: &Board) -> Self {
        let (circuit, board) = (ZeroPotential::TYPICAL, board.clone());
        Self { circuit, board, under_way: None, ended: None }
    }

    fn read(&self, settings: ScanSettings, wires: Selection<'_>) -> Vec<f32> {
        assert!(settings.oversampling > 0, "a scan without samples");
        let (shown, columns) = (self.board.frame.borrow(), wires.columns);
        let readings = wires.rows.iter().flat_map(|row| columns.pick(shown[row.0]));
        readings.collect()
    }
}

fn report(frame: &[f32]) -> ScanReport {
    let missing = frame.iter().filter(|reading| reading.is_nan());
    ScanReport { failed_samples: missing.count() as u16, ..ScanReport::default() }
}

impl FrameSource for Source {
    fn scanning(&mut self) -> Scanning<'_> {
        let alone = self.board.pins.borrow().scans_alone;
        if alone { Scanning::Runs(self) } else { Scanning::Waits(self) }
    }

    fn diagnose(&mut self) -> Option<Diagnosis> {
        assert!(self.under_way.is_none(), "a test within a scan");
        let items_left = [0, 0, 5, 1];
        Some(Diagnosis { items_left, ..Diagnosis::default() })
    }

    fn constants(&self) -> Option<Constants<'_>> {
        Some(self.circuit.constants())
    }

    fn set_constants(&mut self, constants: Constants<'_>) -> Result<(), ConstantsFault> {
        assert!(self.under_way.is_none(), "constants change within a scan");
        self.circuit.set_constants(constants)
    }
}

impl WaitingSource for Source {
    fn scan(
        &mut self,
        settings: ScanSettings,
        wires: Selection<'_>,
        frame: &mut [f32],
    ) -> ScanReport {
        frame.copy_from_slice(&self.read(settings, wires));
        let mut pins = self.board.pins.borrow_mut();
        pins.now_us = pins.now_us.wrapping_add(SCAN_US + pins.scan_us);
        report(frame)
    }
}

impl RunningSource for Source {
    fn start(&mut self, settings: ScanSettings, wires: Selection<'_>) {
        let (readings, mut pins) = (self.read(settings, wires), self.board.pins.borrow_mut());
        pins.started += 1;
        let end_us = pins.now_us.wrapping_add(SCAN_US + pins.scan_us);
        assert!(self.under_way.replace((readings, end_us)).is_none(), "two scans at once");
    }

    fn poll(&mut self) -> bool {
        assert!(self.ended.is_none(), "a frame was not taken");
        let now_us = self.board.pins.borrow().now_us;
        self.ended =
            self.under_way.take_if(|(_, end_us)| now_us >= *end_us).map(|(frame, _)| frame);
        self.ended.is_some()
    }

    fn take(&mut self, frame: &mut [f32]) -> ScanReport {
        frame.copy_from_slice(&self.ended.take().expect("a scan has ended"));
        ScanReport { row_times: RowTimes { first_us: 40.0, step_us: 70.0 }, ..report(frame) }
    }

    fn stop(&mut self) {
        assert!(self.under_way.take().is_some(), "there is no scan to give up");
        self.board.pins.borrow_mut().stopped += 1;
    }
}
