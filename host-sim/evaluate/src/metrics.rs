//! Errors of estimates, by every definition in use. No figure stands alone: the definitions differ by
//! more than the decoders do, so all of them are always given.

use serde::{Deserialize, Serialize};
use taxel_core::blob::Model;
use taxel_data::{Dataset, Purpose, Random, Stream, Table, columns};
use taxel_learn::Decoder;
use taxel_limit::reference::GroupLimit;
use taxel_limit::{Reference, Refusal};

mod blocks;
mod definition;

pub use blocks::{Blocks, standard_error, with_blocks};
pub use definition::Definition;

/// Share of full scale that the truth must exceed to count in the mean relative error.
pub const RELATIVE_THRESHOLD: f64 = 0.1;

/// Range of true values, relative to them, that rounding explains: they do not change.
const CONSTANT: f64 = 4.0 * f64::EPSILON;

/// Standard errors by which errors must differ for one to be surely larger.
const SURE: f64 = 2.0;

/// Successive blocks that count as one for it.
const BLOCKS_AT_ONCE: usize = 5;

/// Measure for errors.
#[derive(Debug, Clone, PartialEq)]
pub struct Measure {
    /// Full scale of each output, in its unit.
    pub full_scale: Vec<f64>,
    /// Sensor thickness H in mm, for the positional error.
    pub thickness_mm: Option<f64>,
    /// Limit on the first frames that are measured, for ratios to it.
    pub limit: Option<Reference>,
    /// Standard deviation of the noise on each input, where measurements at rest tell it.
    pub noise: Option<Vec<f64>>,
}

/// Errors of one group of outputs (an axis, or a column of measured data).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Name of the group: `dz_mm`, or a column's name.
    pub group: String,
    pub unit: String,
    /// Number of pairs of truth and estimate that count.
    pub count: usize,
    /// Root mean square error √(mean e²), in the unit.
    pub rmse: f64,
    /// Relative L2 error ‖e‖/‖truth‖, in per cent.
    pub relative_l2_percent: Option<f64>,
    /// Error of full scale mean|e|/full scale, in per cent.
    pub full_scale_percent: Option<f64>,
    /// Positional error mean|e|/(H − Δz), in per cent; compression in mm only.
    pub positional_percent: Option<f64>,
    /// Coefficient of determination R²: 1 − Σe²/Σ(truth − its column's mean)².
    pub r_squared: Option<f64>,
    /// Mean relative error mean|e|/|truth| over truths above [`RELATIVE_THRESHOLD`] of full scale, in
    /// per cent.
    pub mean_relative_percent: Option<f64>,
    /// Ratio of the RMSE to the limit, formed on the frames of the [`Reference`]; scenes only.
    pub ratio_to_limit: Option<f64>,
    pub ratio_standard_error: Option<f64>,
    /// RMSE that the noise of readings at rest causes in the estimates, in the unit; measured data only.
    pub rmse_of_noise: Option<f64>,
}

#[cfg(test)]
impl Errors {
    /// Errors of ten pairs in mm, of which tests know no more.
    pub(crate) fn of(group: &str, rmse: f64, r_squared: f64) -> Self {
        Self {
            group: group.into(),
            unit: "mm".into(),
            count: 10,
            rmse,
            r_squared: Some(r_squared),
            ..Self::default()
        }
    }
}

/// Name under which all groups are judged together.
pub const ALL: &str = "all";

/// RMSE of a `group`, in its unit. Of [`ALL`] it is the mean over the groups of RMSE/standard deviation, √(1 − R²): 1 for
/// always predicting the mean of these frames. `None` for a group without errors.
pub fn rmse_of(errors: &[Errors], group: &str) -> Option<f64> {
    if group != ALL {
        return errors.iter().find(|errors| errors.group == group).map(|errors| errors.rmse);
    }
    let shares = errors.iter().filter_map(|errors| errors.r_squared);
    let shares: Vec<f64> = shares.map(|r_squared| (1.0 - r_squared).sqrt()).collect();
    (!shares.is_empty()).then(|| shares.iter().sum::<f64>() / shares.len() as f64)
}

/// Unit of the RMSE of a `group`; "σ", an output's standard deviation, for [`ALL`].
pub fn unit_of_rmse(group: &str) -> &str {
    if group == ALL { "σ" } else { columns::unit_of(group) }
}

