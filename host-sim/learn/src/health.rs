//! Health of recorded readings, judged as a device judges those that it scans.

use rayon::prelude::*;
use serde::Serialize;
use taxel_core::health::{Fault, Limits};
use taxel_data::{Table, columns};

use crate::infer::is_missing;

/// Number of lines in which a column's reading is faulty, by kind.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ColumnHealth {
    /// Name of the column.
    pub column: String,
    /// Number of lines without a reading.
    pub missing: usize,
    /// Number of lines with a reading below the limits.
    pub shorted: usize,
    /// Number of lines with a reading above the limits.
    pub open: usize,
}

impl ColumnHealth {
    /// Number of lines with a faulty reading.
    pub fn faulty(&self) -> usize {
        self.missing + self.shorted + self.open
    }
}

/// Fault of a `reading` in a column of this `name`; `None` if it is sound. Only readings in Ω have limits: those of a
/// column whose name says so.
pub fn fault(name: &str, reading: f64, limits: Option<Limits>) -> Option<Fault> {
    match limits.filter(|_| columns::is_judged_in_ohm(name)) {
        Some(limits) => limits.fault(reading as f32), // as a device holds it
        None => is_missing(reading).then_some(Fault::Missing),
    }
}

/// Makes every faulty one of `readings` missing (NaN), and counts them by column. Columns without a fault are left out.
///
/// Without `limits`, only readings that are not finite are faulty.
///
/// ```
/// use taxel_core::health::Limits;
/// use taxel_data::table::Table;
/// use taxel_learn::health::judge;
/// let names = ["r1c1_ohm", "r1c2_ohm", "x_v"].map(String::from).to_vec();
/// let mut readings = Table { names, values: vec![60.0, 0.02, 0.02, 60.0, 1e6, 1e6].into() };
/// let faulty = judge(&mut readings, Some(Limits::USUAL));
/// let [column] = &faulty[..] else { panic!("{faulty:?}") };
/// assert_eq!((column.column.as_str(), column.shorted, column.open), ("r1c2_ohm", 1, 1));
/// assert!(readings.values[1].is_nan() && readings.values[4].is_nan());
/// assert_eq!(readings.values[5], 1e6); // volts have no limits
/// ```
pub fn judge(readings: &mut Table, limits: Option<Limits>) -> Vec<ColumnHealth> {
    const LINES_AT_ONCE: usize = 1024;
    let names = &readings.names;
    let width = names.len();
    let none = || vec![[0_usize; 3]; width];
    let counts = readings
        .values
        .par_chunks_mut((LINES_AT_ONCE * width).max(1))
        .map(|lines| {
            let mut counts = none();
            for line in lines.chunks_exact_mut(width) {
                for ((reading, name), count) in line.iter_mut().zip(names).zip(&mut counts) {
                    if let Some(fault) = fault(name, *reading, limits) {
                        count[fault as usize] += 1;
                        *reading = f64::NAN;
                    }
                }
            }
            counts
        })
        .reduce(none, |mut sums, counts| {
            let pairs = sums.as_flattened_mut().iter_mut().zip(counts.as_flattened());
            pairs.for_each(|(sum, count)| *sum += count);
            sums
        });
    let column = |(name, [missing, shorted, open]): (&String, [usize; 3])| ColumnHealth {
        column: name.clone(),
        missing,
        shorted,
        open,
    };
    names.iter().zip(counts).map(column).filter(|column| column.faulty() > 0).collect()
}
