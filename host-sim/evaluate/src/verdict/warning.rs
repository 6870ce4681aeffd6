//! Warnings, each by a name of its own.

use serde::Serialize;
use taxel_core::rbf::Format;
use taxel_core::reading_model::ReadingModel;
use taxel_data::Table;
use taxel_data::error::cut;
use taxel_learn::cost::{Design, NetworkDesign};
use taxel_learn::outliers::Outliers;
use taxel_learn::train::projection;
use taxel_simulate::noise::Noise;

use super::significant;
use crate::over_time::{PercentOf, RestOverTime};

/// Largest blob in bytes that a slot of the firmware's images holds: 128 KiB.
pub const SLOT_BYTES: usize = 131_072;

/// Frames for each weight of a network below which a warning is due.
pub const FRAMES_A_WEIGHT: usize = 10;

/// Number of frames to judge by below which a warning is due.
pub const FEW_TEST_FRAMES: usize = 30;

/// Number of training frames below which intervals cover noticeably more or fewer errors than they say.
pub const FRAMES_FOR_CONFIDENCE: usize = 300;

/// Least share by which averaging twice as many samples must lower the noise to pay.
const PAYS: f64 = 0.1;

/// Share of simulated readings at or below zero above which a warning is due.
const NOT_POSITIVE: f64 = 1e-4;

/// What to beware of, in words.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Warning {
    /// Name, the same wherever the warning appears.
    pub name: &'static str,
    /// What is wrong, and what to do.
    pub text: String,
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "warning: {} ({})", self.text, self.name)
    }
}

impl Warning {
    fn when(due: bool, name: &'static str, text: impl FnOnce() -> String) -> Option<Self> {
        due.then(|| Self { name, text: text() })
    }

    /// Groups of outputs that are decoded no better than by always predicting the mean.
    pub fn no_gain_over_mean(groups: &[&str]) -> Option<Self> {
        Self::when(!groups.is_empty(), "no-gain-over-mean", || {
            let groups = groups.join(", ");
            format!(
                "{groups}: not significantly better than always predicting the mean; do not use these estimates"
            )
        })
    }

    /// Groups of outputs that the centroid or a linear decoder decodes better.
    pub fn worse_than_baseline(groups: &[&str]) -> Option<Self> {
        Self::when(!groups.is_empty(), "worse-than-baseline", || {
            let groups = groups.join(", ");
            format!(
                "{groups}: a simpler decoder is better, so the model is not worth its cost there (docs/trouble.md)"
            )
        })
    }

    /// Most centres for which so many training `frames` of `inputs` raise no [warning](Self::few_frames): a multiple of
    /// four, which f32 does not pad; four at least.
    pub fn enough_frames_for(frames: usize, inputs: usize) -> usize {
        let centres = (frames / FRAMES_A_WEIGHT).saturating_sub(inputs + 1);
        (centres / 4 * 4).max(4).min(frames.saturating_sub(1).max(1))
    }

    /// Fewer than [`FEW_TEST_FRAMES`] frames to judge by.
    pub fn few_test_frames(frames: usize) -> Option<Self> {
        Self::when(frames < FEW_TEST_FRAMES, "few-test-frames", || {
            let plural = if frames == 1 { " is" } else { "s are" };
            format!(
                "{frames} test frame{plural} few, and the errors on other frames may differ: give \
                 {FEW_TEST_FRAMES} or more"
            )
        })
    }

    /// Model that is judged by the file that it was trained on.
    pub fn trained_on(same_file: bool) -> Option<Self> {
        Self::when(same_file, "judged-by-training-data", || {
            "the model was trained on these lines, so its errors look too small: evaluate it on others".into()
        })
    }

    /// Fewer than [`FRAMES_A_WEIGHT`] training `frames` for each of the weights that an output of a network has: one
    /// for each of its `centres`, one for each of its `inputs` behind the affine tail, and the bias.
    pub fn few_frames(frames: usize, centres: usize, inputs: usize) -> Option<Self> {
        let weights = centres + inputs + 1;
        let needed = FRAMES_A_WEIGHT * weights;
        Self::when(frames < needed, "few-frames", || {
            format!(
                "{frames} training frames are few for {weights} weights an output (K = {centres}): give {needed} or \
                 more{}",
                if centres > 4 { ", or lower --centres" } else { "" }
            )
        })
    }

    /// Confidence of fewer than 300 training `frames`.
    pub fn few_frames_for_confidence(
        frames: usize,
        model: Option<ReadingModel<'_>>,
    ) -> Option<Self> {
        let due = frames < FRAMES_FOR_CONFIDENCE && model.is_some_and(|it| it.assesses());
        Self::when(due, "few-frames-for-confidence", || {
            format!(
                "{frames} training frames are few for a reading model, whose intervals may cover far more or fewer errors \
                 than stated: give {FRAMES_FOR_CONFIDENCE} or more"
            )
        })
    }

    /// Contacts that a model was not trained on and decodes much worse, the worst in words, and a number of `more`.
    pub fn other_contacts(worst: &[String], more: usize, has_novelty: bool) -> Option<Self> {
        Self::when(!worst.is_empty(), "other-contacts", || {
            let more = if more == 0 { String::new() } else { format!(" and {more} more") };
            let advice = if has_novelty {
                "; train on a mix (docs/scenes.md), and do not use estimates of novel frames"
            } else {
                "; train on a mix (docs/scenes.md), or let a reading model notice them (train --reading-model full)"
            };
            format!(
                "contacts unlike those of training are decoded worse: {}{more}{advice}",
                worst.join(", ")
            )
        })
    }

