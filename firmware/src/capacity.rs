//! What an image has room for. The model in force decides what is scanned and decoded.

use taxel_core::blob::{Columns, ModelShape};
use taxel_core::health::MOST_COLUMNS;
use taxel_core::{ColumnWire, RowWire, Wires};

/// RAM in bytes that this project's images reserve for a copy of the model in force. A larger blob is decoded from
/// its slot.
pub const WEIGHT_RAM_BYTES: usize = 96 * 1024;

/// Most rows that an image can be built for.
pub const MOST_ROWS: usize = 255;
/// Most outputs a row that an image can be built for.
pub const MOST_OUTPUTS: usize = 255;

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
    /// use taxel_firmware::capacity::Capacity;
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

    /// All wires, as a model of all readings has them.
    pub const fn wires_as_shape(self) -> ModelShape {
        ModelShape { rows: self.rows, inputs: self.columns, outputs: 0 }
    }

    /// Number of outputs of all rows.
    pub const fn all_outputs(self) -> usize {
        self.rows * self.outputs
    }

    /// Number of floats of working space for decoding: more than the readings of a frame and of two rows, and enough for
    /// shape and strength of a touch, and the same scaled.
    pub const fn scratch_floats(self) -> usize {
        2 * (self.rows * self.columns + 1)
    }

    /// Bytes of the longest message: a report of all readings, or of all outputs and their deviations, the circuit's
    /// constants, or an identity.
    pub const fn message_bytes(self) -> usize {
        let readings = 4 * self.rows * self.columns + 40;
        let estimate = 4 * 2 * self.all_outputs() + self.rows + 48;
        let constants = 4 * (self.rows + 2 * self.columns) + 40;
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

    /// Bytes of the largest chunk of an upload: it leaves room for the rest of the message, and every board can keep it
    /// while it writes the previous chunk.
    pub const fn chunk_bytes(self) -> usize {
        /// Bytes of a message that are not the chunk's: those of packet and fields.
        const AROUND_BYTES: usize = 24;
        const MOST_BYTES: usize = 512;
        let room = self.message_bytes().saturating_sub(AROUND_BYTES) / 4 * 4;
        if room < MOST_BYTES { room } else { MOST_BYTES }
    }

    /// About the bytes of RAM that an image's buffers take, a little too many.
    pub const fn buffer_bytes(self) -> usize {
        let (readings, outputs) = (self.rows * self.columns, self.all_outputs());
        // The frame, its baseline with the reciprocals, working space, places; the estimate, deviations, the filter, and statuses.
        let frames = readings * (4 * size_of::<f32>() + size_of::<u16>())
            + 4 * self.scratch_floats()
            - 4 * readings;
        frames + 4 * outputs * size_of::<f32>() + self.rows + 2 * self.message_bytes()
    }

    /// Whether there is room for the readings and outputs of a model of this `shape`.
    ///
    /// ```
    /// use taxel_firmware::capacity::Capacity;
    /// use taxel_core::blob::ModelShape;
    /// let fits = |rows, inputs, outputs| Capacity::PAPER.has_room_for(ModelShape { rows, inputs, outputs });
    /// assert!(fits(8, 18, 18) && fits(1, 144, 6));
    /// assert!(!fits(9, 1, 1) && !fits(1, 145, 6));
    /// ```
    pub fn has_room_for(self, shape: ModelShape) -> bool {
        let ModelShape { rows, inputs, outputs } = shape;
        rows <= self.rows
            && rows.saturating_mul(inputs) <= self.wires().readings()
            && rows.saturating_mul(outputs) <= self.all_outputs()
    }

    /// A model's frame, as health reports show it: lines of so many readings, of which the last may be shorter. A line
    /// is a row of the model if there are as many columns.
    pub fn line(self, shape: ModelShape) -> usize {
        if shape.inputs <= self.columns { shape.inputs } else { self.columns }
    }

    /// The wires between which each reading of a model is taken.
    ///
    /// Names such as `r4c17_ohm` say them: row-wire 4 and column-wire 17, both counted from 1. A model with other names
    /// takes the first wires in their order: a row-wire for each row of the model, or whole row-wires for a model of one
    /// row.
    ///
    /// # Errors
    /// Each time the index of an input that cannot be scanned: the board lacks one of its wires, its name says none
    /// while another's does, or there are more without names than a row has.
    ///
    /// ```
    /// use taxel_firmware::capacity::Capacity;
    /// use taxel_core::blob::{Columns, ModelShape};
    /// use taxel_core::{ColumnWire, RowWire};
    /// let shape = ModelShape { rows: 1, inputs: 2, outputs: 1 };
    /// let cells = Capacity::PAPER.cells(Columns("r4c17_ohm\nr9c1_ohm"), shape);
    /// let expected = [Ok((RowWire(3), ColumnWire(16))), Err(1)];
    /// assert_eq!(cells.collect::<Vec<_>>(), expected);
    /// ```
    pub fn cells(
        self,
        names: Columns<'_>,
        shape: ModelShape,
    ) -> impl Iterator<Item = Result<(RowWire, ColumnWire), usize>> {
        let are_named = names.iter().any(|name| cell_of(name).is_some());
        let line = self.line(shape).max(1);
        // The number of readings whose order of wires is plain.
        let in_order = match shape.rows {
            1 => shape.inputs.saturating_sub(shape.inputs.checked_rem(line).unwrap_or(0)),
            _ if line == shape.inputs => usize::MAX,
            _ => line,
        };
        let mut names = names.iter();
        (0..shape.rows.saturating_mul(shape.inputs)).map(move |index| {
            let name = names.next().unwrap_or_default();
            let (row, column) = if are_named {
                cell_of(name).ok_or(index)?
            } else {
                let of_line = |part: Option<usize>| part.filter(|_| index < in_order).ok_or(index);
                let (row, column) = (index.checked_div(line), index.checked_rem(line));
                (RowWire(of_line(row)?), ColumnWire(of_line(column)?))
            };
            let is_there = row.0 < self.rows && column.0 < self.columns;
            if is_there { Ok((row, column)) } else { Err(index) }
        })
    }
}

