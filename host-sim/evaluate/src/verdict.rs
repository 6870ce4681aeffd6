//! Verdict on a model in plain words: what it is worth, and what to beware of.

use serde::Serialize;
use taxel_core::rbf::Shape;
use taxel_learn::ModelBlob;
use taxel_learn::cost::Design;
use taxel_learn::decoders::{centroid, linear, mean};
use taxel_learn::outliers::Outliers;

use crate::measurements::Measurements;
use crate::metrics::{DecoderErrors, Errors, LimitSummary};
use crate::over_time::RestOverTime;

mod warning;

pub use warning::{FEW_TEST_FRAMES, FRAMES_A_WEIGHT, SLOT_BYTES, Warning};

/// Share of the mean's RMSE above which an output counts as hardly decoded.
pub const HARDLY: f64 = 0.85;

/// Share of the mean's RMSE above which nothing is gained over always predicting it.
const NO_GAIN: f64 = 0.98;

/// Ratio to the limit below which no decoder could be much better.
const AT_LIMIT: f64 = 1.1;

/// What a model is worth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// One or two sentences.
    pub sentence: String,
    /// What to beware of.
    pub warnings: Vec<Warning>,
}

impl Verdict {
    /// Verdict on the first of `decoders`, beside those of the others that are baselines, and the `limit`. It warns of
    /// outputs without a gain over these.
    ///
    /// Without the mean among `decoders` there is nothing to compare with, and the sentence tells errors alone.
    pub fn new(decoders: &[DecoderErrors], limit: &LimitSummary) -> Self {
        let Some(model) = decoders.first() else {
            return Self { sentence: String::new(), warnings: vec![] };
        };
        let others = Others::among(decoders);
        let (told, missing): (Vec<&Errors>, Vec<&Errors>) =
            model.errors.iter().partition(|group| group.rmse.is_finite());
        let (constant, told): (Vec<&Errors>, Vec<&Errors>) =
            told.into_iter().partition(|group| others.mean_is_exact(group));
        let (decoded, hardly): (Vec<&Errors>, Vec<&Errors>) = told
            .into_iter()
            .partition(|group| others.of_mean(group).is_none_or(|share| share <= HARDLY));
        let mut sentences = Vec::new();
        if !decoded.is_empty() {
            sentences.push(format!(
                "The model decodes {}{}.",
                listed(&decoded.iter().map(|group| with_error(group)).collect::<Vec<_>>()),
                others.gains(&decoded)
            ));
            sentences.extend(least_possible(&decoded, limit));
        }
        if !hardly.is_empty() {
            let shares = hardly.iter().filter_map(|group| others.of_mean(group));
            let least = shares.fold(f64::INFINITY, f64::min);
            let within = match below(least) {
                0 => "it is no better than always predicting the mean".to_owned(),
                percent => {
                    format!(
                        "its error is at best {percent} % below that of always predicting the mean"
                    )
                }
            };
            let names: Vec<&str> = hardly.iter().map(|group| group.group.as_str()).collect();
            let names = listed(&names);
            sentences.push(if decoded.is_empty() {
                format!("The model has learnt almost nothing about {names}: {within}.")
            } else {
                format!("It has learnt little about {names}: {within}.")
            });
            sentences.extend(nobody_can(&hardly));
        }
        for (groups, why) in [
            (&constant, "does not change in these frames: there is nothing to decode"),
            (&missing, "has no test frame"),
        ] {
            let names: Vec<&str> = groups.iter().map(|group| group.group.as_str()).collect();
            sentences.extend(names.iter().map(|name| format!("{name} {why}.")));
        }
        let lost = others.lost(model);
        if !lost.is_empty() {
            let with_name = |(name, it): &(&str, &Errors)| format!("{} ({name})", with_error(it));
            let better: Vec<String> = lost.iter().map(with_name).collect();
            sentences.push(format!("A simpler decoder does better: {}.", listed(&better)));
        }
        let lost: Vec<&str> = lost.iter().map(|(_, errors)| errors.group.as_str()).collect();
        let useless = model.errors.iter().filter(|group| others.is_useless(model, group));
        let useless: Vec<&str> = useless.map(|group| group.group.as_str()).collect();
        let warnings = [Warning::no_gain_over_mean(&useless), Warning::worse_than_baseline(&lost)];
        Self { sentence: sentences.join(" "), warnings: warnings.into_iter().flatten().collect() }
    }

