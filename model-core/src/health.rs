//! Health of a frame: finds readings that are missing, shorted or open.

/// Range of resistances that the sensor's rubber can have; a reading outside is a fault.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Lower limit in Ω; below it, the two wires are shorted (or the circuit is saturated).
    pub shorted_below_ohm: f32,
    /// Upper limit in Ω; above it, one of the two wires is broken or not connected.
    pub open_above_ohm: f32,
}

impl Limits {
    /// Limits for rubber of about 60 Ω: those of a device until it is configured otherwise.
    pub const USUAL: Self = Self { shorted_below_ohm: 5.0, open_above_ohm: 1000.0 };

    /// The fault of a `reading` in Ω; `None` if it is plausible.
    ///
    /// ```
    /// use taxel_core::health::{Fault, Limits};
    /// assert_eq!(Limits::USUAL.fault(60.0), None);
    /// assert_eq!(Limits::USUAL.fault(f32::INFINITY), Some(Fault::Open));
    /// ```
    pub fn fault(self, reading: f32) -> Option<Fault> {
        if reading.is_nan() {
            Some(Fault::Missing)
        } else if reading < self.shorted_below_ohm {
            Some(Fault::Shorted)
        } else if reading > self.open_above_ohm {
            Some(Fault::Open)
        } else {
            None
        }
    }
}

/// Fault of a reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// It was not taken (NaN).
    Missing,
    /// It is below the limits.
    Shorted,
    /// It is above the limits.
    Open,
}

/// Largest number of column-wires whose faults can be distinguished.
pub const MOST_COLUMNS: usize = 32;

/// Number of faults in the readings of one frame, by kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Health {
    /// Number of readings that were not taken (NaN).
    pub missing: u16,
    /// Number of readings below the limits.
    pub shorted: u16,
    /// Number of readings above the limits.
    pub open: u16,
}

impl Health {
    /// Checks every reading of `frame` (Ω), a row of `columns` readings after the other. Makes faulty ones missing
    /// (NaN), so that no estimate depends on them.
    ///
    /// `faulty_columns` takes one word for each row-wire: bit k is set if the reading of column-wire k is faulty.
    /// Rows without a word, and columns from [`MOST_COLUMNS`] on, are counted alone.
    ///
    /// ```
    /// use taxel_core::health::{Health, Limits};
    /// let limits = Limits { shorted_below_ohm: 5.0, open_above_ohm: 500.0 };
    /// let mut frame = [60.0, 0.0, f32::INFINITY];
    /// let mut faulty_columns = [0];
    /// let health = Health::new(&mut frame, 3, limits, &mut faulty_columns);
    /// assert_eq!(faulty_columns, [0b110]);
    /// assert_eq!((health.missing, health.shorted, health.open), (0, 1, 1));
    /// assert!(frame[1].is_nan());
    /// ```
    pub fn new(
        frame: &mut [f32],
        columns: usize,
        limits: Limits,
        faulty_columns: &mut [u32],
    ) -> Self {
        faulty_columns.fill(0);
        let mut health = Self::default();
        let mut words = faulty_columns.iter_mut();
        for row in frame.chunks_mut(columns.max(1)) {
            let faulty = health.check_row(row, limits);
            if let Some(word) = words.next() {
                *word = faulty;
            }
        }
        health
    }

    /// Counts the faults of one row, makes these readings missing, and returns them as bits.
    fn check_row(&mut self, row: &mut [f32], limits: Limits) -> u32 {
        let mut faulty = 0;
        for (column, reading) in row.iter_mut().enumerate() {
            let count = match limits.fault(*reading) {
                Some(Fault::Missing) => &mut self.missing,
                Some(Fault::Shorted) => &mut self.shorted,
                Some(Fault::Open) => &mut self.open,
                None => continue,
            };
            *count = count.saturating_add(1);
            faulty |= 1_u32.checked_shl(column as u32).unwrap_or(0);
            *reading = f32::NAN;
        }
        faulty
    }

    /// Whether no reading is faulty.
    pub fn is_good(&self) -> bool {
        *self == Self::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits { shorted_below_ohm: 5.0, open_above_ohm: 500.0 };

    #[test]
    fn every_fault_is_named_by_wire_and_kind_and_the_rest_is_kept() {
        let mut frame = [[60.0_f32; 32]; 3];
        frame[0][31] = f32::NAN;
        frame[2][0] = 4.9;
        frame[2][7] = f32::INFINITY;
        frame[2][8] = -1.0;
        let before = frame;
        let mut faulty_columns = [u32::MAX; 3];
        let health = Health::new(frame.as_flattened_mut(), 32, LIMITS, &mut faulty_columns);
        assert_eq!(faulty_columns, [1 << 31, 0, 1 | 1 << 7 | 1 << 8]);
        assert_eq!((health.missing, health.shorted, health.open), (1, 2, 1));
        assert!(!health.is_good());
        let readings = before.as_flattened().iter().enumerate();
        for (place, old) in readings {
            let new = frame.as_flattened()[place];
            let faulty = faulty_columns[place / 32] >> (place % 32) & 1 == 1;
            assert!(if faulty { new.is_nan() } else { new == *old }, "{place}");
        }
    }

    #[test]
    fn readings_on_the_limits_are_good() {
        let mut frame = [5.0, 500.0];
        assert!(Health::new(&mut frame, 2, LIMITS, &mut [0]).is_good());
    }

    #[test]
    fn faults_without_a_bit_of_their_own_are_counted() {
        let mut frame = [f32::NAN; 80];
        let mut faulty_columns = [0];
        let health = Health::new(&mut frame, 40, LIMITS, &mut faulty_columns);
        assert_eq!((health.missing, faulty_columns), (80, [u32::MAX]));
        assert!(Health::new(&mut [], 0, LIMITS, &mut []).is_good());
        let mut frame = [60.0; 40];
        frame[33] = 0.0;
        // The second word is of a row that this frame lacks.
        let mut faulty_columns = [7; 2];
        let health = Health::new(&mut frame, 40, LIMITS, &mut faulty_columns);
        assert_eq!((health.shorted, faulty_columns), (1, [0; 2]));
    }
}
