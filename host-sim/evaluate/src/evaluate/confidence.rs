//! Confidence of a model: how many errors its intervals cover.

use taxel_data::{Table, columns};

/// Errors of one group of outputs beside their deviations.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage {
    /// Name of the group: `dz_mm`, or a column's name.
    pub group: String,
    /// Unit of the outputs.
    pub unit: String,
    /// All errors.
    pub all: Covered,
    /// The quarter of the errors with the least deviations.
    pub surest_quarter: Covered,
    /// The quarter of the errors with the largest deviations.
    pub least_sure_quarter: Covered,
}

/// Errors, and how many of them the intervals cover.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Covered {
    /// Number of errors.
    pub count: usize,
    /// Root mean square of the errors, in their unit.
    pub rmse: f64,
    /// Share of the errors within one deviation; it should be 68 %.
    pub percent_within_68: f64,
    /// Share of the errors within the ratio's number of deviations; it should be 95 %.
    pub percent_within_95: f64,
}

/// One error, with its deviation and the number of deviations of the 95 % interval.
#[derive(Clone, Copy)]
struct Judged {
    error: f64,
    deviation: f64,
    ratio_95: f64,
}

impl Covered {
    fn new(judged: &[Judged]) -> Self {
        let count = judged.len();
        let share = |within: &dyn Fn(&Judged) -> bool| {
            100.0 * judged.iter().filter(|one| within(one)).count() as f64 / count as f64
        };
        let squares: f64 = judged.iter().map(|one| one.error * one.error).sum();
        Self {
            count,
            rmse: (squares / count as f64).sqrt(),
            percent_within_68: share(&|one| one.error.abs() <= one.deviation),
            percent_within_95: share(&|one| one.error.abs() <= one.ratio_95 * one.deviation),
        }
    }
}

/// Coverage of the errors of `estimates` by group of outputs. Missing truths, estimates and deviations do not count; a
/// group without any is left out.
///
/// # Panics
/// If there are not as many estimates and deviations as truths, or ratios as columns.
pub fn coverage(
    truth: &Table,
    estimates: &[f64],
    deviations: &[f64],
    ratios_95: &[f32],
) -> Vec<Coverage> {
    assert_eq!([estimates.len(), deviations.len()], [truth.values.len(); 2], "one for every truth");
    let width = truth.names.len();
    let of_group = |(group, members): &(&str, Vec<usize>)| {
        let judged = |line: usize, column: usize| {
            let at = line * width + column;
            let (error, ratio_95) =
                (estimates[at] - truth.values[at], f64::from(ratios_95[column]));
            Judged { error, deviation: deviations[at], ratio_95 }
        };
        let lines = 0..truth.len();
        let mut all: Vec<Judged> = lines
            .flat_map(|line| members.iter().map(move |column| judged(line, *column)))
            .filter(|one| !(one.error.is_nan() || one.deviation.is_nan()))
            .collect();
        all.sort_by(|a, b| a.deviation.total_cmp(&b.deviation));
        let quarter = all.len().div_ceil(4);
        (!all.is_empty()).then(|| Coverage {
            group: (*group).into(),
            unit: columns::unit_of(&truth.names[members[0]]).into(),
            all: Covered::new(&all),
            surest_quarter: Covered::new(&all[..quarter]),
            least_sure_quarter: Covered::new(&all[all.len() - quarter..]),
        })
    };
    columns::groups(&truth.names).iter().filter_map(of_group).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coverage_counts_errors_within_their_own_deviations() {
        let truth = Table {
            names: vec!["r1e1_dz_mm".into(), "r1e2_dz_mm".into()],
            values: vec![0.0; 8].into(),
        };
        // Errors of ½, 1½, 2½ deviations and so on.
        let estimates = [0.05, 0.3, -0.15, 0.9, 0.25, -1.5, f64::NAN, 0.1];
        let deviations = [0.1, 0.2, 0.1, 0.6, 0.1, 0.6, 0.1, 0.2];
        let found = coverage(&truth, &estimates, &deviations, &[2.0, 2.0]);
        let [group] = &found[..] else { panic!("{found:?}") };
        assert_eq!((group.group.as_str(), group.unit.as_str()), ("dz_mm", "mm"));
        let covered = |of: Covered| (of.count, of.percent_within_68, of.percent_within_95);
        let (one, two) = (100.0 / 7.0 * 2.0, 100.0 / 7.0 * 5.0);
        assert_eq!(covered(group.all), (7, one, two));
        // The two with the least deviations, and the two with the largest.
        assert_eq!(covered(group.surest_quarter), (2, 50.0, 100.0));
        assert_eq!(covered(group.least_sure_quarter), (2, 0.0, 50.0));
    }
}
