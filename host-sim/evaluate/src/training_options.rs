//! Options of training: of commands, of the `[training]` of a scene, and of a plan.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{ArgAction, Args};
use serde::{Deserialize, Serialize};
use taxel_core::rbf::Format;
use taxel_data::BadValue;
use taxel_learn::Options;
use taxel_learn::reading_model::Extent;
use taxel_learn::train::{Features, Kinds, Solver};

/// Way to train a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// As accurate as it can be: centres and projection are refined, and networks have an affine tail.
    Best,
    /// As the paper has it ([`Options::as_in_paper`]): nothing is refined.
    Paper,
}

/// How a model is trained.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Training {
    pub options: Options,
    /// Whether centres, widths and the projection are refined after K-means.
    pub refine: bool,
    /// Whether inputs are readings relative to the baseline (R/R₀), and not readings as they are.
    pub relative_inputs: bool,
    /// What the model's statistics of readings tell: missing readings, and how novel a frame is and how far off outputs.
    pub reading_model: Option<Extent>,
    /// Whether the model has a tracker of a contact.
    pub track: bool,
}

impl Training {
    /// Whether training takes folds of its frames.
    pub fn takes_folds(&self) -> bool {
        self.refine || self.reading_model == Some(Extent::Full)
    }
}

impl Default for Training {
    fn default() -> Self {
        let options = Options::default();
        Self { options, refine: true, relative_inputs: false, reading_model: None, track: false }
    }
}

/// Options of training. What is not given is as a scene has it, or as is usual.
#[derive(Debug, Clone, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[command(next_help_heading = "Training")]
pub struct TrainingOptions {
    /// Frames to synthesise from a scene, instead of the scene's number.
    #[arg(short = 'n', long, value_name = "N")]
    pub frames: Option<usize>,
    /// Number of a scene's frames to judge by.
    #[clap(skip)]
    pub test_frames: Option<usize>,
    /// Number of centres K; candidates with `train --select`, and in trade and compare [default: the scene's, or 64;
    /// for trade 16,32,64,128,256, or those of them below the number of training frames of a CSV file].
    #[arg(long, value_name = "K", value_delimiter = ',')]
    #[serde(default, with = "one_or_more")]
    pub centres: Option<Vec<usize>>,
    /// Width σ of the Gaussians on scaled inputs, where refinement starts; candidates with `train --select` [default: the
    /// scene's, or 0.4; 0.8 for the readings of a row].
    #[arg(long, value_name = "S", value_delimiter = ',')]
    #[serde(default, with = "one_or_more")]
    pub spread: Option<Vec<f64>>,
    /// Ridge penalty on squared weights, per frame: 1 is as strong as an input that is always 1. A larger penalty
    /// generalises better from few or noisy frames, or to another day. Candidates with `train --select` [default: 1e-6 for
    /// all frames together, or 1e-7 per frame if refined].
    #[arg(long, value_name = "P", value_delimiter = ',')]
    #[serde(default, with = "one_or_more")]
    pub penalty: Option<Vec<f64>>,
    /// Train as the paper does: a network for each row in f32 without an affine tail, centres from K-means, weights
    /// from recursive least squares, and no refinement.
    #[arg(long = "paper", action = ArgAction::Set, num_args = 0, default_missing_value = "paper", value_parser = method())]
    pub method: Option<Method>,
    /// Train a network for each row, instead of one for all rows behind a projection of all readings. It is less accurate,
    /// but one missing reading costs only its row.
    #[arg(long, action = ArgAction::Set, num_args = 0, default_missing_value = "true")]
    pub each_row: Option<bool>,
    /// Number of features that all readings are projected to: fewer than the readings, and at most the number of outputs
    /// and of products of two or three outputs [default: the number of readings of a row, at most 18; 18 for outputs that
    /// belong to no row, or none of few readings].
    #[arg(long, value_name = "F")]
    pub features: Option<usize>,
    /// Kind of features: `plain` uses readings as they are; `normalised` separates the shape of a touch from its
    /// strength, and uses changes of a reading above 3 of its standard deviations at rest (normalised:K: above K)
    /// [default: the kind with the smaller error on held-out frames, for positions and for amounts].
    #[arg(long, value_name = "KIND", conflicts_with_all = ["method", "each_row"])]
    pub features_kind: Option<Features>,
    /// Number format of the weights [default: the scene's, or fixed16, or f32 if the model does not fit fixed16].
    #[arg(long, value_name = "FORMAT", value_parser = format())]
    #[serde(default, with = "format_by_name")]
    pub format: Option<Format>,
    /// How output weights are computed. Both ways give the same estimates [default: the scene's, or qr].
    #[arg(long, value_name = "SOLVER", value_parser = solver())]
    pub solver: Option<Solver>,
    /// Keep the centres of K-means, as the paper does. Otherwise centres, widths and the projection are refined by gradient
    /// descent: more accurate at the same cost on the device, and slower to train (docs/training.md).
    #[arg(long = "no-refine", action = ArgAction::Set, num_args = 0, default_missing_value = "false")]
    pub refine: Option<bool>,
    /// Train on readings relative to the baseline, R/R₀, which a drift of the gain does not change
    /// (docs/drift.md).
    #[arg(long, action = ArgAction::Set, num_args = 0, default_missing_value = "true")]
    pub relative_inputs: Option<bool>,
    /// Add statistics of the readings to the model (docs/reading-model.md). With fill, it estimates missing readings from
    /// the others of their frame, so that a broken wire costs accuracy, but no frames. With full, it also estimates how
    /// far off each output may be, and how novel a frame is. On a CSV file, full trains once more for every fold: give
    /// folds of whole places or days (--fold-column), because frames of the same place or day resemble each other.
    /// Estimates of whole frames stay the same. For 144 readings, fill takes 7 kB, and full 27 kB. Both need ten training
    /// frames for each reading.
    #[arg(long, value_name = "EXTENT", value_parser = extent())]
    pub reading_model: Option<Extent>,
    /// Add a tracker of one moving contact to the model (docs/rate.md): the deformations are then those of a contact
    /// that fits the readings of all frames so far. Only for scenes of one contact; it takes 12 kB for 8 × 18 wires.
    #[arg(long, action = ArgAction::Set, num_args = 0, default_missing_value = "true")]
    pub track: Option<bool>,
}

