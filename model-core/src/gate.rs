//! Which rows of a frame are at rest, so that the answer for the sensor at rest serves them.
//!
//! With a *tolerance* t, relative to the baseline, a row of n readings is at rest if each of them is within
//! t of its baseline, and their sum is within t/√n of its own: a dent that is lost in the noise of
//! each reading moves all of them the same way. With white noise of the relative level p and t = k·p, both
//! tests have the same k; noise alone wakes an untouched row in at most 1 − (1 − 2Q(k))^(n + 1) of all
//! frames, Q being the upper tail of the standard normal distribution (Šidák's inequality).
//! `docs/gating.md` has what that saves and what it misses.

#[cfg(cortex_m4f)]
use crate::cortex_m4;
use crate::estimate::{Estimate, RowStatus};
use crate::frame::Frame;

/// What [`Decoder::decode_gated_into`](crate::Decoder::decode_gated_into) gives to rows at rest, and how it
/// knows them. It borrows both, so that a device keeps one copy of its baseline.
///
/// ```
/// use model_core::{Estimate, Frame, Gate, RowStatus};
/// let baseline = Frame { row_column_resistance_ohm: [[50.0, 60.0]] };
/// // What the model in force answers to `baseline`.
/// let rest = Estimate { outputs: [[0.01]], status: [RowStatus::Decoded] };
/// let gate = Gate::new(&baseline, &rest, 0.02).unwrap();
/// let mut outputs = [f32::NAN];
/// assert!(!gate.give_rest(0, &[50.5, 58.0], &mut outputs)); // one is 3 % less
/// assert!(!gate.give_rest(0, &[49.1, 59.0], &mut outputs)); // both are nearly 2 % less
/// assert!(outputs[0].is_nan());
/// assert!(gate.give_rest(0, &[50.5, 59.0], &mut outputs));
/// assert_eq!(outputs, [0.01]);
/// assert!(Gate::new(&baseline, &rest, 0.0).is_none());
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Gate<'a, const ROWS: usize, const COLS: usize, const OUTPUTS: usize> {
    baseline: &'a Frame<ROWS, COLS>,
    rest: &'a Estimate<ROWS, OUTPUTS>,
    tolerance: f32,
}

impl<'a, const ROWS: usize, const COLS: usize, const OUTPUTS: usize> Gate<'a, ROWS, COLS, OUTPUTS> {
    /// A gate from the mean of frames at rest in Ω, the answer of the model in force to it, and the
    /// tolerance k·p; `None` for a tolerance that is not above 0 and below 1.
    ///
    /// A row that `rest` marks as anything but decoded is never at rest: its baseline is not known.
    #[must_use]
    pub fn new(
        baseline: &'a Frame<ROWS, COLS>,
        rest: &'a Estimate<ROWS, OUTPUTS>,
        tolerance: f32,
    ) -> Option<Self> {
        (tolerance > 0.0 && tolerance < 1.0).then_some(Self { baseline, rest, tolerance })
    }

    /// Gives `outputs` the outputs at rest if the `readings` in Ω of row `row` are at rest, and says whether
    /// they are.
    pub fn give_rest(
        &self,
        row: usize,
        readings: &[f32; COLS],
        outputs: &mut [f32; OUTPUTS],
    ) -> bool {
        let baseline = self.baseline.row_column_resistance_ohm.get(row);
        let rest = self.rest.outputs.get(row).zip(self.rest.status.get(row));
        match baseline.zip(rest) {
            Some((baseline, (rest, RowStatus::Decoded))) => {
                give_rest(readings, baseline, self.tolerance, rest, outputs)
            }
            _ => false,
        }
    }
}

/// Whether each of n `readings` is within `tolerance`, from 0 to 1, of a finite `baseline`, and their sum
/// within `tolerance`/√n of its sum. A reading that is NaN or infinite is not, nor is any of a baseline that
/// is NaN or negative.
///
/// Readings beyond the shorter of the two lists are not looked at.
#[must_use]
pub fn is_at_rest(readings: &[f32], baseline: &[f32], tolerance: f32) -> bool {
    let (mut change, mut most_change) = (0.0, 0.0);
    for (reading, rest) in readings.iter().zip(baseline) {
        let (difference, most) = (reading - rest, tolerance * rest);
        // Not if either is NaN. To leave at once costs no more than to collect signs, and most rows that
        // are touched show it early.
        let near = difference.abs() <= most;
        if !near {
            return false;
        }
        change += difference;
        most_change += most;
    }
    let n = readings.len().min(baseline.len());
    change * change * n as f32 <= most_change * most_change
}

