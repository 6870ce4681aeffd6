//! From ADC counts to Ω: the circuit that a sensor is read with, as pure arithmetic.
//!
//! `docs/board.md` draws it, derives the equations, and explains how to measure the constants.
//! Readings of the paper's sensor are near 60 Ω, and its 18 columns together load a row with 3.3 Ω. A resistance
//! in series with a row is therefore never negligible, and is corrected for.

use serde::{Deserialize, Serialize};
use taxel_core::blob::Floats;
use taxel_core::{ColumnWires, RowWire, Wires};

/// Smallest current in counts that counts as one; below it, the reading is open.
pub const NO_CURRENT_COUNTS: f32 = 4.0;

/// A row of which some columns, or all, were sampled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScannedRow {
    /// The row-wire.
    pub row: RowWire,
    /// The columns that were sampled.
    pub columns: ColumnWires,
    /// Current of all columns over that of the sampled ones: all of them load the row. 1 if all were sampled.
    pub load: f32,
}

/// Constants of a [`ZeroPotential`], for the link and for keeping.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Constants<'a> {
    /// Reference voltage of the converter, in V.
    pub reference_v: f32,
    /// Voltage in V by which the active row is pulled below the others.
    pub drive_v: f32,
    /// Resistance in Ω between the drive and each row-wire: one number a row.
    #[serde(borrow)]
    pub row_source_ohm: Floats<'a>,
    /// Feedback resistance in Ω of each column.
    #[serde(borrow)]
    pub feedback_ohm: Floats<'a>,
    /// Resistance in Ω in series with each column.
    #[serde(borrow)]
    pub series_ohm: Floats<'a>,
}

/// Why a circuit rejects constants.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum ConstantsFault {
    /// The circuit's constants are fixed.
    Fixed,
    /// There are not as many rows or columns as the circuit has.
    Length,
    /// The reference voltage is not above 0, or above 100 V.
    Reference,
    /// The drive voltage is not above 0, or above 100 V.
    Drive,
    /// A row's source is below 0, or above 1 MΩ.
    RowSource,
    /// A feedback resistance is not above 0, or above 1 MΩ.
    Feedback,
    /// A column's series resistance is below 0, or above 1 MΩ.
    Series,
}

impl Constants<'_> {
    /// Checks that there are as many numbers as `wires`, and that each is in its range.
    ///
    /// # Errors
    /// The first fault.
    pub fn check(&self, wires: Wires) -> Result<(), ConstantsFault> {
        let within = |value: f32, most: f32| value > 0.0 && value <= most;
        let source = |ohm: f32| (0.0..=MOST_OHM).contains(&ohm);
        let lengths = [self.row_source_ohm, self.feedback_ohm, self.series_ohm]
            .map(|numbers| numbers.0.len());
        let expected = [wires.rows, wires.columns, wires.columns].map(|count| 4 * count);
        let checks = [
            (lengths == expected, ConstantsFault::Length),
            (within(self.reference_v, MOST_V), ConstantsFault::Reference),
            (within(self.drive_v, MOST_V), ConstantsFault::Drive),
            (self.row_source_ohm.iter().all(source), ConstantsFault::RowSource),
            (self.feedback_ohm.iter().all(|r| within(r, MOST_OHM)), ConstantsFault::Feedback),
            (self.series_ohm.iter().all(source), ConstantsFault::Series),
        ];
        checks.into_iter().find(|(good, _)| !good).map_or(Ok(()), |(_, fault)| Err(fault))
    }
}

/// Largest voltage and resistance that a constant can have.
const MOST_V: f32 = 100.0;
const MOST_OHM: f32 = 1e6;

