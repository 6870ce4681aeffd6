//! Limit of a scene's test frames, and the ratio of any decoder's error to it.

use serde::{Deserialize, Serialize};
use taxel_data::{Progress, Stream, Table, columns};
use taxel_simulate::outputs::Outputs;
use taxel_simulate::timetable::Timetable;
use taxel_simulate::{Synthesis, World};

use crate::error::Refusal;
use crate::limit::{Limit, Posterior};
use crate::moving;

/// Least effective sample size of a posterior that counts as sampled: of a still frame, and of a contact that moves.
const LEAST_EFFECTIVE: f64 = 100.0;
const LEAST_OF_MOVING: f64 = 10.0;
/// Largest share of the posterior means' squared error that may be their own Monte Carlo error. It is subtracted;
/// a share this large would move the RMSE by 1.5 %.
const MOST_MONTE_CARLO: f64 = 0.03;
/// Largest difference, in standard errors, between the squared errors and the posteriors' own variances.
const MOST_STANDARD_ERRORS: f64 = 4.0;

/// Frames from which the prior's variance is computed.
const PRIOR_FRAMES: usize = 8192;

/// Posteriors of the first test frames of a world, which any decoder of these frames can be compared with.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// True outputs of the frames.
    pub truth: Table,
    /// Posterior of each frame.
    pub posteriors: Vec<Posterior>,
    /// Variance of each output in the prior.
    pub prior_variance: Vec<f64>,
    /// Number of posteriors of a frame that were sampled apart: those of independent rows.
    pub apart: usize,
}

/// Limit of one group of outputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GroupLimit {
    /// Name of the group, such as `dz_mm`.
    pub group: String,
    /// Unit of the errors.
    pub unit: String,
    /// Limit: the root of the posteriors' mean variance, which is the expected RMSE of the posterior mean.
    pub limit: f64,
    /// Standard error of the limit, from the spread between frames.
    pub limit_standard_error: f64,
    /// RMSE of the posterior means on the frames, without their Monte Carlo error.
    pub rmse: f64,
    /// Standard error of that RMSE, from the spread between frames.
    pub rmse_standard_error: f64,
    /// RMSE of always predicting the prior's mean.
    pub prior_rmse: f64,
    /// Share of the posterior means' squared error that is their own Monte Carlo error.
    pub monte_carlo_share: f64,
}

/// Ratio of a decoder's RMSE to the limit, on the same frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ratio {
    /// Ratio √(1 + mean (estimate − posterior mean)² / mean posterior variance).
    pub ratio: f64,
    /// Standard error of the ratio, from the spread between frames.
    pub standard_error: f64,
}

/// Effective sample sizes of all posteriors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectiveSamples {
    /// Smallest one.
    pub least: f64,
    /// Median.
    pub median: f64,
}

impl Reference {
    /// Number of test frames that suffice beside other results: for a standard error of some per cent, in seconds.
    ///
    /// Rows that move independently are posteriors of their own, with three unknowns an electrode. They take longer
    /// and differ less, so there are fewer.
    pub fn few_frames(world: &World) -> usize {
        if world.motion.has_independent_rows() {
            40_usize.div_ceil(world.read_rows.len())
        } else {
            200
        }
    }

    /// Samples the posteriors of the first `frames` test frames of `world` at its noise.
    ///
    /// # Errors
    /// [`Refusal`] for a world that is not modelled, or if the sample does not carry the figures.
    pub fn new(world: &World, frames: usize, progress: &dyn Progress) -> Result<Self, Refusal> {
        let limit = Limit::new(world)?;
        let frames = Synthesis::new(world).frames(Stream::Test, frames);
        let posteriors = limit.posteriors(&frames.inputs.values, progress);
        let apart = if world.motion.has_independent_rows() { world.read_rows.len() } else { 1 };
        let drawn = Synthesis::new(world).ideal().frames(Stream::Span, PRIOR_FRAMES).outputs;
        let squares = drawn.squared_errors(&drawn.means().repeat(PRIOR_FRAMES));
        let prior_variance = squares.iter().map(|sum| sum / PRIOR_FRAMES as f64).collect();
        let reference = Self { truth: frames.outputs, posteriors, prior_variance, apart };
        reference.check(LEAST_EFFECTIVE)?;
        Ok(reference)
    }