    /// Simulated resistances that noise made zero or negative, which no sensor reads.
    pub fn not_positive(readings: &Table) -> Option<Self> {
        let count = readings.values.iter().filter(|reading| **reading <= 0.0).count();
        let share = count as f64 / readings.values.len().max(1) as f64;
        Self::when(share > NOT_POSITIVE, "readings-not-positive", || {
            format!(
                "noise makes {:.2} % of the readings zero or negative, which no sensor reads: lower noise.level",
                100.0 * share
            )
        })
    }

    /// Lines of the data with values far from all others.
    pub fn outliers(outliers: &Outliers) -> Option<Self> {
        Self::when(outliers.lines > 0, "outliers", || {
            let done = if outliers.left_out { "left out of training" } else { "kept" };
            let plural = if outliers.lines == 1 { " holds" } else { "s hold" };
            format!(
                "{} line{plural} values far from all others, and {} {done}: look at the wiring and the log",
                outliers.lines,
                if outliers.lines == 1 { "is" } else { "are" }
            )
        })
    }

    /// Readings at rest that drift.
    pub fn drift(rest: &RestOverTime) -> Option<Self> {
        Self::when(!rest.drifts.is_empty(), "drift-at-rest", || {
            let of = match rest.percent_of {
                PercentOf::Rest => "",
                PercentOf::Range => " of its range",
            };
            let named = rest.drifts.iter().take(MOST_NAMED);
            let named: Vec<String> = named
                .map(|drift| format!("{} by {:.1} %{of}", cut(&drift.column), drift.percent))
                .collect();
            let count = match rest.drifts.len() {
                1 => "an input drifts".to_owned(),
                count => format!("{count} of {} inputs drift", rest.readings),
            };
            format!(
                "at rest, {count} {}: {}; docs/drift.md has remedies",
                rest.span,
                named.join(", ")
            )
        })
    }

    /// Means of so many `samples` that lower the noise by less than a tenth of what half as many leave: what is
    /// `left` of it by a number of samples.
    pub fn idle_averaging(samples: usize, left: impl Fn(usize) -> Noise) -> Option<Self> {
        let level = |samples: usize| left(samples.max(1)).total_level();
        let due = samples > 1 && level(samples) > (1.0 - PAYS) * level(samples / 2);
        Self::when(due, "averaging-does-not-pay", || {
            format!(
                "the mean of {samples} samples has {} of the noise of one sample, and the mean of half as many has {}: a part \
                 of the noise has a time constant of {} ms, which is longer than these samples take; average fewer (--average)",
                significant(level(samples) / level(1)),
                significant(level(samples / 2) / level(1)),
                significant(left(1).time_constant_ms)
            )
        })
    }

    /// Folds that were drawn at random from a log.
    pub fn folds_flatter(due: bool) -> Option<Self> {
        Self::when(due, "random-folds-of-a-log", || {
            "successive lines resemble each other, so errors on random folds look too small: leave --folds out to use blocks of \
             lines, or give --fold-column"
                .into()
        })
    }

    /// Blob of more `bytes` than a slot holds, of a model of this `design`, and what makes it fit.
    pub fn larger_than_slot(bytes: usize, design: &Design) -> Option<Self> {
        Self::when(bytes > SLOT_BYTES, "larger-than-slot", || {
            let fix = match smaller(bytes, design).as_slice() {
                [] => "choose fewer readings (--inputs)".to_owned(),
                fixes => format!("it fits with {}", fixes.join(", or with ")),
            };
            format!(
                "the blob takes {bytes} bytes, and a slot of the firmware's images holds {SLOT_BYTES}: {fix}"
            )
        })
    }
}

/// Most columns, and most outputs, that are named in a warning of drift.
const MOST_NAMED: usize = 3;

/// Options with which a blob of so many `bytes`, of a model of this `design`, fits into a slot.
fn smaller(bytes: usize, design: &Design) -> Vec<String> {
    let besides = bytes.saturating_sub(design.parameter_bytes());
    let fits = |design: &Design| besides + design.parameter_bytes() <= SLOT_BYTES;
    let Some(first) = design.networks.first() else { return vec![] };
    let with = |change: &dyn Fn(&mut NetworkDesign)| {
        let mut smaller = design.clone();
        smaller.networks.iter_mut().for_each(change);
        smaller
    };
    let centres = |most: usize| with(&|it| it.shape.centres = it.shape.centres.min(most));
    let most = (1..=first.shape.centres / 8).rev().map(|eighths| 8 * eighths);
    let mut fixes = Vec::new();
    if first.format != Format::Fixed16 && fits(&with(&|it| it.format = Format::Fixed16)) {
        fixes.push("--format fixed16".to_owned());
    }
    fixes.extend(
        most.filter(|most| *most < first.shape.centres)
            .find(|most| fits(&centres(*most)))
            .map(|most| format!("--centres {most}")),
    );
    let readings = design.shape.rows * design.shape.inputs;
    let features = projection::usual_features(design.shape.rows, readings);
    if !design.whole_frames() && features < readings {
        let mut array =
            Design::of_array(design.shape, first.format, first.shape.centres, first.affine_tail);
        array.networks.iter_mut().for_each(|it| it.shape.inputs = features);
        if fits(&array) {
            fixes.push(format!("--features {features}"));
        }
    }
    fixes
}
