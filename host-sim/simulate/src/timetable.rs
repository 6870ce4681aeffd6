//! Times at which a trajectory is read: when each scan starts, and when it reads which row.

use taxel_data::BadValue;
use taxel_data::error::require;

/// Most scans of a trajectory.
pub const MOST_SCANS: usize = 1_000_000;

/// Times of the scans of a trajectory. Rows are read one after the other, in equal parts of the scan or of each of its passes.
#[derive(Debug, Clone, PartialEq)]
pub struct Timetable {
    /// Time at which each scan starts in s, ascending.
    pub starts_s: Vec<f64>,
    /// Time that a scan takes in s; with 0 it reads all rows at once.
    pub scan_s: f64,
    /// Number of passes over the rows that a scan consists of.
    pub passes: usize,
}

impl Timetable {
    /// One scan that reads all rows at once: a still frame.
    pub fn still() -> Self {
        Self::instants(vec![0.0])
    }

    /// Readings of all rows at once, at each of these times.
    pub fn instants(starts_s: Vec<f64>) -> Self {
        Self { starts_s, scan_s: 0.0, passes: 1 }
    }

    /// Scans of `scan_s` each, one every `period_s`, that start within `duration_s`; at least one.
    ///
    /// # Errors
    /// [`BadValue`] for a period that is not positive, and for more than [`MOST_SCANS`].
    pub fn every(period_s: f64, scan_s: f64, duration_s: f64) -> Result<Self, BadValue> {
        let value = format!("{period_s} s");
        require(period_s.is_finite() && period_s > 0.0, "frame period", value, || {
            "give a positive number".into()
        })?;
        let scans = (duration_s / period_s - 1e-9).ceil().max(1.0);
        require(scans <= MOST_SCANS as f64, "frame period", format!("{period_s} s"), || {
            format!("{duration_s} s have {scans} frames, more than {MOST_SCANS}; make it longer")
        })?;
        let starts_s = (0..scans as usize).map(|scan| scan as f64 * period_s).collect();
        Ok(Self { starts_s, scan_s, passes: 1 })
    }

    /// These scans, each in so many `passes` over the rows; a reading is the mean of its row's.
    #[must_use]
    pub fn in_passes(self, passes: usize) -> Self {
        Self { passes: passes.max(1), ..self }
    }

    /// Number of scans.
    pub fn scans(&self) -> usize {
        self.starts_s.len()
    }

    /// Time in s from the start of a scan to the middle of its readings of the row at `place` among so many `rows`. A
    /// reading that is the mean of several passes counts as one at the mean of their times.
    pub fn row_offset_s(&self, place: usize, rows: usize) -> f64 {
        let rows_before = 0.5 * ((self.passes - 1) * rows) as f64 + place as f64;
        self.scan_s / self.passes as f64 * (rows_before + 0.5) / rows as f64
    }

    /// Time in s since the scan before; 0 for the first.
    pub fn since_last_s(&self, scan: usize) -> f64 {
        scan.checked_sub(1).map_or(0.0, |last| self.starts_s[scan] - self.starts_s[last])
    }
}