/// Gives `outputs` the `rest` if the `readings` [are at rest](is_at_rest), and says whether they are.
///
/// For a device neither generic nor inlined, as `decode_in_assembly` is.
#[cfg_attr(cortex_m4f, inline(never))]
fn give_rest(
    readings: &[f32],
    baseline: &[f32],
    tolerance: f32,
    rest: &[f32],
    outputs: &mut [f32],
) -> bool {
    #[cfg(cortex_m4f)]
    if let (Ok(readings), Ok(baseline), Ok(rest), Ok(outputs)) =
        (readings.try_into(), baseline.try_into(), rest.try_into(), (&mut *outputs).try_into())
    {
        return cortex_m4::give_rest(readings, baseline, tolerance, rest, outputs);
    }
    let at_rest = is_at_rest(readings, baseline, tolerance);
    if at_rest {
        outputs.iter_mut().zip(rest).for_each(|(output, rest)| *output = *rest);
    }
    at_rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_on_the_tolerance_is_at_rest_and_the_next_number_is_not() {
        // Numbers for which no operation rounds.
        let (baseline, tolerance) = ([64.0, 32.0, 16.0], 0.03125);
        for place in 0..baseline.len() {
            for side in [-1.0, 1.0] {
                let mut readings = baseline;
                readings[place] = baseline[place] * (1.0 + side * tolerance);
                assert!(is_at_rest(&readings, &baseline, tolerance), "{readings:?}");
                readings[place] =
                    f32::from_bits(readings[place].to_bits().wrapping_add_signed(if side > 0.0 {
                        1
                    } else {
                        -1
                    }));
                assert!(!is_at_rest(&readings, &baseline, tolerance), "{readings:?}");
            }
        }
    }

    #[test]
    fn readings_that_change_together_are_no_rest() {
        let baseline: [f32; 18] = core::array::from_fn(|k| 50.0 + k as f32);
        let shifted = |share: f32| baseline.map(|ohm| ohm * (1.0 + share));
        let most = 0.02 / 18.0_f32.sqrt();
        for side in [-1.0, 1.0] {
            assert!(is_at_rest(&shifted(side * 0.999 * most), &baseline, 0.02));
            assert!(!is_at_rest(&shifted(side * 1.001 * most), &baseline, 0.02));
        }
        let mut opposite = baseline;
        let signs = [0.9 * 0.02, -0.9 * 0.02].into_iter().cycle();
        opposite.iter_mut().zip(signs).for_each(|(ohm, share)| *ohm *= 1.0 + share);
        assert!(is_at_rest(&opposite, &baseline, 0.02));
    }

    #[test]
    fn what_is_no_number_is_never_at_rest() {
        for tolerance in [f32::MIN_POSITIVE, 0.02, 0.999_999_9] {
            for bad in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                for baseline in [f32::MIN_POSITIVE, 60.0, f32::MAX] {
                    assert!(!is_at_rest(&[60.0, bad], &[60.0, baseline], tolerance));
                }
            }
            for unknown in [f32::NAN, -f32::NAN, -60.0] {
                for reading in [60.0, -60.0, f32::NAN, f32::INFINITY] {
                    assert!(!is_at_rest(&[reading], &[unknown], tolerance));
                }
            }
        }
    }

    #[test]
    fn a_row_without_an_answer_for_rest_is_never_at_rest() {
        let baseline = Frame { row_column_resistance_ohm: [[60.0]; 4] };
        let status = [
            RowStatus::Decoded,
            RowStatus::MissingReading,
            RowStatus::Overflow,
            RowStatus::Decoded,
        ];
        let rest = Estimate { outputs: [[1.0], [2.0], [3.0], [4.0]], status };
        let gate = Gate::new(&baseline, &rest, 0.02).unwrap();
        let found = [0, 1, 2, 3, 4].map(|row| {
            let mut outputs = [0.0];
            (gate.give_rest(row, &[60.0], &mut outputs), outputs)
        });
        let untouched = (false, [0.0]);
        assert_eq!(found, [(true, [1.0]), untouched, untouched, (true, [4.0]), untouched]);
    }

    #[test]
    fn a_tolerance_that_is_none_makes_no_gate() {
        let baseline = Frame { row_column_resistance_ohm: [[60.0]] };
        let rest = Estimate { outputs: [[1.0]], status: [RowStatus::Decoded] };
        for tolerance in [0.0, -0.0, -0.02, 1.0, f32::INFINITY, f32::NAN] {
            assert!(Gate::new(&baseline, &rest, tolerance).is_none(), "{tolerance}");
        }
    }
}
