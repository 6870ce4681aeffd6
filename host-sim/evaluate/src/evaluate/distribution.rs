//! How errors are distributed, and frames to look at: from truth, estimates and readings alone, so that scenes and
//! measured data share it.

use serde::Serialize;
use taxel_data::{Table, columns};

mod density;
mod histogram;
mod frames;
mod readings;

pub use density::Density;
pub use frames::{Rank, ShownFrame};
pub use histogram::Histogram;
pub use readings::{Reference, RelativeTo, ShownReadings};

/// Distribution of a decoder's errors over the frames of a table. What pictures show stands in their CSV files alone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Distribution {
    /// Errors by group of outputs, in the order in which groups first appear.
    pub groups: Vec<GroupDistribution>,
    /// Errors by output, in the order of the columns.
    #[serde(skip)]
    pub outputs: Vec<OutputError>,
    /// Readings that the frames below have.
    #[serde(skip)]
    pub readings: ShownReadings,
    /// Frames of median, high and largest error; fewer if two of them are the same frame.
    #[serde(skip)]
    pub frames: Vec<ShownFrame>,
    /// Frames of these and of other ranks, from the least to the largest error, without their readings: for pictures.
    #[serde(skip)]
    pub steps: Vec<ShownFrame>,
}

/// Distribution of the errors e = estimate − truth of one group of outputs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GroupDistribution {
    /// Name of the group: `dz_mm`, or a column's name.
    pub group: String,
    pub unit: String,
    /// Number of pairs of truth and estimate that count.
    pub count: usize,
    /// Median of |e|; NaN without any pair, as the two below.
    pub median: f64,
    /// What 95 % of all |e| do not exceed.
    pub percentile_95: f64,
    /// Largest |e|.
    pub largest: f64,
    /// How many errors have which size |e|.
    #[serde(skip)]
    pub histogram: Histogram,
    /// How many pairs of truth and estimate lie where.
    #[serde(skip)]
    pub density: Density,
}

/// Error of one output.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputError {
    pub name: String,
    pub group: String,
    pub unit: String,
    /// Row-wire and electrode (from 1) that it belongs to, if its name tells.
    pub electrode: Option<[usize; 2]>,
    /// Root mean square error; NaN without any pair of truth and estimate.
    pub rmse: f64,
}

impl Distribution {
    /// Distribution of the errors of `estimate`, which is laid out like `truth`. `readings` has a line for each of
    /// their lines.
    ///
    /// Pairs with a missing value (NaN) on either side do not count.
    ///
    /// # Panics
    /// If the tables differ in their number of lines, or the first two in that of columns.
    pub fn new(
        truth: &Table,
        estimate: &Table,
        readings: &Table,
        reference: Reference<'_>,
    ) -> Self {
        assert_eq!(truth.values.len(), estimate.values.len(), "an estimate for every truth");
        assert_eq!(truth.len(), readings.len(), "readings for every truth");
        let groups = columns::groups(&truth.names);
        let ranked = frames::ranked(truth, estimate, &groups);
        let named = ranked.iter().filter(|frame| frame.rank.is_named());
        let mut frames = frames::distinct(named.cloned());
        let (readings, changes) = readings::changes(readings, reference, &frames);
        for (frame, change) in frames.iter_mut().zip(changes) {
            frame.change = change;
        }
        Self {
            groups: groups.iter().map(|(name, of)| group(name, of, truth, estimate)).collect(),
            outputs: outputs(truth, estimate),
            readings,
            frames,
            steps: frames::distinct(ranked),
        }
    }

    /// Group that maps and headlines show: z if there is one, else the last.
    pub fn main_group(&self) -> Option<&GroupDistribution> {
        let z = |group: &&GroupDistribution| matches!(group.group.as_str(), "dz_mm" | "fz_n");
        self.groups.iter().find(z).or(self.groups.last())
    }
}

fn pairs<'t>(
    columns: &'t [usize],
    truth: &'t Table,
    estimate: &'t Table,
) -> impl Iterator<Item = [f64; 2]> + 't {
    let lines = truth.lines().zip(estimate.lines());
    let of_line = |(truth, estimate): (&'t [f64], &'t [f64])| {
        columns.iter().map(move |column| [truth[*column], estimate[*column]])
    };
    lines.flat_map(of_line).filter(|[truth, estimate]| !(truth - estimate).is_nan())
}

fn group(name: &str, columns: &[usize], truth: &Table, estimate: &Table) -> GroupDistribution {
    let all: Vec<[f64; 2]> = pairs(columns, truth, estimate).collect();
    let mut errors: Vec<f64> = all.iter().map(|[truth, value]| (value - truth).abs()).collect();
    errors.sort_unstable_by(f64::total_cmp);
    let at = |share| nearest_rank(errors.len(), share).map_or(f64::NAN, |rank| errors[rank]);
    GroupDistribution {
        group: name.into(),
        unit: columns::unit_of(name).into(),
        count: errors.len(),
        median: at(0.5),
        percentile_95: at(0.95),
        largest: at(1.0),
        histogram: Histogram::new(&errors, at(0.95)),
        density: Density::new(&all),
    }
}

/// Index of the value that a `share` of `count` values in ascending order do not exceed.
fn nearest_rank(count: usize, share: f64) -> Option<usize> {
    let rank = (share * count as f64).ceil() as usize;
    (count > 0).then(|| rank.clamp(1, count) - 1)
}

