//! Measurements of a real sensor: frames to train on, and frames to judge by.

use std::sync::Arc;

use taxel_data::dataset::{LeftOut, UnusedInputs};
use taxel_data::{AtRest, BadValue, Clock, Dataset, Rest, Table, require};
use taxel_learn::outliers::Outliers;
use taxel_learn::{Origin, folds, relative};

use crate::metrics::Measure;
use crate::training_options::{Training, TrainingOptions};

/// Measured frames, and how a model is trained on them.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurements {
    /// Name of the data, which names the output folder and the model.
    pub name: String,
    /// CRC-64/XZ of the file.
    pub digest: u64,
    pub training: Dataset,
    /// When these frames were measured.
    pub log: Log,
    /// Fold of each training frame, numbered from 0.
    pub fold_of: Vec<usize>,
    /// Whether folds are drawn at random though successive lines resemble each other, which flatters a model.
    pub folds_flatter: bool,
    /// Frames to judge by, which nothing is trained on.
    pub test: Dataset,
    /// When these were measured.
    pub test_log: Log,
    /// Readings of the untouched sensor for these, if they are known.
    pub test_rest: Option<Arc<Rest>>,
    /// Whether these are of the same file as the frames to train on.
    pub is_one_log: bool,
    /// How much the readings of the file to train on vary, at rest or not, as they were measured.
    pub spread: Spread,
    /// How the test frames were chosen, in words.
    pub test_choice: String,
    /// Values of the file that are far from all others in their column. Training frames are without them, unless they
    /// are to be kept.
    pub outliers: Outliers,
    /// Lines of the file that lack a value.
    pub left_out: LeftOut,
    /// Inputs that were chosen and can tell nothing.
    pub unused: UnusedInputs,
    /// Readings of the untouched sensor, in the readings' columns, if they are known.
    pub rest: Option<Arc<Rest>>,
    /// How a model is trained on them.
    pub how: Training,
}

/// When the frames of a data set were measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Log {
    pub clock: Clock,
    /// Line of each frame in the file (from 0), which the clock tells the time of.
    pub lines: Vec<usize>,
}

impl Log {
    /// Log of the frames at `indices` (from 0).
    #[must_use]
    pub fn subset(&self, indices: &[usize]) -> Self {
        let lines = indices.iter().map(|index| self.lines[*index]).collect();
        Self { clock: self.clock.clone(), lines }
    }

    /// Time of each frame.
    pub fn times(&self) -> Vec<f64> {
        self.lines.iter().map(|line| self.clock.at[*line]).collect()
    }
}

/// How much each column of a table varies, in its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    pub deviations: Vec<f64>,
    /// Smallest and largest value.
    pub ranges: Vec<[f64; 2]>,
}

impl Spread {
    pub fn of(table: &Table) -> Self {
        Self { deviations: table.deviations(), ranges: table.ranges() }
    }
}

/// Measured frames of one file.
#[derive(Debug, Clone, PartialEq)]
pub struct Frames {
    pub frames: Dataset,
    pub log: Log,
    /// Readings of the untouched sensor, in the readings' columns, if they are known.
    pub rest: Option<Arc<Rest>>,
}

impl Frames {
    /// The frames, with inputs relative to their baselines if `relative_inputs` says so, and what inputs are at rest if
    /// that is known.
    pub fn given(self, relative_inputs: bool) -> Dataset {
        let Some(rest) = &self.rest else { return self.frames };
        let at_rest = |inputs: &Table| Some(AtRest::of(inputs));
        if !relative_inputs {
            return Dataset { at_rest: at_rest(&rest.readings), ..self.frames };
        }
        let baselines = rest.baselines(rest.lines.as_deref().unwrap_or_default());
        let at_rest = at_rest(&relative::inputs(&rest.readings, &baselines));
        Dataset { at_rest, ..relative::dataset(self.frames, &rest.baselines(&self.log.lines)) }
    }

    /// Frames at `indices` (from 0), in that order.
    #[must_use]
    pub fn subset(&self, indices: &[usize]) -> Self {
        Self {
            frames: self.frames.subset(indices),
            log: self.log.subset(indices),
            rest: self.rest.clone(),
        }
    }
}

/// Frames that a model is judged by.
#[derive(Debug, Clone, PartialEq)]
pub enum Judged {
    /// None: all frames are trained on.
    None,
    /// The last fifth of the frames, or the last fold where folds are given. Frames close in time resemble each
    /// other, so that frames drawn at random would flatter a model.
    HeldOut,
    /// Frames of a file of its own.
    File {
        /// Its frames, with the columns of the frames to train on.
        frames: Box<Frames>,
        /// Its name, for people.
        name: String,
    },
}

