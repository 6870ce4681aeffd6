//! What an image has room for. The model in force decides what is scanned and decoded.

use model_core::Wires;
use model_core::blob::ModelShape;
use model_core::health::MOST_COLUMNS;

/// RAM in bytes that this project's images reserve for a copy of the model in force. A larger blob is decoded from
/// its slot.
pub const WEIGHT_RAM_BYTES: usize = 96 * 1024;

/// Most rows, and most outputs a row, that an image can be built for.
const MOST_ROWS: usize = 255;
const MOST_OUTPUTS: usize = 255;

/// Largest sensor and model that an image has room for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capacity {
    /// Number of row-wires that the board can drive.
    pub rows: usize,
    /// Number of column-wires that the board can sample.
    pub columns: usize,
    /// Number of outputs a row.
    pub outputs: usize,
}

impl Capacity {
    /// Room for the paper's sensor: 8 rows of 18 readings and 18 outputs.
    pub const PAPER: Self = Self { rows: 8, columns: 18, outputs: 18 };

    /// Parses `ROWSxCOLUMNSxOUTPUTS`, such as `16x32x18`. It is meant for a build setting, at compile time.
    ///
    /// # Panics
    /// If the text is not three numbers, or one of them is out of range: 2 to 255 rows, 1 to 32 columns and 1 to 255
    /// outputs a row.
    ///
    /// ```
    /// use firmware::capacity::Capacity;
    /// const WIDE: Capacity = Capacity::parse("16x32x18");
    /// assert_eq!(WIDE, Capacity { rows: 16, columns: 32, outputs: 18 });
    /// ```
    pub const fn parse(text: &str) -> Self {
        let bytes = text.as_bytes();
        let mut numbers = [0_usize; 3];
        let (mut number, mut place) = (0, 0);
        while place < bytes.len() {
            match bytes[place] {
                b'x' if number < 2 => number += 1,
                digit @ b'0'..=b'9' if numbers[number] < 1000 => {
                    numbers[number] = 10 * numbers[number] + (digit - b'0') as usize;
                }
                _ => panic!("a capacity is ROWSxCOLUMNSxOUTPUTS, such as 16x32x18"),
            }
            place += 1;
        }
        let [rows, columns, outputs] = numbers;
        assert!(rows >= 2 && rows <= MOST_ROWS, "a capacity has 2 to 255 rows");
        assert!(columns >= 1 && columns <= MOST_COLUMNS, "a capacity has 1 to 32 columns");
        assert!(outputs >= 1 && outputs <= MOST_OUTPUTS, "a capacity has 1 to 255 outputs a row");
        Self { rows, columns, outputs }
    }

    /// All wires.
    pub const fn wires(self) -> Wires {
        Wires { rows: self.rows, columns: self.columns }
    }

    /// Number of outputs of all rows.
    pub const fn all_outputs(self) -> usize {
        self.rows * self.outputs
    }

    /// Number of floats of working space for decoding: more than the readings of a frame and of two rows. What these
    /// leave is room for the components of an [`Expansion`](model_core::expansion::Expansion).
    pub const fn scratch_floats(self) -> usize {
        2 * self.rows * self.columns
    }

    /// Bytes of the longest message: a report of all readings, or of all outputs and their deviations, the circuit's
    /// constants in a seal, or an identity.
    pub const fn message_bytes(self) -> usize {
        let readings = 4 * self.rows * self.columns + 88;
        let estimate = 4 * 2 * self.all_outputs() + self.rows + 48;
        let constants = 4 * (self.rows + 2 * self.columns) + 88;
        let parts = [readings, estimate, constants, 256];
        let (mut longest, mut part) = (0, 0);
        while part < parts.len() {
            if parts[part] > longest {
                longest = parts[part];
            }
            part += 1;
        }
        longest
    }

    /// This capacity, enlarged for models of this `shape`; `None` if no image can be built for them.
    ///
    /// ```
    /// use firmware::capacity::Capacity;
    /// use model_core::blob::ModelShape;
    /// let enlarged = |rows, inputs| {
    ///     Capacity::PAPER.enlarged_for(ModelShape { rows, inputs, outputs: 6 })
    /// };
    /// assert_eq!(enlarged(16, 4), Some(Capacity { rows: 16, columns: 18, outputs: 18 }));
    /// assert_eq!(enlarged(1, 33), None);
    /// ```
    #[must_use]
    pub fn enlarged_for(self, shape: ModelShape) -> Option<Self> {
        let rows = self.rows.max(shape.rows);
        let columns = self.columns.max(shape.inputs);
        let outputs = self.outputs.max(shape.outputs);
        let possible = rows <= MOST_ROWS && columns <= MOST_COLUMNS && outputs <= MOST_OUTPUTS;
        possible.then_some(Self { rows, columns, outputs })
    }

    /// The wires to be scanned for a model of this `shape`; `None` if there is no room for it.
    ///
    /// A row of the model is a row of the sensor. A model of one row with more readings than there are columns takes
    /// the readings of several whole rows of the sensor.
    ///
    /// ```
    /// use firmware::capacity::Capacity;
    /// use model_core::Wires;
    /// use model_core::blob::ModelShape;
    /// let wires = |rows, inputs, outputs| Capacity::PAPER.wires_for(ModelShape { rows, inputs, outputs });
    /// assert_eq!(wires(4, 4, 1), Some(Wires { rows: 4, columns: 4 }));
    /// assert_eq!(wires(1, 144, 6), Some(Wires { rows: 8, columns: 18 }));
    /// assert_eq!(wires(16, 18, 18), None);
    /// ```
    pub fn wires_for(self, shape: ModelShape) -> Option<Wires> {
        let ModelShape { rows, inputs, outputs } = shape;
        let wires = if inputs <= self.columns {
            Wires { rows, columns: inputs }
        } else if rows == 1 && inputs.is_multiple_of(self.columns) {
            Wires { rows: inputs.checked_div(self.columns)?, columns: self.columns }
        } else {
            return None;
        };
        let fits = wires.rows <= self.rows && rows.saturating_mul(outputs) <= self.all_outputs();
        fits.then_some(wires)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shape_within_the_capacity_has_wires_and_no_other() {
        let capacity = Capacity { rows: 3, columns: 4, outputs: 2 };
        for rows in 1..6 {
            for inputs in 1..20 {
                for outputs in 1..8 {
                    let shape = ModelShape { rows, inputs, outputs };
                    let by_rows = rows <= 3 && inputs <= 4;
                    let as_one = rows == 1 && [8, 12].contains(&inputs);
                    let wires = capacity.wires_for(shape);
                    let fits = (by_rows || as_one) && rows * outputs <= 6;
                    assert_eq!(wires.is_some(), fits, "{shape:?}");
                    if let Some(wires) = wires {
                        assert_eq!(wires.readings(), rows * inputs, "{shape:?}");
                        assert!(wires.rows <= 3 && wires.columns <= 4, "{shape:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_no_capacity_does_not_compile() {
        for text in
            ["", "8", "8x18", "8x18x", "8x18x18x1", "8 x 18 x 18", "1x18x18", "8x33x18", "256x1x1"]
        {
            let parsed = std::panic::catch_unwind(|| Capacity::parse(text));
            assert!(parsed.is_err(), "{text}");
        }
    }
}