fn outputs(truth: &Table, estimate: &Table) -> Vec<OutputError> {
    let of_column = |(column, name): (usize, &String)| {
        let (mut squares, mut count) = (0.0, 0.0);
        for [truth, value] in pairs(&[column], truth, estimate) {
            squares += (value - truth) * (value - truth);
            count += 1.0;
        }
        OutputError {
            name: name.clone(),
            group: columns::group_of(name).into(),
            unit: columns::unit_of(name).into(),
            electrode: electrode(name),
            rmse: f64::sqrt(squares / count),
        }
    };
    truth.names.iter().enumerate().map(of_column).collect()
}

/// Row-wire and electrode of a name such as `r4e2_dz_mm`, both from 1.
fn electrode(name: &str) -> Option<[usize; 2]> {
    let (row, rest) = name.strip_prefix('r')?.split_once('e')?;
    let (number, _) = rest.split_once('_')?;
    let [row, number] = [row.parse().ok()?, number.parse().ok()?];
    (row > 0 && number > 0).then_some([row, number])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(names: &[&str], values: Vec<f64>) -> Table {
        Table {
            names: names.iter().map(|name| (*name).to_owned()).collect(),
            values: values.into(),
        }
    }

    /// Two electrodes of which the second is off by n/100 mm in frame n, and one reading.
    fn hundred() -> [Table; 3] {
        let names = ["r1e1_dz_mm", "r1e2_dz_mm"];
        let truth = table(&names, vec![0.5; 200]);
        let estimates = (0..100).flat_map(|n| [0.5, 0.5 + f64::from(n) / 100.0]);
        let readings = (0..100).map(|n| 50.0 - f64::from(n) / 10.0);
        [truth, table(&names, estimates.collect()), table(&["r1c1_ohm"], readings.collect())]
    }

    #[test]
    fn percentiles_outputs_and_frames_by_hand() {
        let [mut truth, estimate, readings] = hundred();
        truth.values[1] = f64::NAN; // one pair of frame 0 is missing
        let found = Distribution::new(&truth, &estimate, &readings, Reference::Rest(&[50.0]));
        let [z] = &found.groups[..] else { panic!("one group") };
        assert_eq!((z.group.as_str(), z.unit.as_str(), z.count), ("dz_mm", "mm", 199));
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        // A hundred errors are 0, the others 0.01 to 0.99.
        close(z.median, 0.0);
        close(z.percentile_95, 0.90);
        close(z.largest, 0.99);
        assert_eq!(z.histogram.counts.iter().sum::<usize>() + z.histogram.beyond, 199);
        assert_eq!(z.density.counts.iter().sum::<usize>() + z.density.outside, 199);
        close(found.outputs[0].rmse, 0.0);
        close(found.outputs[1].rmse, (328_350.0_f64 / 99.0).sqrt() / 100.0);
        assert_eq!(found.outputs[1].electrode, Some([1, 2]));
        let frames: Vec<_> = found.frames.iter().map(|f| (f.rank, f.frame)).collect();
        assert_eq!(frames, [(Rank::Median, 49), (Rank::High, 94), (Rank::Worst, 99)]);
        let steps: Vec<_> = found.steps.iter().map(|f| (f.rank.percent(), f.frame)).collect();
        assert_eq!((steps.len(), steps[0], steps[1]), (13, (0, 0), (10, 9)));
        assert_eq!((steps[5], steps[10], steps[12]), ((50, 49), (95, 94), (100, 99)));
        close(found.frames[0].change[0], -100.0 * 4.9 / 50.0);
        close(found.frames[2].rmse[0], 0.99 / 2.0_f64.sqrt());
    }

    #[test]
    fn without_any_pair_there_is_nothing_to_show() {
        let [truth, mut estimate, readings] = hundred();
        estimate.values.fill(f64::NAN);
        let found = Distribution::new(&truth, &estimate, &readings, Reference::Median);
        assert!(found.frames.is_empty() && found.groups[0].median.is_nan());
        assert_eq!(found.groups[0].histogram.counts.iter().sum::<usize>(), 0);
    }

    #[test]
    fn frames_are_ordered_by_quantities_in_their_own_spread() {
        // Place varies by mm, depth by hundredths of a mm: an error of 0.02 in depth is the larger one.
        let names = ["contact_x_mm", "contact_depth_mm"];
        let truth = table(&names, vec![0.0, 0.00, 10.0, 0.02, 20.0, 0.04]);
        let estimate = table(&names, vec![0.0, 0.00, 10.5, 0.02, 20.0, 0.06]);
        let readings = table(&["a", "b"], vec![1.0, -2.0, 2.0, 0.0, 3.0, 2.0]);
        let found = Distribution::new(&truth, &estimate, &readings, Reference::Median);
        let frames: Vec<_> = found.frames.iter().map(|f| f.frame).collect();
        assert_eq!(frames, [1, 2], "the worst is also the one at 95 %");
        assert_eq!(found.frames[1].rank, Rank::Worst);
        let steps: Vec<_> = found.steps.iter().map(|f| (f.rank.percent(), f.frame)).collect();
        assert_eq!(steps, [(30, 0), (60, 1), (100, 2)], "each frame once");
        assert_eq!(found.readings.relative_to, RelativeTo::MedianInDeviations);
        assert!((found.frames[1].change[0] - 1.5_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn names_tell_electrodes() {
        assert_eq!(electrode("r12e3_dz_mm"), Some([12, 3]));
        for other in ["r4c17_ohm", "fx_n", "reel_2", "r0e1_dz_mm", "re_x", "r1e2"] {
            assert_eq!(electrode(other), None, "{other}");
        }
    }
}