    /// Samples the posteriors of a world whose contacts move: at each of `moments_s` that of a trajectory of its own, given
    /// those of its scans by the `timetable` that are finished by then, `finished_s` after they start. The posterior mean
    /// itself takes no time.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    ///
    /// # Panics
    /// If no scan is finished at some moment.
    pub fn moving(
        world: &World,
        scans: (&Timetable, f64),
        moments_s: &[f64],
    ) -> Result<Self, Refusal> {
        let refused = [
            (world.motion.latents(0) == 0, "a mix of contacts"),
            (matches!(world.outputs, Outputs::Contact(_)), "an output of the contact itself"),
            (world.noise.is_none(), "a sensor without noise"),
            (world.noise.correlated_level > 0.0, "noise with a memory"),
            (world.rubber.at_rest(0).is_some(), "rubber with a memory"),
            (world.drift.is_some(), "a drift of the gain"),
        ];
        if let Some((_, what)) = refused.into_iter().find(|(is_there, _)| *is_there) {
            return Err(Refusal::MovingWith(what));
        }
        let path = world.path.as_ref().ok_or(Refusal::MovingWith("one that does not"))?;
        let (values, posteriors) = moving::posteriors((world, path), scans, moments_s);
        let truth = Table { names: world.output_names(), values };
        let squares = truth.squared_errors(&truth.means().repeat(moments_s.len()));
        let prior_variance = squares.iter().map(|sum| sum / moments_s.len() as f64).collect();
        let reference = Self { truth, posteriors, prior_variance, apart: 1 };
        reference.check(LEAST_OF_MOVING)?;
        Ok(reference)
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.posteriors.len()
    }

    /// Reference for `count` of the outputs, from number `first` on.
    ///
    /// # Panics
    /// If there are fewer.
    #[must_use]
    pub fn columns(&self, first: usize, count: usize) -> Self {
        let cut = |values: &[f64]| values[first..first + count].to_vec();
        let cut = |posterior: &Posterior| Posterior {
            mean: cut(&posterior.mean),
            variance: cut(&posterior.variance),
            fourth: cut(&posterior.fourth),
            effective: cut(&posterior.effective),
        };
        Self {
            truth: self.truth.columns(first, count),
            posteriors: self.posteriors.iter().map(cut).collect(),
            prior_variance: self.prior_variance[first..first + count].to_vec(),
            apart: 1,
        }
    }

    /// Limit of every group of outputs, in the order in which groups first appear.
    pub fn limits(&self) -> Vec<GroupLimit> {
        let groups = columns::groups(&self.truth.names);
        groups.iter().map(|(group, members)| self.limit(group, members)).collect()
    }

    fn limit(&self, group: &str, members: &[usize]) -> GroupLimit {
        let variances = self.means(members, |_, i, p| p.variance[i]);
        let own = self.means(members, |_, i, p| p.variance[i] / p.effective[i]);
        let errors = self.means(members, |truth, i, p| {
            (p.mean[i] - truth[i]).powi(2) - p.variance[i] / p.effective[i]
        });
        let prior: Vec<f64> = members.iter().map(|i| self.prior_variance[*i]).collect();
        let ((limit, limit_standard_error), (rmse, rmse_standard_error)) =
            (root(&variances), root(&errors));
        GroupLimit {
            group: group.into(),
            unit: columns::unit_of(group).into(),
            limit,
            limit_standard_error,
            rmse,
            rmse_standard_error,
            prior_rmse: mean(&prior).sqrt(),
            monte_carlo_share: mean(&own) / (mean(&own) + mean(&variances)),
        }
    }

    /// Mean of `of`(truth, output, posterior) over the outputs `members`, for each frame.
    fn means(&self, members: &[usize], of: impl Fn(&[f64], usize, &Posterior) -> f64) -> Vec<f64> {
        let frames = self.truth.lines().zip(&self.posteriors);
        let of_frame = |(truth, posterior): (&[f64], &Posterior)| {
            members.iter().map(|i| of(truth, *i, posterior)).sum::<f64>() / members.len() as f64
        };
        frames.map(of_frame).collect()
    }

