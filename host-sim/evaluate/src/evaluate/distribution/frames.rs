//! Frames to look at, by the rank of their errors.

use std::collections::BTreeSet;

use taxel_data::{Table, columns};

use super::{nearest_rank, pairs};

/// Place of a frame among all frames, in the order of their errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rank {
    /// Half of the frames have no larger error.
    Median,
    /// 95 % of the frames have no larger error.
    High,
    /// No frame has a larger error.
    Worst,
    /// So many per cent of the frames have no larger error; of 0, it has the least error.
    Percent(u8),
}

impl Rank {
    const ALL: [Self; 13] = [
        Self::Percent(0),
        Self::Percent(10),
        Self::Percent(20),
        Self::Percent(30),
        Self::Percent(40),
        Self::Median,
        Self::Percent(60),
        Self::Percent(70),
        Self::Percent(80),
        Self::Percent(90),
        Self::High,
        Self::Percent(99),
        Self::Worst,
    ];

    /// Share of the frames that have no larger error, in per cent.
    pub fn percent(self) -> u8 {
        match self {
            Self::Median => 50,
            Self::High => 95,
            Self::Worst => 100,
            Self::Percent(percent) => percent,
        }
    }

    /// Whether the frame stands for many, and is shown with its readings.
    pub(super) fn is_named(self) -> bool {
        !matches!(self, Self::Percent(_))
    }
}

/// Frame to look at.
///
/// Frames are ordered by the root mean square of the errors of their outputs. Outputs of one quantity are compared as
/// they are; where there are several quantities, each is divided by the standard deviation of its true values.
#[derive(Debug, Clone, PartialEq)]
pub struct ShownFrame {
    /// Place among all frames.
    pub rank: Rank,
    /// Index of the frame, from 0.
    pub frame: usize,
    /// RMSE in this frame by group of outputs, in the group's unit; NaN for a group without a value.
    pub rmse: Vec<f64>,
    /// True outputs, in the order of the columns.
    pub truth: Vec<f64>,
    /// Decoded outputs, in the order of the columns.
    pub estimate: Vec<f64>,
    /// Readings relative to their reference: see [`RelativeTo`](super::RelativeTo). None in a
    /// [step](super::Distribution::steps).
    pub change: Vec<f64>,
}

/// Frames of all ranks in ascending order, without their readings. Of few frames one may have several ranks.
pub(super) fn ranked(
    truth: &Table,
    estimate: &Table,
    groups: &[(&str, Vec<usize>)],
) -> Vec<ShownFrame> {
    let spreads = spreads(truth, estimate);
    let errors = truth.lines().zip(estimate.lines()).map(|(truth, estimate)| {
        let errors = truth.iter().zip(estimate).zip(&spreads);
        root_mean_square(errors.map(|((truth, value), spread)| (value - truth) / spread))
    });
    let mut order: Vec<(f64, usize)> =
        errors.enumerate().filter(|(_, e)| !e.is_nan()).map(|(frame, e)| (e, frame)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let of_rank = |rank: Rank| {
        let share = f64::from(rank.percent()) / 100.0;
        let frame = order[nearest_rank(order.len(), share)?].1;
        let line = |table: &Table| table.lines().nth(frame).unwrap_or_default().to_vec();
        let (truth, estimate) = (line(truth), line(estimate));
        let of_group = |(_, columns): &(&str, Vec<usize>)| {
            root_mean_square(columns.iter().map(|column| estimate[*column] - truth[*column]))
        };
        let rmse = groups.iter().map(of_group).collect();
        Some(ShownFrame { rank, frame, rmse, truth, estimate, change: vec![] })
    };
    Rank::ALL.into_iter().filter_map(of_rank).collect()
}

/// Each of `frames` once: the higher one of its ranks counts.
pub(super) fn distinct(frames: impl IntoIterator<Item = ShownFrame>) -> Vec<ShownFrame> {
    let mut all: Vec<ShownFrame> = frames.into_iter().collect();
    all.reverse();
    let mut known = BTreeSet::new();
    all.retain(|frame| known.insert(frame.frame));
    all.reverse();
    all
}

/// Root mean square of all values that are not missing; NaN without one.
fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values
        .filter(|value| !value.is_nan())
        .fold((0.0, 0.0), |(sum, count), value| (sum + value * value, count + 1.0));
    f64::sqrt(sum / count)
}

/// What the errors of each column are divided by: the standard deviation of its quantity, or 1 where all columns are
/// of one quantity, or this one does not change.
fn spreads(truth: &Table, estimate: &Table) -> Vec<f64> {
    let quantities: Vec<&str> = truth.names.iter().map(|name| columns::quantity_of(name)).collect();
    if quantities.windows(2).all(|pair| pair[0] == pair[1] && !pair[0].is_empty()) {
        return vec![1.0; quantities.len()];
    }
    let variance = |column: usize| {
        let values: Vec<f64> = pairs(&[column], truth, estimate).map(|[truth, _]| truth).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>()
            / values.len() as f64
    };
    let variances: Vec<f64> = (0..quantities.len()).map(variance).collect();
    let spread = |column: usize| {
        // A name that states no quantity stands for itself.
        let alike = |other: &usize| {
            *other == column
                || (quantities[*other] == quantities[column] && !quantities[column].is_empty())
        };
        let alike = (0..quantities.len()).filter(alike).map(|other| variances[other]);
        let (sum, count) =
            alike.filter(|v| !v.is_nan()).fold((0.0, 0.0), |(sum, n), v| (sum + v, n + 1.0));
        let spread = f64::sqrt(sum / count);
        if spread > 0.0 { spread } else { 1.0 }
    };
    (0..quantities.len()).map(spread).collect()
}