    /// Adds what frames give reason to beware of: outliers of measured ones, and too few to judge by.
    #[must_use]
    pub fn of_frames(self, outliers: Option<&Outliers>, test_frames: usize) -> Self {
        self.with(Warning::few_test_frames(test_frames)).with(outliers.and_then(Warning::outliers))
    }

    /// Adds what measurements give reason to beware of: folds that flatter, and readings `at_rest` that drift where a
    /// model is given readings as they are.
    #[must_use]
    pub fn of_data(self, data: &Measurements, at_rest: Option<&RestOverTime>) -> Self {
        let drift = at_rest.filter(|_| !data.training.relative_inputs).and_then(Warning::drift);
        self.with(Warning::folds_flatter(data.folds_flatter)).with(drift)
    }

    /// Adds that the frames to judge by are the end of a log, and whether their baseline is `renewed` in each of its pauses.
    #[must_use]
    pub fn at_the_end_of_a_log(mut self, renewed: bool) -> Self {
        self.sentence += " These are errors at the end of the log, after all lines that the model was trained on.";
        if renewed {
            self.sentence += " The baseline was renewed in each pause; a device keeps its baseline until it captures another.";
        }
        self
    }

    /// Adds what a blob, trained on so many `frames`, gives reason to beware of: too few frames, a size
    /// beyond a slot.
    #[must_use]
    pub fn of_blob(self, blob: &ModelBlob, frames: usize) -> Self {
        let model = blob.parse();
        let of_networks = |size: fn(Shape) -> usize| {
            model.networks().map(|network| size(network.shape())).max().unwrap_or(0)
        };
        let (centres, inputs) = (of_networks(|it| it.centres), of_networks(|it| it.inputs));
        self.with(Warning::few_frames(frames, centres, inputs))
            .with(Warning::few_frames_for_confidence(frames, model.reading_model()))
            .with(Warning::larger_than_slot(blob.bytes().len(), &Design::new(blob)))
    }

    /// Adds a warning, if there is one.
    #[must_use]
    pub fn with(mut self, warning: Option<Warning>) -> Self {
        self.warnings.extend(warning);
        self
    }
}

/// Errors of the decoders that a model is compared with.
#[derive(Clone, Copy)]
struct Others<'e> {
    mean: Option<&'e DecoderErrors>,
    linear: Option<&'e DecoderErrors>,
    centroid: Option<&'e DecoderErrors>,
}

impl<'e> Others<'e> {
    fn among(decoders: &'e [DecoderErrors]) -> Self {
        let called = |name: &str| decoders.iter().skip(1).find(|decoder| decoder.decoder == name);
        let [mean, linear, centroid] = [mean::NAME, linear::NAME, centroid::NAME].map(called);
        Self { mean, linear, centroid }
    }

    /// RMSE of a group as a share of the mean's.
    fn of_mean(&self, group: &Errors) -> Option<f64> {
        share(group, self.mean)
    }

    /// Whether always predicting the mean makes no error, or one of rounding alone, which has no R²: the output does
    /// not change.
    fn mean_is_exact(&self, group: &Errors) -> bool {
        let mean = self.mean.and_then(|mean| mean.of_group(&group.group));
        mean.is_some_and(|mean| mean.rmse <= 0.0 || mean.r_squared.is_none())
    }

    /// Gains over the mean and the linear decoder, in words after the errors of `groups`.
    fn gains(&self, groups: &[&Errors]) -> String {
        let gain = |of: Option<&DecoderErrors>, name: &str| {
            let shares: Vec<f64> = groups.iter().filter_map(|group| share(group, of)).collect();
            let low = shares.iter().copied().fold(f64::INFINITY, f64::min);
            let high = shares.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if shares.is_empty() {
                return None;
            }
            let [most, least] = [low, high].map(|share| (100.0 * (1.0 - share)).round() as i32);
            Some(match (least, most) {
                (least, most) if least < 0 && most > 0 => {
                    format!("{} % above to {most} % below {name}", -least)
                }
                (least, most) if least < 0 => match (-most, -least) {
                    (least, most) if least == most => format!("{most} % above {name}"),
                    (least, most) => format!("{least} to {most} % above {name}"),
                },
                (0, 0) => format!("no better than {name}"),
                (least, most) if least == most => format!("{most} % below {name}"),
                (least, most) => format!("{least} to {most} % below {name}"),
            })
        };
        let gains = [
            gain(self.mean, "always predicting the mean"),
            gain(self.linear, "the best linear decoder"),
        ];
        let gains: Vec<String> = gains.into_iter().flatten().collect();
        if gains.is_empty() { String::new() } else { format!(": {}", gains.join(", and ")) }
    }