/// The zero-potential circuit: an op-amp with a feedback resistor holds every column at V_b, idle rows are at V_b
/// too, and the active row is pulled below it by `drive_v`.
///
/// V_out = V_b + R_f·I, and I = V_d/R. No current flows between wires at one potential, so the
/// other rows do not disturb (D'Alessio, Sensors and Actuators A 72, 1999). Subtracting the idle sample removes
/// V_b and the op-amp's offset exactly. The row's own drop V_d − R_s·ΣI is known because all its columns are
/// measured, or their share is known. A lead in series with a column lets the idle rows feed it: it divides all currents
/// of the column by 1 + s·Σ1/R, which [`correct`](Self::correct) undoes.
///
/// A reading is [`f32::INFINITY`] if no current flows (open), and 0 if its sample is saturated: the resistance is too
/// small to be measured, or shorted. It is NaN if its sample (or its idle sample) could not be taken, or another one of
/// its row is shorted: the drop of the row's voltage is then unknown.
///
/// ```
/// use taxel_firmware::circuit::{ScannedRow, ZeroPotential};
/// use taxel_core::{ColumnWires, RowWire};
/// let circuit = ZeroPotential::<1, 1> { row_source_ohm: [0.0], ..ZeroPotential::TYPICAL };
/// // 0.2 V across 62.5 Ω drive 3.2 mA through 560 Ω: 1.792 V above the idle 0.2 V.
/// let counts = |v: f32| v / 3.3 * 4096.0;
/// let mut reading = [counts(1.992)];
/// let row = ScannedRow { row: RowWire(0), columns: ColumnWires::first(1), load: 1.0 };
/// circuit.row_ohm(row, &[counts(0.2)], &circuit.scale(4095), &mut reading);
/// assert!((reading[0] - 62.5).abs() < 1e-3);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZeroPotential<const ROWS: usize, const COLS: usize> {
    /// Number of the sensor's row-wires, read or not: all of them feed a column.
    pub sensor_rows: u16,
    /// Output in V from which on an op-amp may be saturated. It comes close to its supply, and not up to it.
    pub saturated_v: f32,
    /// Reference voltage of the converter, in V.
    pub reference_v: f32,
    /// Voltage in V by which the active row is pulled below the others.
    pub drive_v: f32,
    /// Resistance in Ω between the drive and each row-wire: switch and lead.
    pub row_source_ohm: [f32; ROWS],
    /// Feedback resistance in Ω from each op-amp's output to its column.
    pub feedback_ohm: [f32; COLS],
    /// Resistance in Ω in series with each column, not part of the sensor.
    pub series_ohm: [f32; COLS],
}

/// Scale of a converter's counts in a circuit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale<const COLS: usize> {
    /// Current in A of a count, in each column.
    pub ampere_per_count: [f32; COLS],
    /// Counts from which on an op-amp may be saturated.
    pub saturated_counts: f32,
}

impl<const ROWS: usize, const COLS: usize> ZeroPotential<ROWS, COLS> {
    /// Typical constants: 0.2 V and 560 Ω (3.6 mA a column, 65 mA a row, readings from 39 Ω, or 36 Ω where 18 columns load the
    /// row), and a switch of 0.26 Ω. At 5.5 mA an MCP6024 at 3.3 V is sure to reach 3.1 V.
    pub const TYPICAL: Self = Self {
        sensor_rows: ROWS as u16,
        saturated_v: 3.1,
        reference_v: 3.3,
        drive_v: 0.2,
        row_source_ohm: [0.26; ROWS],
        feedback_ohm: [560.0; COLS],
        series_ohm: [0.0; COLS],
    };

    /// Scale of the counts of a converter whose largest count is `full_scale_counts`.
    pub fn scale(&self, full_scale_counts: u16) -> Scale<COLS> {
        let volt_per_count = self.reference_v / (f32::from(full_scale_counts) + 1.0);
        Scale {
            ampere_per_count: self.feedback_ohm.map(|r| volt_per_count / r),
            saturated_counts: self.saturated_v / volt_per_count,
        }
    }