impl TrainingOptions {
    /// These options over `usual` ones. A spread that is not given follows where rows get networks of their own, or one
    /// for all.
    ///
    /// # Errors
    /// [`BadValue`] for several values where one is trained with, and for what the paper's method does not do.
    pub fn over(&self, usual: &Training) -> Result<Training, BadValue> {
        let Training { mut options, mut refine, .. } = *usual;
        let is_paper = self.method == Some(Method::Paper);
        if is_paper {
            self.check_beside_paper()?;
            options = options.as_in_paper();
            refine = false;
        }
        let of_features = self.features.map(|_| false);
        if let Some(each_row) = self.each_row.or(of_features).filter(|_| !is_paper) {
            options = options.for_each_row(each_row);
        }
        options.centres =
            one("training.centres", self.centres.as_deref())?.unwrap_or(options.centres);
        options.spread = one("training.spread", self.spread.as_deref())?.unwrap_or(options.spread);
        options.penalty = one("training.penalty", self.penalty.as_deref())?.or(options.penalty);
        options.features = self.features.or(options.features);
        options.kinds = self.features_kind.map(Kinds::all).or(options.kinds);
        options.solver = self.solver.unwrap_or(options.solver);
        if let Some(format) = self.format {
            (options.format, options.or_f32) = (format, false);
        }
        Ok(Training {
            options,
            refine: self.refine.unwrap_or(refine) && !is_paper,
            relative_inputs: self.relative_inputs.unwrap_or(usual.relative_inputs),
            reading_model: self.reading_model.or(usual.reading_model),
            track: self.track.unwrap_or(usual.track),
        })
    }

    /// Checks that nothing is asked for which the paper's method does not do.
    fn check_beside_paper(&self) -> Result<(), BadValue> {
        let kind = self.features_kind.as_ref().map(ToString::to_string);
        let others = [
            ("features", self.features.map(|it| it.to_string()), "have no features"),
            ("features_kind", kind, "have no features"),
            (
                "each_row",
                self.each_row.filter(|it| !it).map(|it| it.to_string()),
                "are for each row",
            ),
            ("refine", self.refine.filter(|it| *it).map(|it| it.to_string()), "are not refined"),
        ];
        let given = others.into_iter().find_map(|(field, value, why)| Some((field, value?, why)));
        let Some((field, value, why)) = given else { return Ok(()) };
        let rule = format!(
            "networks as the paper trains them (method = \"paper\", --paper) {why}; leave one of them out"
        );
        Err(BadValue::new(format!("training.{field}"), value, rule))
    }
}

/// The one value of a field, if it was given.
fn one<T: Copy + std::fmt::Debug>(field: &str, given: Option<&[T]>) -> Result<Option<T>, BadValue> {
    match given.unwrap_or_default() {
        [] => Ok(None),
        [value] => Ok(Some(*value)),
        several => {
            let rule = "give one value, or `train` with --select";
            Err(BadValue::new(field, format!("{several:?}"), rule))
        }
    }
}

