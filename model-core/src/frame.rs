//! A frame: one complete scan of the sensor, as a slice of readings.
//!
//! A frame holds the resistance between every row-wire and every column-wire in Ω, row after row. A reading that
//! could not be taken is NaN. How many rows and columns there are is known at run time ([`Wires`]).

/// Index of a row-wire (upper layer), from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct RowWire(pub usize);

/// Index of a column-wire (lower layer), from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct ColumnWire(pub usize);

/// Numbers of a sensor's wires. There is one reading for each pair of a row-wire and a column-wire.
///
/// ```
/// use taxel_core::{ColumnWire, RowWire, Wires};
/// let wires = Wires { rows: 8, columns: 18 };
/// let mut frame = [f32::NAN; 144]; // Ω
/// assert_eq!(wires.readings(), frame.len());
/// let place = wires.place(RowWire(3), ColumnWire(17)).unwrap();
/// frame[place] = 59.6;
/// assert_eq!(frame.chunks(wires.columns).nth(3).unwrap()[17], 59.6);
/// assert_eq!(wires.place(RowWire(8), ColumnWire(0)), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wires {
    /// Number of row-wires.
    pub rows: usize,
    /// Number of column-wires.
    pub columns: usize,
}

impl Wires {
    /// Number of readings in a frame.
    pub const fn readings(self) -> usize {
        self.rows.saturating_mul(self.columns)
    }

    /// Index in a frame of the reading between two wires; `None` for a wire outside the sensor.
    pub fn place(self, row: RowWire, column: ColumnWire) -> Option<usize> {
        let inside = row.0 < self.rows && column.0 < self.columns;
        inside.then(|| row.0.saturating_mul(self.columns).saturating_add(column.0))
    }
}

/// A set of column-wires: bit k is column-wire k.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ColumnWires(pub u32);

impl ColumnWires {
    /// So many column-wires, from the first on; at most 32.
    ///
    /// ```
    /// use taxel_core::ColumnWires;
    /// assert_eq!(ColumnWires::first(3), ColumnWires(0b111));
    /// ```
    pub const fn first(count: usize) -> Self {
        Self(match u32::MAX.checked_shl(count as u32) {
            Some(others) => !others,
            None => u32::MAX,
        })
    }

    /// Number of column-wires.
    pub const fn count(self) -> usize {
        self.0.count_ones() as usize
    }

    /// Adds `column`, if it is one of the first 32.
    pub const fn insert(&mut self, column: ColumnWire) {
        self.0 |= Self::first(column.0.saturating_add(1)).0 & !Self::first(column.0).0;
    }

    /// Number of column-wires below `column`: its place among those of the set.
    pub const fn below(self, column: ColumnWire) -> usize {
        Self(self.0 & Self::first(column.0).0).count()
    }

    /// The items of these column-wires among `items`, of which there is one for each column-wire from the first on.
    pub fn pick<T>(self, items: impl IntoIterator<Item = T>) -> impl Iterator<Item = T> {
        let mut wires = self.0;
        items.into_iter().filter(move |_| {
            let is_in = wires & 1 == 1;
            wires >>= 1;
            is_in
        })
    }
}