    /// Converts the samples of a row to Ω, in place.
    ///
    /// `counts` holds averaged counts of every column, NaN where none could be taken, and Ω of the row's columns afterwards.
    /// `idle` holds counts of every column while all rows idle.
    pub fn row_ohm(&self, row: ScannedRow, idle: &[f32], scale: &Scale<COLS>, counts: &mut [f32]) {
        let source = self.row_source_ohm.get(row.row.0);
        let samples = RowSamples {
            row,
            idle,
            ampere_per_count: &scale.ampere_per_count,
            saturated_counts: scale.saturated_counts,
            drive_v: self.drive_v,
            source_ohm: source.copied().unwrap_or(0.0),
        };
        samples.convert(counts);
    }

    /// The [`load`](ScannedRow::load) of a row, from the `counts` of every column; if it cannot be measured, it is that
    /// of equal columns. NaN if one is saturated.
    pub fn load(
        &self,
        columns: ColumnWires,
        idle: &[f32],
        scale: &Scale<COLS>,
        counts: &[f32],
    ) -> f32 {
        if counts.iter().any(|n| *n >= scale.saturated_counts) {
            return f32::NAN;
        }
        let parts = || counts.iter().zip(idle.iter().zip(&scale.ampere_per_count));
        load(columns, || parts().map(|(n, (idle, per_count))| (n - idle, (n - idle) * per_count)))
    }

    /// Corrects a whole `frame` (Ω, rows of `columns` readings) for leads in series with columns: each reading to
    /// R·(1 − s·Σ1/R), with the sum over the column's rows. A row that was not measured, or is not read, counts as the mean
    /// of the others.
    pub fn correct(&self, columns: ColumnWires, frame: &mut [f32]) {
        let count = columns.count().max(1);
        let leads = columns.pick(&self.series_ohm).enumerate();
        for (column, series) in leads.filter(|(_, series)| **series != 0.0) {
            let readings = frame.iter().skip(column).step_by(count);
            let measured = readings.filter(|ohm| **ohm > 0.0); // neither NaN nor short
            let (rows, sum_s) =
                measured.fold((0_usize, 0.0), |(rows, sum), ohm| (rows + 1, sum + 1.0 / ohm));
            if rows > 0 {
                let factor = 1.0 - series * (sum_s * (f32::from(self.sensor_rows) / rows as f32));
                let readings = frame.iter_mut().skip(column).step_by(count);
                readings
                    .filter(|ohm| ohm.is_finite()) // open stays open
                    .for_each(|ohm| *ohm = (*ohm * factor).max(0.0));
            }
        }
    }

    /// The constants.
    pub fn constants(&self) -> Constants<'_> {
        Constants {
            reference_v: self.reference_v,
            drive_v: self.drive_v,
            row_source_ohm: Floats::new(&self.row_source_ohm),
            feedback_ohm: Floats::new(&self.feedback_ohm),
            series_ohm: Floats::new(&self.series_ohm),
        }
    }

    /// Replaces all constants.
    ///
    /// # Errors
    /// [`ConstantsFault`], which leaves the constants as they were.
    pub fn set_constants(&mut self, constants: Constants<'_>) -> Result<(), ConstantsFault> {
        constants.check(Wires { rows: ROWS, columns: COLS })?;
        (self.reference_v, self.drive_v) = (constants.reference_v, constants.drive_v);
        copy(constants.row_source_ohm, &mut self.row_source_ohm);
        copy(constants.feedback_ohm, &mut self.feedback_ohm);
        copy(constants.series_ohm, &mut self.series_ohm);
        Ok(())
    }
}

fn copy(from: Floats<'_>, to: &mut [f32]) {
    to.iter_mut().zip(from.iter()).for_each(|(place, number)| *place = number);
}

/// What turns samples of a row into readings. Its arithmetic is the same for circuits of all sizes, so that this crate
/// compiles it, for speed.
struct RowSamples<'a> {
    row: ScannedRow,
    /// Idle counts, and current of a count, of all columns.
    idle: &'a [f32],
    ampere_per_count: &'a [f32],
    saturated_counts: f32,
    drive_v: f32,
    source_ohm: f32,
}

