//! The wires that are scanned for the model in force, and the places of its readings in a scan.

use taxel_core::blob::{Columns, ModelShape};
use taxel_core::checksum::CRC_32;
use taxel_core::{ColumnWires, RowWire};

use crate::capacity::Capacity;
use crate::readout::Selection;

/// Wires of a model, which has its readings in any order, and not always of every cell between its wires.
pub struct Wiring<'m, const ROWS: usize> {
    /// Row-wires that hold a reading, in the order of their first ones.
    rows: [RowWire; ROWS],
    row_count: usize,
    /// Column-wires that hold a reading.
    columns: ColumnWires,
    /// Number of readings, and of those in a line of a health report.
    pub readings: usize,
    pub line: usize,
    /// Place of each reading in a scan.
    places: &'m mut [u16],
    /// Whether a scan has the model's readings in their order.
    in_order: bool,
    /// CRC-32 of the wires of all readings.
    pub crc_32: u32,
}

impl<'m, const ROWS: usize> Wiring<'m, ROWS> {
    /// All wires of a board; `places` has room for a number each reading.
    pub fn new(capacity: Capacity, places: &'m mut [u16]) -> Self {
        let mut wiring = Self {
            rows: [RowWire(0); ROWS],
            row_count: 0,
            columns: ColumnWires(0),
            readings: 0,
            line: 0,
            places,
            in_order: true,
            crc_32: 0,
        };
        wiring.take(capacity, Columns(""), capacity.wires_as_shape());
        wiring
    }

    /// Takes the wires of a model with inputs of these `names`, which was found to fit.
    pub fn take(&mut self, capacity: Capacity, names: Columns<'_>, shape: ModelShape) {
        let cells = || capacity.cells(names, shape).flatten();
        (self.row_count, self.columns, self.readings) = (0, ColumnWires(0), 0);
        self.line = capacity.line(shape);
        let mut digest = CRC_32.digest();
        for (row, column) in cells() {
            let is_new = !self.rows().contains(&row);
            if let Some(place) = self.rows.get_mut(self.row_count).filter(|_| is_new) {
                *place = row;
                self.row_count += 1;
            }
            self.columns.insert(column);
            self.readings += 1;
            digest.update(&[row.0 as u8, column.0 as u8]);
        }
        self.crc_32 = digest.finalize();
        let (rows, columns) = (self.rows.get(..self.row_count).unwrap_or_default(), self.columns);
        let count = columns.count();
        self.in_order = self.readings == rows.len().saturating_mul(count);
        for (index, ((row, column), place)) in cells().zip(self.places.iter_mut()).enumerate() {
            let row = rows.iter().position(|scanned| *scanned == row).unwrap_or(0);
            let found = row.saturating_mul(count).saturating_add(columns.below(column));
            self.in_order &= found == index;
            *place = found as u16;
        }
    }

    /// Number of lines of a health report.
    pub fn lines(&self) -> usize {
        self.readings.div_ceil(self.line.max(1))
    }

    fn rows(&self) -> &[RowWire] {
        self.rows.get(..self.row_count).unwrap_or_default()
    }

    /// Place in a scan of the row that the reading at `index` is of.
    pub fn scanned_row(&self, index: usize) -> usize {
        let place = self.places.get(index).copied().unwrap_or(0);
        usize::from(place).checked_div(self.columns.count()).unwrap_or(0)
    }

    /// Wires that are scanned.
    pub fn selection(&self) -> Selection<'_> {
        Selection { rows: self.rows(), columns: self.columns }
    }

    /// Fills the model's `frame` by `scan`, which fills a frame of all cells between the wires. If these are not the
    /// model's readings in their order, it goes to `scratch` first.
    pub fn fill<T>(
        &self,
        frame: &mut [f32],
        scratch: &mut [f32],
        scan: impl FnOnce(Selection<'_>, &mut [f32]) -> T,
    ) -> T {
        let wires = self.selection();
        if self.in_order {
            return scan(wires, frame);
        }
        let scanned = wires.rows.len().saturating_mul(wires.columns.count());
        let scanned = scratch.get_mut(..scanned).unwrap_or_default();
        let report = scan(wires, scanned);
        for (reading, place) in frame.iter_mut().zip(self.places.iter()) {
            *reading = scanned.get(usize::from(*place)).copied().unwrap_or(f32::NAN);
        }
        report
    }
}