/// Share of the frames that are held out: one of so many.
const HELD_OUT: usize = 5;

/// Frames to train on and frames to judge by.
#[derive(Debug, Clone, PartialEq)]
pub struct Split {
    /// Indices of the frames to train on.
    pub training: Vec<usize>,
    /// Frames to judge by.
    pub test: Frames,
    /// How these were chosen, in words.
    pub choice: String,
}

impl Split {
    /// Splits `frames` into those to train on and those to judge by. `fold_of` gives the fold of each frame, if its
    /// user told it.
    pub fn new(frames: &Frames, fold_of: Option<&[usize]>, judged: Judged) -> Self {
        let count = frames.frames.frames();
        let all = 0..count;
        let last_fold = fold_of.and_then(|folds| folds.iter().max());
        let (training, test): (Vec<usize>, Vec<usize>) = match (&judged, last_fold, fold_of) {
            (Judged::HeldOut, Some(last), Some(folds)) => {
                all.partition(|frame| folds[*frame] != *last)
            }
            (Judged::HeldOut, ..) => {
                let kept = count - count / HELD_OUT;
                all.partition(|frame| *frame < kept)
            }
            _ => (all.collect(), vec![]),
        };
        let (test, choice) = match (judged, last_fold) {
            (Judged::File { frames, name }, _) => (*frames, format!("all of {name}")),
            (Judged::HeldOut, Some(_)) => (frames.subset(&test), "the last fold".into()),
            (Judged::HeldOut, None) => (frames.subset(&test), "the last fifth".into()),
            (Judged::None, _) => (frames.subset(&test), "none".into()),
        };
        Self { training, test, choice }
    }
}

impl Measurements {
    /// These measurements without the name of their file, which is in the blob: no result of a plan depends on it.
    pub fn unnamed(&self) -> Arc<Self> {
        Arc::new(Self { name: "data".into(), ..self.clone() })
    }

    /// Measurements that are these frames alone, which a model is trained on as `how` says.
    pub fn of_frames(name: &str, frames: Dataset, fold_of: Vec<usize>, how: Training) -> Self {
        let nothing = frames.subset(&[]);
        let log = |frames: &Dataset| {
            let at = (0..frames.frames()).map(|frame| frame as f64).collect();
            let clock = Clock { column: None, unit: "", at };
            Log { clock, lines: (0..frames.frames()).collect() }
        };
        Self {
            name: name.into(),
            digest: 0,
            log: log(&frames),
            fold_of,
            folds_flatter: false,
            test_log: log(&nothing),
            test: nothing,
            test_rest: None,
            is_one_log: true,
            spread: Spread::of(&frames.inputs),
            test_choice: "none".into(),
            outliers: Outliers::default(),
            left_out: LeftOut::default(),
            unused: UnusedInputs::default(),
            rest: None,
            how,
            training: frames,
        }
    }

    /// Number of folds.
    pub fn folds(&self) -> usize {
        self.fold_of.iter().max().map_or(0, |last| last + 1)
    }

    /// These measurements without the frames of `fold` (from 0), which are to judge by.
    #[must_use]
    pub fn without_fold(self, fold: usize) -> Self {
        let (held, kept) = folds::split(&self.fold_of, fold);
        Self {
            fold_of: folds::without(&self.fold_of, fold),
            test: self.training.subset(&held),
            test_log: self.log.subset(&held),
            test_rest: self.rest.clone(),
            is_one_log: true,
            test_choice: format!("fold {fold}"),
            training: self.training.subset(&kept),
            log: self.log.subset(&kept),
            ..self
        }
    }

    /// Trains on these measurements as `given` says from now on.
    ///
    /// # Errors
    /// [`BadValue`] for an option that is a scene's alone, for inputs that are not as they were loaded, and as
    /// [`TrainingOptions::over`].
    pub fn train_with(&mut self, given: &TrainingOptions) -> Result<(), BadValue> {
        for (field, frames) in [("frames", given.frames), ("test_frames", given.test_frames)] {
            if let Some(frames) = frames {
                let rule = "it sets a scene's frames; a data file has its own: leave it out";
                return Err(BadValue::new(format!("training.{field}"), frames, rule));
            }
        }
        let how = given.over(&self.how)?;
        require(!how.track, "training.track", true, || {
            "a tracker needs a scene, which describes how contacts move: leave it out".into()
        })?;
        require(
            how.relative_inputs == self.training.relative_inputs,
            "training.relative_inputs",
            how.relative_inputs,
            || "all points have the same inputs: give it in [set]".into(),
        )?;
        self.how = how;
        Ok(())
    }