impl RowSamples<'_> {
    /// Converts counts to Ω, as [`ZeroPotential::row_ohm`] says.
    #[inline(never)] // else it would be compiled where it is called, as small as can be
    fn convert(&self, counts: &mut [f32]) {
        let ScannedRow { columns, load, .. } = self.row;
        let mut currents = [f32::NAN; u32::BITS as usize];
        let (mut missing, mut sum, mut has_short) = (0_usize, 0.0, false);
        let constants = self.idle.iter().zip(self.ampere_per_count);
        let samples = counts.iter().zip(&mut currents).zip(constants);
        for ((n, current), (idle, per_count)) in columns.pick(samples) {
            *current = (n - idle) * per_count;
            if current.is_nan() {
                missing += 1;
            } else {
                sum += *current;
            }
            // A column-wire at ground, which is saturated at rest too, takes no current from the row.
            if *n >= self.saturated_counts {
                has_short |= *idle < self.saturated_counts;
            }
        }
        // A column that could not be sampled counts as the mean of the others.
        let taken = columns.count().saturating_sub(missing);
        let share = columns.count() as f32 / taken as f32;
        let drop_v = if taken == 0 { 0.0 } else { self.source_ohm * sum * (share * load) };
        let across_v = if has_short { f32::NAN } else { self.drive_v - drop_v };
        for ((n, current), idle) in counts.iter_mut().zip(currents).zip(self.idle) {
            *n = reading_of(*n, *n - idle, self.saturated_counts, across_v / current);
        }
    }
}

/// Current of all columns over that of `columns`, from each column's counts due to its current, and the current in any
/// unit. A column that could not be sampled counts as the mean of the others; too few counts are no current.
fn load<I: Iterator<Item = (f32, f32)>>(columns: ColumnWires, all: impl Fn() -> I) -> f32 {
    fn mean(currents: impl Iterator<Item = (f32, f32)>) -> f32 {
        let taken = currents.filter(|(counts, _)| !counts.is_nan());
        let (taken, sum) = taken.fold((0_usize, 0.0), |(taken, sum), (counts, current)| {
            (taken + 1, if counts < NO_CURRENT_COUNTS { sum } else { sum + current })
        });
        sum / taken as f32
    }
    let equal = all().count() as f32 / columns.count() as f32;
    let load = equal * (mean(all()) / mean(columns.pick(all())));
    if load.is_finite() { load } else { equal }
}

