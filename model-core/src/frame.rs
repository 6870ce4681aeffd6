//! A frame: one complete scan of the sensor.

/// Index of a row-wire (upper layer), from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct RowWire(pub usize);

/// Index of a column-wire (lower layer), from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct ColumnWire(pub usize);

/// One complete scan: the resistance between every row-wire and every column-wire, in Ω.
///
/// A reading that could not be taken is NaN.
///
/// ```
/// use model_core::{ColumnWire, Frame, RowWire};
/// let mut frame = Frame::<8, 18>::missing();
/// assert!(frame.set_ohm(RowWire(3), ColumnWire(17), 59.6));
/// assert_eq!(frame.ohm(RowWire(3), ColumnWire(17)), Some(59.6));
/// assert_eq!(frame.ohm(RowWire(8), ColumnWire(0)), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame<const ROWS: usize, const COLS: usize> {
    /// Readings in Ω, `[row-wire][column-wire]`.
    pub row_column_resistance_ohm: [[f32; COLS]; ROWS],
}

impl<const ROWS: usize, const COLS: usize> Frame<ROWS, COLS> {
    /// A frame in which every reading is still missing.
    #[must_use]
    pub const fn missing() -> Self {
        Self { row_column_resistance_ohm: [[f32::NAN; COLS]; ROWS] }
    }

    /// The reading between two wires in Ω (NaN if missing), or `None` for a wire outside the
    /// sensor.
    #[must_use]
    pub fn ohm(&self, row: RowWire, column: ColumnWire) -> Option<f32> {
        self.row_column_resistance_ohm.get(row.0)?.get(column.0).copied()
    }

    /// Stores a reading in Ω; `false`, and nothing stored, for a wire outside the sensor.
    #[must_use]
    pub fn set_ohm(&mut self, row: RowWire, column: ColumnWire, ohm: f32) -> bool {
        let slot = self
            .row_column_resistance_ohm
            .get_mut(row.0)
            .and_then(|readings| readings.get_mut(column.0));
        slot.map(|reading| *reading = ohm).is_some()
    }
}
