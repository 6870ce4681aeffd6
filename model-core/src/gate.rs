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
use crate::estimate::{Estimate, RowStatus};

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
/// use taxel_core::gate::{Gate, Rest};
/// use taxel_core::{Estimate, RowStatus};
/// // One row of two readings and one output; 0.01 is what the model decodes the baseline to.
/// let (baseline_ohm, outputs, status) = ([50.0, 60.0], [0.01], [RowStatus::Decoded]);
/// let rest = Rest { baseline_ohm: &baseline_ohm, outputs: &outputs, status: &status };
/// let gate = Gate::new(rest, 0.02).unwrap();
/// let (mut outputs, mut status) = ([f32::NAN], [RowStatus::Overflow]);
/// let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
/// for (readings, at_rest) in [
///     ([50.5, 58.0], false), // one is 3 % less
///     ([49.1, 59.0], false), // both are nearly 2 % less
///     ([50.5, 59.0], true),
/// ] {
///     let awake = gate.give_rest(&readings, [2, 1], &mut estimate, false);
///     assert_eq!(awake == 0, at_rest);
///     assert_eq!(estimate.status[0] == RowStatus::AtRest, at_rest);
///     assert_eq!(estimate.outputs[0] == 0.01, at_rest);
/// }
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
    pub fn new(rest: Rest<'a>, tolerance: f32) -> Option<Self> {
        (tolerance > 0.0 && tolerance < 1.0).then_some(Self { rest, tolerance })
    }

    /// Gives the outputs at rest to the rows of a frame whose `readings` (Ω) are at rest, and marks these rows in the
    /// estimate's status. Other rows are awake: they are marked as missing, until they are decoded. Returns how many
    /// they are; with `until_awake`, it ends with the first one.
    ///
    /// `sizes` are the numbers of readings and of outputs a row. All rows are awake if the frame, the estimate or what
    /// is known of the sensor at rest has another length.
    #[cfg_attr(
        cortex_m4f,
        expect(unsafe_code, reason = "a call to assembly, whose condition is checked before")
    )]
    pub fn give_rest(
        &self,
        readings: &[f32],
        sizes: [usize; 2],
        estimate: &mut Estimate<'_>,
        until_awake: bool,
    ) -> usize {
        if !self.suits(readings, sizes, estimate) {
            estimate.status.fill(RowStatus::MissingReading);
            return estimate.status.len().max(1);
        }
        #[cfg(cortex_m4f)]
        {
            let Rest { baseline_ohm, outputs, status } = self.rest;
            let rest = (baseline_ohm, outputs, status);
            // SAFETY: all lengths were just checked.
            unsafe {
                cortex_m4::give_rest(readings, rest, self.tolerance, sizes, estimate, until_awake)
            }
        }
        #[cfg(not(cortex_m4f))]
        self.give_rest_in_rust(readings, sizes, estimate, until_awake)
    }

    /// Whether everything has these sizes a row, and as many rows as the estimate's status, and none is empty.
    #[inline]
    fn suits(
        &self,
        readings: &[f32],
        [inputs, outputs]: [usize; 2],
        estimate: &Estimate<'_>,
    ) -> bool {
        let Rest { baseline_ohm, outputs: rest, status } = self.rest;
        let rows = estimate.status.len();
        let are = |count: usize, a: &[f32], b: &[f32]| {
            !a.is_empty() && a.len() == b.len() && rows.checked_mul(count) == Some(a.len())
        };
        are(inputs, readings, baseline_ohm)
            && are(outputs, rest, estimate.outputs)
            && status.len() == rows
    }

    /// Gives rest as the assembly routine does, in portable Rust: its twin.
    #[cfg(not(cortex_m4f))]
    fn give_rest_in_rust(
        &self,
        readings: &[f32],
        [inputs, outputs]: [usize; 2],
        estimate: &mut Estimate<'_>,
        until_awake: bool,
    ) -> usize {
        let Rest { baseline_ohm, outputs: rest, status: known } = self.rest;
        let mut awake = 0;
        let readings = readings.chunks_exact(inputs).zip(baseline_ohm.chunks_exact(inputs));
        let outputs = estimate.outputs.chunks_exact_mut(outputs).zip(rest.chunks_exact(outputs));
        let status = estimate.status.iter_mut().zip(known);
        for (((readings, baseline), (outputs, rest)), (status, known)) in
            readings.zip(outputs).zip(status)
        {
            let decoded = *known == RowStatus::Decoded;
            if decoded && is_at_rest(readings, baseline, self.tolerance) {
                outputs.copy_from_slice(rest);
                *status = RowStatus::AtRest;
            } else {
                *status = RowStatus::MissingReading;
                awake += 1;
                if until_awake {
                    return awake;
                }
            }
        }
        awake
    }
}

/// Whether a row is at rest: each of its n `readings` is within `tolerance` (0 to 1) of its finite `baseline`,
/// relative to it, and their sum within `tolerance`/√n of the baseline's sum.
///
/// A row with a reading that is NaN or infinite is not at rest, nor one with a baseline that is NaN or negative.
/// Readings beyond the shorter of the two lists are ignored.
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
        let mut outputs = [0.0; 4];
        let mut found = [RowStatus::Overflow; 4];
        let mut estimate = Estimate { outputs: &mut outputs, status: &mut found };
        assert_eq!(gate.give_rest(&[60.0; 4], [1, 1], &mut estimate, false), 2);
        assert_eq!(gate.give_rest(&[60.0; 4], [1, 1], &mut estimate, true), 1);
        let (rest, awake) = (RowStatus::AtRest, RowStatus::MissingReading);
        assert_eq!((outputs, found), ([1.0, 0.0, 0.0, 4.0], [rest, awake, awake, rest]));
    }

    #[test]
    fn a_frame_of_another_length_than_the_baseline_is_never_at_rest() {
        let status = [RowStatus::Decoded; 2];
        let rest = Rest { baseline_ohm: &[60.0; 4], outputs: &[1.0; 2], status: &status };
        let gate = Gate::new(rest, 0.02).unwrap();
        for (readings, rows, sizes, at_rest) in [
            (4, 2, [2, 1], true),
            (2, 2, [1, 1], false),
            (6, 2, [3, 1], false),
            (4, 2, [2, 2], false),
            (4, 2, [2, 0], false),
            (4, 2, [usize::MAX, 1], false),
            (2, 1, [2, 1], false),
            (6, 3, [2, 1], false),
            (0, 0, [2, 1], false),
        ] {
            let mut outputs = [0.0; 6];
            let outputs = &mut outputs[..(rows * sizes[1]).min(6)];
            let mut found = [RowStatus::Overflow; 3];
            let mut estimate = Estimate { outputs, status: &mut found[..rows] };
            let awake = gate.give_rest(&[60.0; 6][..readings], sizes, &mut estimate, false);
            let expected = if at_rest { RowStatus::AtRest } else { RowStatus::MissingReading };
            assert_eq!(awake == 0, at_rest, "{readings} {sizes:?}");
            assert!(found[..rows].iter().all(|status| *status == expected), "{readings} {sizes:?}");
            assert!(found[rows..].iter().all(|status| *status == RowStatus::Overflow));
        }
    }

    #[test]
    fn a_tolerance_that_is_none_makes_no_gate() {
        let rest = Rest { baseline_ohm: &[60.0], outputs: &[1.0], status: &[RowStatus::Decoded] };
        for tolerance in [0.0, -0.0, -0.02, 1.0, f32::INFINITY, f32::NAN] {
            assert!(Gate::new(rest, tolerance).is_none(), "{tolerance}");
        }
    }
}