/// Name of the trained network in results.
pub const NETWORK: &str = "network";

/// Errors of one decoder.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DecoderErrors {
    /// Name of the decoder, such as `network`, `linear` or `mean`.
    pub decoder: String,
    pub errors: Vec<Errors>,
    /// Parts of blocks of frames in the errors, which tell how sure a difference is; empty where they are not known.
    #[serde(skip)]
    pub blocks: Blocks,
}

impl DecoderErrors {
    /// Errors of the decoder of that name, without parts of blocks.
    pub fn new(decoder: &str, errors: Vec<Errors>) -> Self {
        Self { decoder: decoder.into(), errors, blocks: Blocks::new() }
    }

    /// Errors of the decoder of that name, whose `estimate` is laid out like `truth`.
    pub fn of_estimate(decoder: &str, truth: &Table, estimate: &[f64], measure: &Measure) -> Self {
        let (errors, blocks) = with_blocks(truth, estimate, measure);
        Self { decoder: decoder.into(), errors, blocks }
    }

    /// Errors in the group of that name.
    pub fn of_group(&self, group: &str) -> Option<&Errors> {
        self.errors.iter().find(|errors| errors.group == group)
    }

    /// Whether its RMSE in a `group` is above so large a `share` of that of an `other` decoder by more than chance makes on the
    /// same frames. Where blocks of these are not known, any difference counts.
    pub fn is_surely_above(&self, group: &str, share: f64, other: &Self) -> bool {
        let [Some(own), Some(others)] = [self, other].map(|it| it.of_group(group)) else {
            return false;
        };
        let [own_parts, other_parts] =
            [self, other].map(|it| it.blocks.get(group).map_or(&[][..], Vec::as_slice));
        let parts = own_parts.iter().zip(other_parts).map(|(own, other)| own - share * other);
        let parts: Vec<f64> = parts.collect();
        // Presses last over several blocks.
        let at_once = parts.chunks(BLOCKS_AT_ONCE);
        let means = at_once.map(|it| it.iter().sum::<f64>() / it.len() as f64);
        own.rmse - share * others.rmse > SURE * standard_error(means)
    }
}

/// Errors of one of the `decoders`, by its name; empty if it is not among them.
pub fn of_decoder<'d>(decoders: &'d [DecoderErrors], name: &str) -> &'d [Errors] {
    decoders.iter().find(|it| it.decoder == name).map_or(&[], |it| &it.errors)
}

/// RMSE of each of the `groups` of outputs from the RMSE of their members: the root of the mean square.
pub fn pooled(groups: &[(&str, Vec<usize>)], rmse: &[f64]) -> Vec<f64> {
    let of_group = |members: &Vec<usize>| {
        let squares: f64 = members.iter().map(|column| rmse[*column].powi(2)).sum();
        (squares / members.len() as f64).sqrt()
    };
    groups.iter().map(|(_, members)| of_group(members)).collect()
}

/// Root mean square error of one group of outputs, in its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupRmse {
    pub group: String,
    pub unit: String,
    pub rmse: f64,
}

/// RMSE of the best linear decoder by group of outputs, on frames of the model's training that it was not fitted to. Empty
/// if the model does not tell it.
pub fn linear_at_training(model: &Model<'_>) -> Vec<GroupRmse> {
    let rmse: Vec<f64> = model.linear_rmse().iter().map(f64::from).collect();
    if rmse.is_empty() {
        return vec![];
    }
    let names: Vec<String> = model.metadata().output_names.iter().map(str::to_owned).collect();
    let groups = columns::groups(&names);
    let pooled = pooled(&groups, &rmse).into_iter().zip(&groups);
    let of = |(rmse, (group, _)): (f64, &(&str, Vec<usize>))| GroupRmse {
        group: (*group).to_owned(),
        unit: columns::unit_of(group).to_owned(),
        rmse,
    };
    pooled.map(of).collect()
}

/// Limit of a scene that results are given beside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LimitSummary {
    /// Number of frames that it was computed on, and ratios to it are formed on: the first test frames.
    pub frames: usize,
    /// Limit by group of outputs; empty if it was refused.
    pub groups: Vec<GroupLimit>,
    /// Reason why there is no limit.
    pub refused: Option<String>,
}