    /// Errors surely smaller than those of `model`, each with the name of the best baseline; none that are no better than
    /// always predicting the mean.
    fn lost(&self, model: &DecoderErrors) -> Vec<(&'e str, &'e Errors)> {
        let better = |group: &Errors| {
            let of = |other: &'e DecoderErrors| Some((other, other.of_group(&group.group)?));
            let all = [self.centroid, self.linear].into_iter().flatten().filter_map(of);
            let least = all.min_by(|(_, a), (_, b)| a.rmse.total_cmp(&b.rmse));
            let is_useful = |it: &Errors| self.of_mean(it).is_none_or(|share| share <= NO_GAIN);
            let (other, errors) = least?;
            let is_better = model.is_surely_above(&group.group, 1.0, other) && is_useful(errors);
            is_better.then_some((other.decoder.as_str(), errors))
        };
        model.errors.iter().filter_map(better).collect()
    }

    /// Whether `model` does not surely gain over always predicting the mean of this `group`.
    fn is_useless(&self, model: &DecoderErrors, group: &Errors) -> bool {
        let Some(mean) = self.mean.filter(|mean| share(group, Some(mean)).is_some()) else {
            return false;
        };
        !mean.is_surely_above(&group.group, 1.0 / NO_GAIN, model)
    }
}

/// RMSE of `group` as a share of that of the same group of an `other` decoder.
fn share(group: &Errors, other: Option<&DecoderErrors>) -> Option<f64> {
    let other = other?.of_group(&group.group)?;
    Some(group.rmse / other.rmse).filter(|share| share.is_finite())
}

/// Whole per cent that a share is below 1; 0 for one that is not.
fn below(share: f64) -> u32 {
    (100.0 * (1.0 - share)).round().max(0.0) as u32
}

/// Group with its RMSE, such as `dz_mm to 0.047 mm`.
fn with_error(group: &Errors) -> String {
    let rmse = significant(group.rmse);
    let unit = if group.unit.is_empty() { String::new() } else { format!(" {}", group.unit) };
    format!("{} to {rmse}{unit}", group.group)
}

/// Number with three significant digits.
fn significant(value: f64) -> String {
    if value == 0.0 || !(1e-4..1e6).contains(&value.abs()) {
        return format!("{value:.2e}");
    }
    let decimals = (2 - value.abs().log10().floor() as i32).max(0) as usize;
    format!("{value:.decimals$}")
}

/// Words in a row: `a`, `a and b`, `a, b and c`.
fn listed(words: &[impl AsRef<str>]) -> String {
    match words {
        [] => String::new(),
        [only] => only.as_ref().to_owned(),
        [first @ .., last] => {
            let first: Vec<&str> = first.iter().map(AsRef::as_ref).collect();
            format!("{} and {}", first.join(", "), last.as_ref())
        }
    }
}

/// How near the errors of `groups` come to the `limit`, where it is known.
fn least_possible(groups: &[&Errors], limit: &LimitSummary) -> Option<String> {
    let known = groups.iter().filter(|group| limit.groups.iter().any(|it| it.group == group.group));
    let ratios: Vec<f64> = known.filter_map(|group| group.ratio_to_limit).collect();
    let low = ratios.iter().copied().fold(f64::INFINITY, f64::min);
    let high = ratios.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    // Ratios are formed on the limit's own frames: no other error may stand beside them.
    match ratios.len() {
        0 => None,
        1 => Some(format!("That is {low:.2} times the least possible error.")),
        _ => Some(format!("That is {low:.2} to {high:.2} times the least possible error.")),
    }
}

/// Says so if no decoder could tell much more of `groups`.
fn nobody_can(groups: &[&Errors]) -> Option<String> {
    let ratios: Option<Vec<f64>> = groups.iter().map(|group| group.ratio_to_limit).collect();
    let most = ratios?.into_iter().fold(f64::NEG_INFINITY, f64::max);
    (most < AT_LIMIT).then(|| {
        let more = (100.0 * (1.0 - 1.0 / most)).ceil().max(1.0);
        format!("No decoder of these readings could be better by more than {more} %.")
    })
}

#[cfg(test)]
mod tests;