/// The reading: `ohm`, or NaN, infinity or 0 if the sample is missing, open or `saturated`.
fn reading_of(sampled: f32, due_to_current: f32, saturated: f32, ohm: f32) -> f32 {
    if due_to_current.is_nan() {
        f32::NAN
    } else if sampled >= saturated {
        0.0
    } else if due_to_current < NO_CURRENT_COUNTS {
        f32::INFINITY
    } else if ohm < 0.0 {
        0.0
    } else {
        ohm // NaN beside a saturated one
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNTS: f64 = 4096.0;

    /// Unrounded counts of a row, and of idle columns, for `circuit`.
    fn zero_potential_counts(circuit: &ZeroPotential<2, 18>, ohm: &[f64; 18]) -> [[f32; 18]; 2] {
        let branch = |k: usize| ohm[k] + f64::from(circuit.series_ohm[k]);
        let load: f64 = (0..18).map(|k| 1.0 / branch(k)).sum();
        let row = f64::from(circuit.drive_v) / (1.0 + f64::from(circuit.row_source_ohm[1]) * load);
        let idle: [f64; 18] = core::array::from_fn(|k| 250.0 + 3.0 * k as f64);
        let sampled = |k: usize| {
            let above_v = f64::from(circuit.feedback_ohm[k]) * row / branch(k);
            idle[k] + above_v / f64::from(circuit.reference_v) * COUNTS
        };
        [core::array::from_fn(|k| sampled(k) as f32), idle.map(|n| n as f32)]
    }

    /// Readings of the row `row` from its samples.
    fn read<const R: usize, const N: usize>(
        circuit: &ZeroPotential<R, N>,
        row: usize,
        sampled: &[f32; N],
        idle: &[f32; N],
    ) -> [f32; N] {
        let mut readings = *sampled;
        let row = ScannedRow { row: RowWire(row), columns: ColumnWires::first(N), load: 1.0 };
        circuit.row_ohm(row, idle, &circuit.scale(4095), &mut readings);
        readings
    }

    /// A frame after the circuit has corrected it.
    fn corrected<const R: usize, const C: usize>(
        circuit: &ZeroPotential<R, C>,
        frame: [[f32; C]; R],
    ) -> [[f32; C]; R] {
        let mut corrected = frame;
        circuit.correct(ColumnWires::first(C), corrected.as_flattened_mut());
        corrected
    }

    fn row() -> [f64; 18] {
        core::array::from_fn(|k| 52.0 + 0.9 * k as f64)
    }

    /// Relative error of each reading of [`row`].
    fn errors(ohm: &[f32; 18]) -> [f64; 18] {
        core::array::from_fn(|k| (f64::from(ohm[k]) / row()[k] - 1.0).abs())
    }

    #[test]
    fn the_circuit_returns_the_resistances_for_any_of_its_parts() {
        for source_ohm in [0.0, 0.3, 5.0] {
            let mut circuit =
                ZeroPotential { row_source_ohm: [9.0, source_ohm], ..ZeroPotential::TYPICAL };
            for k in 0..18 {
                circuit.feedback_ohm[k] -= k as f32;
                circuit.series_ohm[k] = 0.1 * k as f32;
            }
            let [sampled, idle] = zero_potential_counts(&circuit, &row());
            let ohm = read(&circuit, 1, &sampled, &idle);
            // The other row is open: it feeds no column.
            let rows = [[f32::INFINITY; 18], ohm];
            let errors = errors(&corrected(&circuit, rows)[1]);
            assert!(errors.iter().all(|error| *error < 2e-6), "{errors:?}");
        }
        // A missing column counts as the mean of the others: its smallest, an eighth less, is one in 18.
        let circuit = ZeroPotential { row_source_ohm: [9.0, 0.3], ..ZeroPotential::TYPICAL };
        let [mut sampled, idle] = zero_potential_counts(&circuit, &row());
        sampled[0] = f32::NAN;
        let errors = errors(&read(&circuit, 1, &sampled, &idle));
        assert!(errors[1..].iter().all(|error| (1e-5..1e-3).contains(error)), "{errors:?}");
    }

    #[test]
    fn open_and_missing_spare_the_others_and_a_short_spares_none() {
        let circuit = ZeroPotential { row_source_ohm: [0.0; 2], ..ZeroPotential::TYPICAL };
        let [mut sampled, idle] = zero_potential_counts(&circuit, &row());
        (sampled[0], sampled[2]) = (f32::NAN, idle[2] + 3.0);
        sampled[4] = idle[4] - 3.0; // noise may go below idle
        let mut no_idle = idle;
        no_idle[3] = f32::NAN;
        let ohm = read(&circuit, 1, &sampled, &no_idle);
        assert!(ohm[0].is_nan() && ohm[3].is_nan());
        assert_eq!((ohm[2], ohm[4]), (f32::INFINITY, f32::INFINITY));
        assert!(errors(&ohm)[5] < 2e-6);
        // 3.1 V is the end, wherever the converter's is. Nothing is known of a row with a short, but what is open.
        sampled[1] = 3.1 / 3.3 * 4096.0 + 0.1;
        let ohm = read(&circuit, 1, &sampled, &no_idle);
        assert_eq!((ohm[1], ohm[2], ohm[4]), (0.0, f32::INFINITY, f32::INFINITY));
        assert!(ohm[5..].iter().all(|ohm| ohm.is_nan()));
        sampled[1] -= 0.2;
        assert!(read(&circuit, 1, &sampled, &no_idle)[5..].iter().all(|ohm| *ohm > 50.0));
    }

    #[test]
    fn unread_columns_load_the_row_by_their_measured_share() {
        let mut circuit = ZeroPotential { row_source_ohm: [9.0, 0.3], ..ZeroPotential::TYPICAL };
        (0..18).for_each(|k| circuit.feedback_ohm[k] -= k as f32);
        let (columns, scale) = (ColumnWires(1 << 2 | 1 << 8 | 1 << 14), circuit.scale(4095));
        let read = |counts: &[f32; 18], idle: &[f32; 18], load: f32| {
            let (mut ohm, scanned) = (*counts, ScannedRow { row: RowWire(1), columns, load });
            circuit.row_ohm(scanned, idle, &scale, &mut ohm);
            let error = |k: usize| (f64::from(ohm[k]) / row()[k] - 1.0).abs();
            [2, 8, 14].map(error).into_iter().fold(0.0, f64::max)
        };
        let [sampled, idle] = zero_potential_counts(&circuit, &row());
        let load = circuit.load(columns, &idle, &scale, &sampled);
        assert!(read(&sampled, &idle, load) < 2e-6);
        // Without the others' share readings are 7 % too high; with that of equal columns still a little off.
        assert!(read(&sampled, &idle, 1.0) > 0.05);
        assert!((1e-5..5e-3).contains(&read(&sampled, &idle, 6.0)));
        // A column that could not be sampled counts as the mean, and one that is open draws nothing.
        let (mut missing, mut open) = (sampled, sampled);
        missing[5] = f32::NAN;
        open[5] = idle[5] + 3.0;
        assert!((circuit.load(columns, &idle, &scale, &missing) / load - 1.0).abs() < 1e-2);
        let without = circuit.load(columns, &idle, &scale, &open) / load;
        let share = 1.0 / row()[5] / row().iter().map(|ohm| 1.0 / ohm).sum::<f64>();
        assert!((f64::from(without) - (1.0 - share)).abs() < 1e-6, "{without}");
        let mut failed = sampled;
        failed[2] = f32::NAN;
        assert!(read(&failed, &idle, load) < 5e-3, "one that is read could not be sampled");
        // Nothing is known of a row without current.
        assert_eq!(circuit.load(columns, &idle, &scale, &idle), 6.0);
        // Nor of one with a short.
        missing[5] = 4000.0;
        assert!(circuit.load(columns, &idle, &scale, &missing).is_nan());
    }

    #[test]
    fn a_columns_lead_is_taken_out_of_all_its_rows() {
        // One column of two rows, 50 and 60 Ω, behind 0.5 Ω: all its currents are smaller by
        // 1 + 0.5·(1/50 + 1/60).
        let circuit = ZeroPotential::<3, 1> { series_ohm: [0.5], ..ZeroPotential::TYPICAL };
        let factor = 1.0 + 0.5 * (1.0 / 50.0 + 1.0 / 60.0);
        // A missing row counts as the mean of the others: here as one of 54.5 Ω that is there.
        let third = 2.0 / (1.0 / 50.0 + 1.0 / 60.0);
        let factor_of_three = factor + 0.5 / third;
        // An open row counts, with no current.
        for (third, factor) in [(f32::NAN, factor_of_three), (f32::INFINITY, factor)] {
            let frame = [[50.0 * factor], [60.0 * factor], [third]];
            let [[first], [second], [found]] = corrected(&circuit, frame);
            assert!((first - 50.0).abs() < 1e-4 && (second - 60.0).abs() < 1e-4, "{third}");
            assert!(found == third || found.is_nan() && third.is_nan(), "{found}");
        }
        // A short stays one, and a negative resistance is one.
        let [[missing], [short], _] = corrected(&circuit, [[f32::NAN], [0.0], [f32::NAN]]);
        assert!(missing.is_nan() && short == 0.0);
        let circuit = ZeroPotential::<1, 1> { series_ohm: [1000.0], ..ZeroPotential::TYPICAL };
        assert_eq!(corrected(&circuit, [[60.0]]), [[0.0]]);
    }
}
