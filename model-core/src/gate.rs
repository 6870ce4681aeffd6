//! Gating: rows that are at rest (untouched) are not decoded, but get the outputs of the sensor at rest.
//!
//! A row of n readings is at rest if each reading is within a *tolerance* t, relative to the baseline, and
//! their sum is within t/√n of the baseline's sum. The second test is there because a dent that is lost in the
//! noise of each reading moves all of them the same way.
//!
//! With white noise of the relative level p and t = k·p, both tests have the same k. Noise alone makes an
//! untouched row count as touched in at most 1 − (1 − 2Q(k))^(n + 1) of all frames, Q being the upper tail of
//! the standard normal distribution (Šidák's inequality). `docs/gating.md` shows what gating saves and misses.

#[cfg(cortex_m4f)]
use crate::cortex_m4;
use crate::estimate::RowStatus;

/// What a gate compares frames with: the sensor at rest.
#[derive(Debug, Clone, Copy)]
pub struct Rest<'a> {
    /// Mean of frames at rest in Ω, row after row.
    pub baseline_ohm: &'a [f32],
    /// Outputs that the model decodes the baseline to, row after row.
    pub outputs: &'a [f32],
    /// How the decoding of each row of the baseline ended.
    pub status: &'a [RowStatus],
}

/// Finds the rows of a frame that are at rest (untouched), and gives them the outputs at rest.
///
/// [`Decoder::decode_into`](crate::Decoder::decode_into) skips these rows. The gate borrows baseline and outputs, so
/// that a device keeps one copy of each.
///
/// ```
/// use model_core::gate::{Gate, Rest};
/// use model_core::RowStatus;
/// // One row of two readings and one output; 0.01 is what the model decodes the baseline to.
/// let (baseline_ohm, outputs, status) = ([50.0, 60.0], [0.01], [RowStatus::Decoded]);
/// let rest = Rest { baseline_ohm: &baseline_ohm, outputs: &outputs, status: &status };
/// let gate = Gate::new(rest, 0.02).unwrap();
/// let mut outputs = [f32::NAN];
/// assert!(!gate.give_rest(0, &[50.5, 58.0], &mut outputs)); // one is 3 % less
/// assert!(!gate.give_rest(0, &[49.1, 59.0], &mut outputs)); // both are nearly 2 % less
/// assert!(outputs[0].is_nan());
/// assert!(gate.give_rest(0, &[50.5, 59.0], &mut outputs));
/// assert_eq!(outputs, [0.01]);
/// assert!(Gate::new(rest, 0.0).is_none());
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Gate<'a> {
    rest: Rest<'a>,
    tolerance: f32,
}

impl<'a> Gate<'a> {
    /// Makes a gate from what the sensor is like at `rest` and the `tolerance` k·p. `None` for a tolerance that is
    /// not above 0 and below 1.
    ///
    /// A row whose status in `rest` is not decoded is never at rest: its baseline is not known.
    #[must_use]
    pub fn new(rest: Rest<'a>, tolerance: f32) -> Option<Self> {
        (tolerance > 0.0 && tolerance < 1.0).then_some(Self { rest, tolerance })
    }

    /// Copies the outputs at rest to `outputs` if the `readings` (Ω) of row `row` are at rest; returns whether
    /// they are.
    #[inline]
    pub fn give_rest(&self, row: usize, readings: &[f32], outputs: &mut [f32]) -> bool {
        let Rest { baseline_ohm, outputs: rest, status } = self.rest;
        let baseline = row_of(baseline_ohm, row, readings.len());
        let rest = row_of(rest, row, outputs.len());
        match (baseline, rest, status.get(row)) {
            (Some(baseline), Some(rest), Some(RowStatus::Decoded)) => {
                give_rest(readings, baseline, self.tolerance, rest, outputs)
            }
            _ => false,
        }
    }
}

/// The numbers of `row` in a list of rows of `length` numbers.
#[inline]
fn row_of(rows: &[f32], row: usize, length: usize) -> Option<&[f32]> {
    rows.get(row.checked_mul(length)?..)?.get(..length)
}

/// Whether a row is at rest: each of its n `readings` is within `tolerance` (0 to 1) of its finite `baseline`,
/// relative to it, and their sum within `tolerance`/√n of the baseline's sum.
///
/// A row with a reading that is NaN or infinite is not at rest, nor one with a baseline that is NaN or negative.
/// Readings beyond the shorter of the two lists are ignored.
#[must_use]
pub fn is_at_rest(readings: &[f32], baseline: &[f32], tolerance: f32) -> bool {
    let (mut change, mut most_change) = (0.0, 0.0);
    for (reading, rest) in readings.iter().zip(baseline) {
        let (difference, most) = (reading - rest, tolerance * rest);
        // False if either is NaN. Leaving at once costs no more than collecting signs, and most touched rows
        // show it early.
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

/// Copies `rest` to `outputs` if the `readings` [are at rest](is_at_rest); returns whether they are.
///
/// Inlined on a device, because the compiler's call would cost as much as the assembly's.
#[cfg_attr(
    cortex_m4f,
    inline(always),
    expect(clippy::inline_always, reason = "two comparisons and a call")
)]
fn give_rest(
    readings: &[f32],
    baseline: &[f32],
    tolerance: f32,
    rest: &[f32],
    outputs: &mut [f32],
) -> bool {
    #[cfg(cortex_m4f)]
    if let Some(at_rest) = cortex_m4::give_rest(readings, baseline, tolerance, rest, outputs) {
        return at_rest;
    }
    give_rest_in_rust(readings, baseline, tolerance, rest, outputs)
}

/// Gives rest as [`give_rest`] does, in portable Rust: the compiled twin of the assembly.
#[cfg_attr(cortex_m4f, inline(never))]
fn give_rest_in_rust(
    readings: &[f32],
    baseline: &[f32],
    tolerance: f32,
    rest: &[f32],
    outputs: &mut [f32],
) -> bool {
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
        // With these numbers no operation rounds.
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
        let status = [
            RowStatus::Decoded,
            RowStatus::MissingReading,
            RowStatus::Overflow,
            RowStatus::Decoded,
        ];
        let rest =
            Rest { baseline_ohm: &[60.0; 4], outputs: &[1.0, 2.0, 3.0, 4.0], status: &status };
        let gate = Gate::new(rest, 0.02).unwrap();
        let found = [0, 1, 2, 3, 4].map(|row| {
            let mut outputs = [0.0];
            (gate.give_rest(row, &[60.0], &mut outputs), outputs)
        });
        let untouched = (false, [0.0]);
        assert_eq!(found, [(true, [1.0]), untouched, untouched, (true, [4.0]), untouched]);
    }

    #[test]
    fn a_tolerance_that_is_none_makes_no_gate() {
        let rest = Rest { baseline_ohm: &[60.0], outputs: &[1.0], status: &[RowStatus::Decoded] };
        for tolerance in [0.0, -0.0, -0.02, 1.0, f32::INFINITY, f32::NAN] {
            assert!(Gate::new(rest, tolerance).is_none(), "{tolerance}");
        }
    }
}