    /// Origin of the frames, for the model's metadata.
    pub fn origin(&self) -> Origin {
        Origin::of_data(&self.name, self.digest, self.how.options.seed, &self.training)
    }

    /// Names of the inputs that never change in the training frames.
    pub fn constant_inputs(&self) -> Vec<String> {
        let inputs = &self.training.inputs;
        let columns = inputs.names.iter().zip(inputs.deviations());
        columns.filter(|(_, deviation)| *deviation == 0.0).map(|(name, _)| name.clone()).collect()
    }

    /// Relative noise of a reading at rest, as a fraction: the root of the mean over columns of (standard
    /// deviation/mean)². In a log the standard deviation is that of differences between successive lines, over √2, which
    /// a drift does not raise, nor noise that successive lines share. `None` if the sensor at rest is not known, or a
    /// column's mean is zero.
    pub fn noise_level(&self) -> Option<f64> {
        let rest = self.rest.as_ref()?;
        let columns = rest.readings.names.len();
        let relative = rest.noise().into_iter().zip(rest.readings.means());
        let squares: f64 = relative.map(|(deviation, mean)| (deviation / mean).powi(2)).sum();
        Some((squares / columns as f64).sqrt()).filter(|level| level.is_finite())
    }

    /// Baseline of the test frame in the middle, on one line, if the sensor at rest is known and its readings are
    /// [far from zero](far_from_zero) there.
    pub fn baseline(&self) -> Option<Table> {
        let lines = &self.test_log.lines;
        let middle = lines.get(lines.len() / 2)?;
        let baseline = self.test_rest.as_ref()?.baselines(&[*middle]);
        far_from_zero(&baseline.values, &self.spread.deviations).then_some(baseline)
    }

    /// Measure for errors on the test frames.
    pub fn measure(&self) -> Measure {
        let rest = self.test_rest.as_ref().or(self.rest.as_ref());
        let noise = rest.map(|rest| {
            let noise = rest.noise().into_iter().zip(rest.readings.means());
            let relative = self.training.relative_inputs;
            noise.map(|(noise, mean)| if relative { noise / mean.abs() } else { noise }).collect()
        });
        Measure { full_scale: self.origin().full_scale, thickness_mm: None, limit: None, noise }
    }
}

/// Whether readings at rest are levels that changes can be told in per cent of: in nine of ten columns their mean is larger
/// than the standard deviation of all readings. It is not where a baseline was subtracted.
pub fn far_from_zero(at_rest: &[f64], deviations: &[f64]) -> bool {
    let far = at_rest.iter().zip(deviations).filter(|(mean, deviation)| mean.abs() > **deviation);
    10 * far.count() >= 9 * at_rest.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames numbered from 0 in their one reading.
    fn numbered(count: usize) -> Frames {
        let mut frames = Dataset::empty(vec!["ch1".into()], vec!["f_n".into()], 1, count);
        for (value, number) in frames.inputs.values.iter_mut().zip(0..) {
            *value = f64::from(number);
        }
        let at = (0..count).map(|line| line as f64).collect();
        let clock = Clock { column: None, unit: "", at };
        Frames { frames, log: Log { clock, lines: (0..count).collect() }, rest: None }
    }

    #[test]
    fn the_last_fifth_or_the_last_given_fold_is_held_out() {
        for (count, folds, training, test, choice) in [
            (11, None, (0..9).collect(), [9.0, 10.0], "the last fifth"),
            (5, Some(&[2, 0, 1, 2, 0][..]), vec![1, 2, 4], [0.0, 3.0], "the last fold"),
        ] {
            let split = Split::new(&numbered(count), folds, Judged::HeldOut);
            assert_eq!((split.training, split.choice.as_str()), (training, choice));
            assert_eq!(split.test.frames.inputs.values, test);
            assert_eq!(split.test.log.times(), test);
        }
    }

    #[test]
    fn a_file_of_its_own_leaves_all_frames_to_train_on() {
        let judged = Judged::File { frames: Box::new(numbered(3)), name: "test.csv".into() };
        let split = Split::new(&numbered(5), None, judged);
        assert_eq!((split.training.len(), split.test.frames.frames()), (5, 3));
        assert_eq!(split.choice, "all of test.csv");
        assert_eq!(Split::new(&numbered(5), None, Judged::None).test.frames.frames(), 0);
    }
}
