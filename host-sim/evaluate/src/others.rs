//! Errors on contacts that a model was not trained on, and whether it notices that they are others.

use taxel_data::{Dataset, Stream};
use taxel_learn::decoders::mean;
use taxel_learn::{Decoder, PreparedModel};
use taxel_simulate::Synthesis;

use crate::experiment::OtherContact;
use crate::metrics::{self, DecoderErrors, Errors, Measure, of_decoder, rmse_of};
use crate::subject::Subject;
use crate::verdict::{HARDLY, Warning};

/// Most frames that a model is judged by on each other contact.
const MOST_FRAMES: usize = 1000;
/// Ratio of errors from which another contact is decoded much worse.
const MUCH_WORSE: f64 = 1.5;
/// Share of novel frames in per cent from which a contact counts as noticed.
const NOTICED: f64 = 90.0;
/// Most contacts that a warning names.
const MOST_NAMED: usize = 2;

/// Errors of a model on other contacts than those that it was trained on.
#[derive(Debug, Clone, PartialEq)]
pub struct Others {
    /// Number of frames of each contact.
    pub frames: usize,
    /// Share in per cent of the scene's own frames that the model finds novel; `None` of a model that does not tell.
    pub own_percent_novel: Option<f64>,
    pub contacts: Vec<OtherErrors>,
}

/// Errors of a model on one kind of other contacts.
#[derive(Debug, Clone, PartialEq)]
pub struct OtherErrors {
    pub name: String,
    /// Errors of the model by group of outputs, without a ratio to the limit.
    pub errors: Vec<Errors>,
    /// Errors of always predicting the mean of training.
    pub mean: Vec<Errors>,
    /// Share of the frames in per cent that the model finds novel; `None` of a model that does not tell.
    pub percent_novel: Option<f64>,
}

/// Frames of other contacts, by name.
pub type OtherFrames = Vec<(String, Dataset)>;

/// Frames of all other contacts of a subject, of each as many as the scene has test frames, but at most 1000. Measurements have
/// none.
pub fn frames(subject: &Subject) -> OtherFrames {
    let Some(scene) = subject.scene() else { return vec![] };
    let count = scene.test_frames.min(MOST_FRAMES);
    let of = |other: &OtherContact| {
        let moved = Synthesis::new(&scene.world).moved_by(&other.deformation);
        (other.name.clone(), scene.dataset(&moved, Stream::Test, count))
    };
    scene.others.iter().map(of).collect()
}

/// Share of the frames with this `novelty` that are novel, in per cent of those of which it can be told.
pub fn percent_novel(novelty: &[f64]) -> f64 {
    let told = novelty.iter().filter(|novelty| !novelty.is_nan()).count();
    let novel = novelty.iter().filter(|novelty| **novelty > 0.0).count();
    100.0 * novel as f64 / told.max(1) as f64
}

impl Others {
    /// Errors of a `model` on `frames` of other contacts, beside the `mean`; `None` without any. `own` are frames of the
    /// scene's own contacts.
    pub fn new(
        frames: &OtherFrames,
        (model, mean): (&PreparedModel<'_>, &dyn Decoder),
        own: &Dataset,
        measure: &Measure,
    ) -> Option<Self> {
        let measure = Measure { limit: None, ..measure.clone() };
        let novel = |inputs: &[f64]| Some(percent_novel(&model.assess(inputs)?.1));
        let contacts = frames.iter().map(|(name, frames)| OtherErrors {
            name: name.clone(),
            errors: metrics::judge(model, frames, &measure).errors,
            mean: metrics::judge(mean, frames, &measure).errors,
            percent_novel: novel(&frames.inputs.values),
        });
        let own_percent_novel = novel(&own.inputs.values);
        let (_, first) = frames.first()?;
        Some(Self { frames: first.frames(), own_percent_novel, contacts: contacts.collect() })
    }

    /// Warning of contacts that are decoded much worse than the scene's, and not noticed.
    ///
    /// A contact counts if, in a group of outputs that the model tells much of, its RMSE or its share of the standard
    /// deviation √(1 − R²) is more than 1.5 times that on the scene's own contacts. A contact of whose frames 90 % are
    /// novel does not: a robot knows not to believe them. The first of `decoders` is the model.
    pub fn warning(&self, decoders: &[DecoderErrors]) -> Option<Warning> {
        let of_mean = of_decoder(decoders, mean::NAME);
        let told = |group: &&Errors| {
            rmse_of(of_mean, &group.group).is_some_and(|mean| group.rmse <= HARDLY * mean)
        };
        let told: Vec<&Errors> = decoders.first()?.errors.iter().filter(told).collect();
        let mut worse: Vec<(f64, String)> = Vec::new();
        for contact in &self.contacts {
            if contact.percent_novel.is_some_and(|percent| percent >= NOTICED) {
                continue;
            }
            let pairs = told.iter().filter_map(|own| {
                let other = contact.errors.iter().find(|other| other.group == own.group)?;
                Some((own, other, ratio(own, other)))
            });
            let worst = pairs.max_by(|a, b| a.2.total_cmp(&b.2));
            let Some((own, other, ratio)) = worst.filter(|(_, _, ratio)| *ratio > MUCH_WORSE)
            else {
                continue;
            };
            worse.push((ratio, described(&contact.name, own, other)));
        }
        worse.sort_by(|a, b| b.0.total_cmp(&a.0));
        let named: Vec<String> =
            worse.iter().take(MOST_NAMED).map(|(_, text)| text.clone()).collect();
        let has_novelty = self.own_percent_novel.is_some();
        Warning::other_contacts(&named, worse.len().saturating_sub(MOST_NAMED), has_novelty)
    }
}

/// Ratio of the errors of another contact to those of a scene's own: in RMSE, or in shares of the standard deviation.
fn ratio(own: &Errors, other: &Errors) -> f64 {
    let left = |errors: &Errors| errors.r_squared.map(|r_squared| (1.0 - r_squared).sqrt());
    let shares = left(other).zip(left(own)).map_or(0.0, |(other, own)| other / own);
    (other.rmse / own.rmse).max(shares)
}

fn described(name: &str, own: &Errors, other: &Errors) -> String {
    let r_squared = |errors: &Errors| errors.r_squared.map_or("-".into(), |it| format!("{it:.2}"));
    format!(
        "{name} ({} {:.3} {} with R² {} instead of {:.3} with {})",
        own.group,
        other.rmse,
        own.unit,
        r_squared(other),
        own.rmse,
        r_squared(own)
    )
}

#[cfg(test)]
mod tests;