/// The wires of a reading whose name begins with `r{m}c{k}_`, which counts both from 1.
fn cell_of(name: &str) -> Option<(RowWire, ColumnWire)> {
    let (row, rest) = name.strip_prefix('r')?.split_once('c')?;
    let (column, _) = rest.split_once('_')?;
    let wire = |number: &str| number.parse::<usize>().ok()?.checked_sub(1);
    Some((RowWire(wire(row)?), ColumnWire(wire(column)?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shape_within_the_capacity_fits() {
        let capacity = Capacity { rows: 3, columns: 4, outputs: 2 };
        // Rows, inputs, outputs, and the first input that has no wires.
        for (rows, inputs, outputs, without) in [
            (3, 4, 2, None),
            (2, 3, 1, None),
            (1, 12, 6, None), // one network for all
            (1, 8, 1, None),
            (2, 5, 1, Some(4)),  // wider than the lines
            (1, 10, 1, Some(8)), // no whole lines
        ] {
            let shape = ModelShape { rows, inputs, outputs };
            assert!(capacity.has_room_for(shape), "{shape:?}");
            let names = ["x"].repeat(rows * inputs).join("\n");
            let cells: Result<Vec<_>, _> = capacity.cells(Columns(&names), shape).collect();
            let line = inputs.min(4);
            let first_wires =
                (0..rows * inputs).map(|i| (RowWire(i / line), ColumnWire(i % line))).collect();
            assert_eq!(cells, without.map_or(Ok(first_wires), Err), "{shape:?}");
        }
        for (rows, inputs, outputs) in [(4, 1, 1), (3, 5, 1), (1, 13, 1), (3, 1, 3), (1, 1, 7)] {
            let shape = ModelShape { rows, inputs, outputs };
            assert!(!capacity.has_room_for(shape), "{shape:?}");
        }
    }

    #[test]
    fn a_readings_name_tells_its_wires() {
        let cell = |row, column| Some((RowWire(row), ColumnWire(column)));
        assert_eq!(cell_of("r1c1_ohm"), cell(0, 0));
        assert_eq!(cell_of("r16c32_ohm"), cell(15, 31));
        assert_eq!(cell_of("r2c1_adc_16"), cell(1, 0));
        let others = ["r0c1_ohm", "r1c0_ohm", "rc1_ohm", "r1c_ohm", "ch1", "", "r-1c1_ohm", "r1c1"];
        for other in others {
            assert_eq!(cell_of(other), None, "{other}");
        }
    }

    #[test]
    fn the_first_input_that_cannot_be_scanned_is_told() {
        let first = |names: &str| {
            let shape = ModelShape { rows: 1, inputs: names.lines().count(), outputs: 1 };
            Capacity::PAPER.cells(Columns(names), shape).find_map(Result::err)
        };
        assert_eq!(first("r8c18_ohm\nr1c1_ohm"), None);
        assert_eq!(first("r8c18_ohm\nr9c1_ohm\nr1c19_ohm"), Some(1));
        assert_eq!(first("r8c18_ohm\nr1c1_ohm\nr1c19_ohm"), Some(2));
        assert_eq!((first("r1c1_ohm\nrest"), first("rest\nr1c1_ohm")), (Some(1), Some(0)));
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