impl LimitSummary {
    /// Summary of `limit`, or of the reason why there is none.
    pub fn new(limit: &Result<Reference, Refusal>) -> Self {
        match limit {
            Ok(limit) => Self { frames: limit.frames(), groups: limit.limits(), refused: None },
            Err(refusal) => {
                Self { frames: 0, groups: Vec::new(), refused: Some(refusal.to_string()) }
            }
        }
    }

    /// Summary in one line, for below a table of errors.
    pub fn note(&self) -> String {
        if let Some(refusal) = &self.refused {
            return format!("No ratio to the least possible error: {refusal}.");
        }
        let limits = self.groups.iter().map(|limit| {
            let [value, error] = [limit.limit, limit.limit_standard_error];
            format!("{} {value:.4} ± {error:.4} {}", limit.group, limit.unit)
        });
        let limits: Vec<String> = limits.collect();
        format!(
            "Least possible RMSE of any decoder, from {} posteriors: {}.",
            self.frames,
            limits.join(", ")
        )
    }
}

/// Errors of `decoder` on the frames of `test`.
pub fn judge(decoder: &dyn Decoder, test: &Dataset, measure: &Measure) -> DecoderErrors {
    let estimates = decoder.decode_all(&test.inputs.values, 1);
    let mut judged =
        DecoderErrors::of_estimate(decoder.name(), &test.outputs, &estimates.values, measure);
    if let Some(noise) = &measure.noise {
        for (errors, of_noise) in
            judged.errors.iter_mut().zip(rmse_of_noise(decoder, test, noise, measure))
        {
            errors.rmse_of_noise = Some(of_noise).filter(|it| it.is_finite());
        }
    }
    judged
}

/// RMSE of each group of outputs that normal `noise` of these standard deviations on the inputs of `test` makes of the
/// decoder's estimates: from half the difference between estimates with the noise added and taken off, so that what the decoder is
/// bent does not count.
fn rmse_of_noise(
    decoder: &dyn Decoder,
    test: &Dataset,
    noise: &[f64],
    measure: &Measure,
) -> Vec<f64> {
    let mut random = Random::new(1, Stream::Test, Purpose::Noise, 0, 0);
    let deviations = noise.iter().cycle();
    let drawn = test.inputs.values.iter().zip(deviations);
    let drawn: Vec<f64> = drawn.map(|(_, deviation)| deviation * random.normal()).collect();
    let with = |sign: f64| {
        let inputs = test.inputs.values.iter().zip(&drawn).map(|(input, it)| input + sign * it);
        decoder.decode_all(&inputs.collect::<Vec<_>>(), 1).values
    };
    let below = Table { names: test.outputs.names.clone(), values: with(-1.0).into() };
    let errors = by_group(&below, &with(1.0), measure);
    errors.iter().map(|errors| 0.5 * errors.rmse).collect()
}

/// Errors of every group of columns, in the order in which groups first appear.
///
/// `estimate` is laid out like `truth`, `lines × columns`. Pairs with a missing value (NaN) on either
/// side do not count.
///
/// # Panics
/// If `estimate` is not as long as `truth`, or `measure` does not have one full scale a column.
pub fn by_group(truth: &Table, estimate: &[f64], measure: &Measure) -> Vec<Errors> {
    let estimate = &truth.with_places(estimate);
    columns::groups(&truth.names)
        .iter()
        .map(|(group, members)| of_columns(group, members, truth, estimate, measure))
        .collect()
}

#[derive(Default)]
struct Sums {
    count: usize,
    error_squares: f64,
    truth: f64,
    truth_squares: f64,
    full_scale: f64,
    positional: f64,
    relative: f64,
    relative_count: usize,
}

