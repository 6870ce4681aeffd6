//! Health of a frame: finds readings that are missing, shorted or open.

use crate::frame::Frame;

/// Range of resistances that the sensor's rubber can have; a reading outside is a fault.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Lower limit in Ω; below it, the two wires are shorted (or the circuit is saturated).
    pub shorted_below_ohm: f32,
    /// Upper limit in Ω; above it, one of the two wires is broken or not connected.
    pub open_above_ohm: f32,
}

/// Faults in the readings of one frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Health<const ROWS: usize> {
    /// One word for each row-wire; bit k is set if the reading of column-wire k is faulty.
    pub faulty_columns: [u32; ROWS],
    /// Number of readings that were not taken (NaN).
    pub missing: u16,
    /// Number of readings below the limits.
    pub shorted: u16,
    /// Number of readings above the limits.
    pub open: u16,
}

impl<const ROWS: usize> Health<ROWS> {
    /// Checks every reading of `frame`, and makes faulty ones missing (NaN), so that no estimate depends on them.
    ///
    /// A sensor may have at most 32 column-wires; more do not compile.
    ///
    /// ```
    /// use model_core::Frame;
    /// use model_core::health::{Health, Limits};
    /// let limits = Limits { shorted_below_ohm: 5.0, open_above_ohm: 500.0 };
    /// let mut frame = Frame { row_column_resistance_ohm: [[60.0, 0.0, f32::INFINITY]] };
    /// let health = Health::of(&mut frame, limits);
    /// assert_eq!(health.faulty_columns, [0b110]);
    /// assert_eq!((health.missing, health.shorted, health.open), (0, 1, 1));
    /// assert!(frame.row_column_resistance_ohm[0][1].is_nan());
    /// ```
    #[must_use]
    pub fn of<const COLS: usize>(frame: &mut Frame<ROWS, COLS>, limits: Limits) -> Self {
        const { assert!(COLS <= 32, "a row's faults are the bits of one u32") }
        let mut health = Self { faulty_columns: [0; ROWS], missing: 0, shorted: 0, open: 0 };
        let rows = frame.row_column_resistance_ohm.iter_mut().zip(&mut health.faulty_columns);
        for (readings, faulty) in rows {
            for (column, reading) in readings.iter_mut().enumerate() {
                let count = if reading.is_nan() {
                    &mut health.missing
                } else if *reading < limits.shorted_below_ohm {
                    &mut health.shorted
                } else if *reading > limits.open_above_ohm {
                    &mut health.open
                } else {
                    continue;
                };
                *count = count.saturating_add(1);
                *faulty |= 1 << (column % 32);
                *reading = f32::NAN;
            }
        }
        health
    }

    /// Whether no reading is faulty.
    #[must_use]
    pub fn is_good(&self) -> bool {
        self.faulty_columns.iter().all(|bits| *bits == 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits { shorted_below_ohm: 5.0, open_above_ohm: 500.0 };

    #[test]
    fn every_fault_is_told_by_wire_and_kind_and_the_rest_is_untouched() {
        let mut frame = Frame { row_column_resistance_ohm: [[60.0_f32; 32]; 3] };
        frame.row_column_resistance_ohm[0][31] = f32::NAN;
        frame.row_column_resistance_ohm[2][0] = 4.9;
        frame.row_column_resistance_ohm[2][7] = f32::INFINITY;
        frame.row_column_resistance_ohm[2][8] = -1.0;
        let before = frame;
        let health = Health::of(&mut frame, LIMITS);
        assert_eq!(health.faulty_columns, [1 << 31, 0, 1 | 1 << 7 | 1 << 8]);
        assert_eq!((health.missing, health.shorted, health.open), (1, 2, 1));
        assert!(!health.is_good());
        let readings = before.row_column_resistance_ohm.as_flattened().iter().enumerate();
        for (place, old) in readings {
            let new = frame.row_column_resistance_ohm.as_flattened()[place];
            let faulty = health.faulty_columns[place / 32] >> (place % 32) & 1 == 1;
            assert!(if faulty { new.is_nan() } else { new == *old }, "{place}");
        }
    }

    #[test]
    fn readings_on_the_limits_are_good() {
        let mut frame = Frame { row_column_resistance_ohm: [[5.0, 500.0]] };
        assert!(Health::of(&mut frame, LIMITS).is_good());
    }
}
