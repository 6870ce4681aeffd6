//! The sensor and its circuit.

use std::cell::RefCell;
use std::rc::Rc;

use firmware::circuit::{Circuit, Constants, ConstantsFault, ZeroPotential};
use firmware::readout::{FrameSource, ScanReport, ScanSettings, Selection};

use crate::board::Board;
use crate::shape::{COLS, ROWS, TestFrame};

/// Least time in µs of a scan.
const SCAN_US: u32 = 10;

/// A sensor that shows the same frame until it is given another. Its circuit's constants change nothing.
#[derive(Clone)]
pub struct Source {
    circuit: ZeroPotential<ROWS, COLS>,
    frame: Rc<RefCell<TestFrame>>,
    board: Board,
}

impl Source {
    /// A sensor with this `frame`.
    pub fn new(frame: &Rc<RefCell<TestFrame>>, board: &Board) -> Self {
        Self { circuit: ZeroPotential::TYPICAL, frame: frame.clone(), board: board.clone() }
    }
}

impl FrameSource for Source {
    fn scan(
        &mut self,
        settings: ScanSettings,
        wires: Selection<'_>,
        frame: &mut [f32],
    ) -> ScanReport {
        assert!(settings.oversampling > 0, "a scan without samples");
        let (shown, columns) = (self.frame.borrow(), wires.columns);
        let readings = wires.rows.iter().flat_map(|row| columns.pick(shown[row.0]));
        assert_eq!(frame.len(), wires.rows.len() * columns.count());
        frame.iter_mut().zip(readings).for_each(|(place, reading)| *place = reading);
        let mut pins = self.board.pins.borrow_mut();
        pins.now_us = pins.now_us.wrapping_add(SCAN_US + pins.scan_us);
        let missing = frame.iter();
        ScanReport { failed_samples: missing.filter(|reading| reading.is_nan()).count() as u16 }
    }

    fn constants(&self) -> Option<Constants<'_>> {
        self.circuit.constants()
    }

    fn set_constants(&mut self, constants: Constants<'_>) -> Result<(), ConstantsFault> {
        self.circuit.set_constants(constants)
    }
}