/// Parser that takes names of values.
fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    values: [(PossibleValue, T); N],
) -> impl TypedValueParser<Value = T> {
    let names: Vec<PossibleValue> = values.iter().map(|(name, _)| name.clone()).collect();
    PossibleValuesParser::new(names).map(move |found| {
        let mut values = values.iter();
        let value = values.find(|(name, _)| name.get_name() == found);
        value.expect("one of the possible values").1
    })
}

fn format() -> impl TypedValueParser<Value = Format> {
    let named = |format: Format| PossibleValue::new(format.name()).help(format.description());
    one_of(Format::ALL.map(|format| (named(format), format)))
}

fn solver() -> impl TypedValueParser<Value = Solver> {
    let named = |solver: Solver| PossibleValue::new(solver.name()).help(solver.description());
    one_of(Solver::ALL.map(|solver| (named(solver), solver)))
}

fn extent() -> impl TypedValueParser<Value = Extent> {
    one_of(Extent::ALL.map(|extent| (PossibleValue::new(extent.name()), extent)))
}

fn method() -> impl TypedValueParser<Value = Method> {
    one_of([(PossibleValue::new("paper"), Method::Paper)])
}

/// One value, or a list of candidates; files hold one value.
mod one_or_more {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[expect(clippy::ref_option, reason = "serde passes a field")]
    pub fn serialize<T: Serialize, S: Serializer>(
        values: &Option<Vec<T>>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        match values.as_deref() {
            Some([value]) => serializer.serialize_some(value),
            values => values.serialize(serializer),
        }
    }

    pub fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<Vec<T>>, D::Error> {
        T::deserialize(deserializer).map(|value| Some(vec![value]))
    }
}

/// Number format by its name.
mod format_by_name {
    use serde::de::{Deserialize, Deserializer, Error};
    use serde::ser::{Serialize, Serializer};
    use taxel_core::rbf::Format;

    #[expect(
        clippy::ref_option,
        clippy::trivially_copy_pass_by_ref,
        reason = "serde passes a field"
    )]
    pub fn serialize<S: Serializer>(
        format: &Option<Format>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        format.map(Format::name).serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<Format>, D::Error> {
        let name = String::deserialize(deserializer)?;
        Format::from_name(&name).map(Some).ok_or_else(|| {
            let known = Format::ALL.map(|format| format!("`{}`", format.name()));
            D::Error::custom(format!("unknown format `{name}`, expected {}", known.join(", ")))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Command, FromArgMatches};

    fn of_words(words: &str) -> TrainingOptions {
        let command = TrainingOptions::augment_args(Command::new("train"));
        let words = ["train"].into_iter().chain(words.split_whitespace());
        TrainingOptions::from_arg_matches(&command.get_matches_from(words)).unwrap()
    }

    #[test]
    fn a_file_says_the_same_as_a_command_line() {
        let words = "-n 90 --centres 8 --spread 0.5 --penalty 1e-5 --features 6 --features-kind normalised:2 --format f32 \
                     --solver rls --no-refine --relative-inputs --reading-model full";
        for words in [words, "--paper", "--each-row", ""] {
            let given = of_words(words);
            let file = toml::to_string(&given).unwrap();
            assert_eq!(toml::from_str::<TrainingOptions>(&file).unwrap(), given, "{file}");
        }
        let several = of_words("--centres 4,8");
        assert_eq!(toml::to_string(&several).unwrap(), "centres = [4, 8]\n");
        let refused = several.over(&Training::default()).unwrap_err().to_string();
        assert!(refused.starts_with("training.centres = [4, 8]: give one value"), "{refused}");
    }

    #[test]
    fn a_spread_that_is_not_given_follows_the_kind_of_networks() {
        let over = |words: &str, usual: &Training| of_words(words).over(usual).unwrap();
        let array = Training::default();
        let rows = over("--each-row", &array);
        assert_eq!((rows.options.spread, rows.refine), (2.0 * array.options.spread, true));
        assert_eq!(over("--features 9", &rows).options.spread, array.options.spread);
        assert_eq!(over("--each-row --spread 0.3", &array).options.spread, 0.3);
        let paper = over("--paper --solver qr", &array);
        assert_eq!(paper.options.spread, rows.options.spread);
        let Options { affine_tail, solver, format, .. } = paper.options;
        assert_eq!((affine_tail, solver, format), (false, Solver::Qr, Format::F32));
        assert!(!paper.refine);
    }
}