fn of_columns(
    group: &str,
    members: &[usize],
    truth: &Table,
    estimate: &[f64],
    measure: &Measure,
) -> Errors {
    assert_eq!(truth.values.len(), estimate.len(), "an estimate for every truth");
    assert_eq!(measure.full_scale.len(), truth.names.len(), "a full scale for every column");
    let thickness_mm = measure.thickness_mm.filter(|_| columns::is_compression(group));
    let mut total = Sums::default();
    let mut deviation_squares = 0.0; // Σ(truth − its column's mean)²
    for &column in members {
        let full_scale = measure.full_scale[column];
        let mut sums = Sums::default();
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for (truth, estimate) in truth.lines().zip(estimate.chunks_exact(truth.names.len())) {
            let (truth, error) = (truth[column], estimate[column] - truth[column]);
            if error.is_nan() {
                continue;
            }
            (low, high) = (low.min(truth), high.max(truth));
            sums.count += 1;
            sums.error_squares += error * error;
            sums.truth += truth;
            sums.truth_squares += truth * truth;
            sums.full_scale += error.abs() / full_scale;
            if let Some(thickness_mm) = thickness_mm {
                sums.positional += error.abs() / (thickness_mm - truth);
            }
            if truth.abs() > RELATIVE_THRESHOLD * full_scale {
                sums.relative += error.abs() / truth.abs();
                sums.relative_count += 1;
            }
        }
        // A second pass: Σtruth² − n·mean² would cancel for outputs with an offset.
        let mean = sums.truth / sums.count as f64;
        // What rounding alone makes of equal values is no variance that could be explained.
        let changes = high - low > CONSTANT * low.abs().max(high.abs());
        for (truth, estimate) in truth.lines().zip(estimate.chunks_exact(truth.names.len())) {
            if changes && !(estimate[column] - truth[column]).is_nan() {
                deviation_squares += (truth[column] - mean) * (truth[column] - mean);
            }
        }
        total.count += sums.count;
        total.error_squares += sums.error_squares;
        total.truth_squares += sums.truth_squares;
        total.full_scale += sums.full_scale;
        total.positional += sums.positional;
        total.relative += sums.relative;
        total.relative_count += sums.relative_count;
    }
    let ratio = measure.limit.as_ref().and_then(|limit| limit.ratio(truth, estimate, members));
    let count = total.count as f64;
    let finite = |value: f64| value.is_finite().then_some(value);
    Errors {
        group: group.into(),
        unit: columns::unit_of(group).into(),
        count: total.count,
        rmse: (total.error_squares / count).sqrt(),
        relative_l2_percent: finite(100.0 * (total.error_squares / total.truth_squares).sqrt()),
        full_scale_percent: finite(100.0 * total.full_scale / count),
        positional_percent: thickness_mm.and_then(|_| finite(100.0 * total.positional / count)),
        r_squared: finite(1.0 - total.error_squares / deviation_squares),
        mean_relative_percent: finite(100.0 * total.relative / total.relative_count as f64),
        ratio_to_limit: ratio.map(|ratio| ratio.ratio),
        ratio_standard_error: ratio.map(|ratio| ratio.standard_error),
        rmse_of_noise: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_all_groups_is_the_mean_share_of_the_deviation() {
        // Deviations of 10 mm and 2 N.
        let errors = [Errors::of("x_mm", 5.0, 0.75), Errors::of("force_n", 0.4, 0.96)];
        assert!((rmse_of(&errors, ALL).unwrap() - 0.35).abs() < 1e-12);
        assert_eq!(rmse_of(&errors, "x_mm"), Some(5.0));
        assert_eq!((rmse_of(&errors, "y_mm"), rmse_of(&[], ALL)), (None, None));
        assert_eq!([ALL, "x_mm"].map(unit_of_rmse), ["σ", "mm"]);
    }

    #[test]
    fn a_share_of_an_error_is_compared_as_surely_as_the_error() {
        let of = |rmse: f64| {
            let parts = (0..50).map(|block| rmse * f64::from(block / 5 % 3)).collect();
            let blocks = [("f_n".to_owned(), parts)].into();
            DecoderErrors { blocks, ..DecoderErrors::new("of", vec![Errors::of("f_n", rmse, 0.0)]) }
        };
        // Blocks are alike but for their size, so that half the error is half of it in each.
        let above = |share| of(0.51).is_surely_above("f_n", share, &of(1.0));
        assert_eq!([0.5, 0.52].map(above), [true, false]);
    }

    #[test]
    fn every_definition_by_hand() {
        let truth = Table {
            names: ["r1e1_dz_mm", "r1e1_dx_mm", "r1e2_dz_mm"].map(String::from).to_vec(),
            values: vec![0.05, 1.0, 1.0, 2.0, -1.0, 0.5].into(),
        };
        // Errors of both signs: +0.5 and −0.25 of three.
        let estimate = [0.55, 1.0, 1.0, 1.75, -1.0, f64::NAN];
        let squares: f64 = 0.25 + 0.0625;
        let measure = Measure {
            full_scale: vec![4.0, 1.0, 2.0],
            thickness_mm: Some(5.0),
            limit: None,
            noise: None,
        };
        let [z, x] = &by_group(&truth, &estimate, &measure)[..] else { panic!("two groups") };
        assert_eq!((z.group.as_str(), z.count, z.unit.as_str()), ("dz_mm", 3, "mm"));
        let close = |a: Option<f64>, b: f64| assert!((a.unwrap() - b).abs() < 1e-12, "{a:?} {b}");
        close(Some(z.rmse), (squares / 3.0).sqrt());
        close(z.relative_l2_percent, 100.0 * (squares / 5.0025).sqrt());
        close(z.full_scale_percent, 75.0 / 4.0 / 3.0);
        close(z.positional_percent, 100.0 * (0.5 / 4.95 + 0.25 / 3.0) / 3.0);
        close(z.r_squared, 1.0 - squares / 1.90125); // means are 1.025 and 1
        close(z.mean_relative_percent, 6.25); // the truth 0.05 is too small for one
        assert_eq!((x.rmse, x.positional_percent), (0.0, None));
    }

    #[test]
    fn noise_on_inputs_makes_the_errors_that_slopes_tell() {
        let mut random = Random::new(5, Stream::Training, Purpose::Setup, 0, 0);
        let names = |all: &[&str]| all.iter().map(|name| (*name).to_owned()).collect();
        let mut data = Dataset::empty(names(&["a", "b"]), names(&["y_mm", "x_mm"]), 1, 4000);
        data.inputs.values.iter_mut().for_each(|it| *it = random.unit());
        let lines: Vec<f64> =
            data.inputs.lines().flat_map(|it| [3.0 * it[0] - 4.0 * it[1], it[0]]).collect();
        data.outputs.values.copy_from_slice(&lines);
        let linear = taxel_learn::decoders::LINEAR.fit(&data).unwrap();
        let measure = Measure {
            full_scale: vec![1.0; 2],
            thickness_mm: None,
            limit: None,
            noise: Some(vec![0.01, 0.02]),
        };
        let [y, x] = &judge(linear.as_ref(), &data, &measure).errors[..] else {
            panic!("two groups")
        };
        // √(0.03² + 0.08²), but for a standard error of 1/√8000.
        assert!((y.rmse_of_noise.unwrap() / 0.0073_f64.sqrt() - 1.0).abs() < 0.05, "{y:?}");
        assert!((x.rmse_of_noise.unwrap() / 0.01 - 1.0).abs() < 0.05 && x.rmse < 1e-6, "{x:?}");
        let without = Measure { noise: None, ..measure };
        assert_eq!(judge(linear.as_ref(), &data, &without).errors[0].rmse_of_noise, None);
    }

    #[test]
    fn errors_of_a_group_are_pooled_by_the_mean_square() {
        let pooled = pooled(&[("dz_mm", vec![0, 2]), ("dx_mm", vec![1])], &[3.0, 5.0, 4.0]);
        assert_eq!(pooled, [12.5_f64.sqrt(), 5.0]);
    }

    #[test]
    fn values_that_differ_only_by_rounding_have_no_r_squared() {
        for values in [vec![0.1; 300], vec![0.1, 0.1_f64.next_up(), 0.1]] {
            let estimate: Vec<f64> = values.iter().map(|value| value + 0.01).collect();
            let truth = Table { names: vec!["b".into()], values: values.into() };
            let measure =
                Measure { full_scale: vec![1.0], thickness_mm: None, limit: None, noise: None };
            assert_eq!(by_group(&truth, &estimate, &measure)[0].r_squared, None);
            assert_eq!(
                by_group(&truth, &truth.means().repeat(truth.len()), &measure)[0].r_squared,
                None
            );
        }
    }

    #[test]
    fn the_mean_explains_nothing_whatever_the_offset() {
        for offset in [0.0, 1e3, 1e6, 1e9] {
            let values: Vec<f64> = (0..1000).map(|i| offset + f64::from(i % 37)).collect();
            let truth = Table { names: vec!["b".into()], values: values.into() };
            let means = truth.means().repeat(truth.len());
            let measure =
                Measure { full_scale: vec![1.0], thickness_mm: None, limit: None, noise: None };
            let r_squared = by_group(&truth, &means, &measure)[0].r_squared.unwrap();
            assert!(r_squared.abs() < 1e-9, "offset {offset}: {r_squared}");
        }
    }
}