    /// Ratio of a decoder's RMSE to the limit over the outputs `members`, from its `estimates` of the same frames and
    /// any that follow. `None` if these are other frames, if an estimate is missing, or without any variance.
    ///
    /// The posterior mean m is uncorrelated with what any decoder d of the same readings makes of them beyond it, so
    /// E(d − Δ)² = E(d − m)² + E(m − Δ)². The ratio is formed from these two parts: both are known much more exactly
    /// than the error of a few hundred frames. The Monte Carlo error of m is subtracted.
    pub fn ratio(&self, truth: &Table, estimates: &[f64], members: &[usize]) -> Option<Ratio> {
        let width = self.truth.names.len();
        let known = self.truth.values.len();
        let is_same = truth.names == self.truth.names
            && truth.values.get(..known) == Some(&self.truth.values[..])
            && estimates.len() >= known;
        if !is_same {
            return None;
        }
        let variances = self.means(members, |_, i, p| p.variance[i]);
        let lines = estimates.chunks_exact(width).zip(&self.posteriors);
        let beyond = lines.map(|(estimate, p)| {
            let square =
                |i: &usize| (estimate[*i] - p.mean[*i]).powi(2) - p.variance[*i] / p.effective[*i];
            members.iter().map(square).sum::<f64>() / members.len() as f64
        });
        let beyond: Vec<f64> = beyond.collect();
        let share = mean(&beyond) / mean(&variances);
        let off = beyond.iter().zip(&variances).map(|(b, v)| (b - share * v).powi(2));
        let frames = self.frames() as f64;
        let error = (off.sum::<f64>() / (frames - 1.0) / frames).sqrt() / mean(&variances);
        let ratio = (1.0 + share.max(0.0)).sqrt();
        let found = Ratio { ratio, standard_error: 0.5 * error / ratio };
        (found.ratio.is_finite() && found.standard_error.is_finite()).then_some(found)
    }

    /// Effective sample sizes of the posteriors.
    pub fn effective(&self) -> EffectiveSamples {
        let sorted = self.sorted_effective();
        let at = |share: usize| sorted.get(sorted.len() * share / 100).copied().unwrap_or(0.0);
        EffectiveSamples { least: at(0), median: at(50) }
    }

    fn sorted_effective(&self) -> Vec<f64> {
        let of_frame = |posterior: &Posterior| {
            let of_group = (posterior.effective.len() / self.apart).max(1);
            posterior.effective.iter().step_by(of_group).copied().collect::<Vec<f64>>()
        };
        let mut sizes: Vec<f64> = self.posteriors.iter().flat_map(of_frame).collect();
        sizes.sort_by(f64::total_cmp);
        sizes
    }

    /// Checks that the sample carries the figures, with at least so many effective samples in each posterior.
    ///
    /// # Errors
    /// [`Refusal`] if it does not.
    pub fn check(&self, least: f64) -> Result<(), Refusal> {
        let is_thin = |posterior: &Posterior| {
            posterior.effective.iter().any(|size| size.is_nan() || *size < least)
        };
        let numbered = self.posteriors.iter().zip(1..);
        let frames: Vec<usize> = numbered
            .filter(|(posterior, _)| is_thin(posterior))
            .map(|(_, number)| number)
            .collect();
        if !frames.is_empty() {
            return Err(Refusal::Thin { frames, of: self.frames(), least });
        }
        for (group, members) in columns::groups(&self.truth.names) {
            let limit = self.limit(group, &members);
            if limit.monte_carlo_share > MOST_MONTE_CARLO {
                let share_percent = 100.0 * limit.monte_carlo_share;
                return Err(Refusal::MonteCarlo { group: group.into(), share_percent });
            }
            // E(m − Δ)² is the mean variance: if not, a part of some posteriors was not found.
            let differences = self.means(&members, |truth, i, p| {
                (p.mean[i] - truth[i]).powi(2) - p.variance[i] * (1.0 + 1.0 / p.effective[i])
            });
            // Frames may all lie outside of the tails that the posteriors know of: these say how far errors scatter.
            let known = self.means(&members, |_, i, p| p.fourth[i] - p.variance[i].powi(2));
            let seen = self.means(&members, |truth, i, p| {
                ((p.mean[i] - truth[i]).powi(2) - p.variance[i]).powi(2)
            });
            let tails = (mean(&known) / mean(&seen)).max(1.0).sqrt();
            let standard_errors = mean(&differences).abs() / (tails * standard_error(&differences));
            if standard_errors > MOST_STANDARD_ERRORS {
                return Err(Refusal::Inconsistent { group: group.into(), standard_errors });
            }
        }
        Ok(())
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Standard error of the mean of `values`; NaN where there are not two.
pub fn standard_error(values: &[f64]) -> f64 {
    let (mean, count) = (mean(values), values.len() as f64);
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / (count - 1.0) / count).sqrt()
}

/// Root of the mean of `squares`, and its standard error.
fn root(squares: &[f64]) -> (f64, f64) {
    let root = mean(squares).max(0.0).sqrt();
    (root, 0.5 * standard_error(squares) / root)
}
