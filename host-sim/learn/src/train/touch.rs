//! Normalised features: the shape of a touch apart from its strength ([`taxel_core::touch`]).
//!
//! Outputs are of two kinds. *Places* are told by the shape alone. *Amounts*, which scale with the touch, are learnt as
//! multiples of its strength S. A network for each kind has a projection, centres and weights of its own. Frames count by
//! what they can tell: errors of amounts are those of the outputs themselves, and errors of places weigh little where a
//! touch is weak. `docs/training.md` has measurements.

use std::borrow::Cow;
use std::fmt::{self, Display};
use std::ops::Range;
use std::str::FromStr;

use serde::{Deserialize, Serialize, Serializer};
use taxel_core::blob::Front;
use taxel_core::touch::{Kind, Touch};
use taxel_data::{AtRest, Dataset, Table, columns, exp, normal_share_below};

use super::samples::Seen;
use super::{FreshFrames, projection};
use crate::{infer, parallel};

mod features;
mod penalty;

pub(super) use features::{Places, projection as fit_projection};
pub use penalty::best as best_penalty;

/// Frames that a thread takes at a time.
const FRAMES_AT_ONCE: usize = 256;
/// Most frames that regressions on shapes are fitted to, and refinement is measured on. Output weights are fitted to all.
pub(super) const MOST_EXAMPLES: usize = 32_768;
/// Name of the input that is the logarithm of the strength.
const STRENGTH: &str = "strength";
/// S₀ as a share of the typical strength: behind a threshold, below which nothing is left, and without one.
const FLOOR: [f64; 2] = [1e-4, 0.1];
/// What is added to S before its logarithm, as a share of the typical strength.
const LOGARITHM_FLOOR: f64 = 1e-2;
/// Largest share of changes against the side that most are on, for readings that a touch moves to one side.
const OTHER_SIDE: f64 = 0.1;
/// Factor on the largest strength in training up to which amounts grow.
const MOST: f64 = 1.125;
/// Standard deviations of the strength at rest that a touch with a place is above the mean there.
const LEAST_DEVIATIONS: f64 = 6.0;

/// Usual threshold on changes, in standard deviations at rest. Between 2 and 4 it hardly matters.
pub const THRESHOLD: f64 = 3.0;

/// How the inputs of a network are made of readings.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "String")]
pub enum Features {
    /// Readings, or their ratios to the baseline, as they are.
    AsTheyAre,
    /// Shape and strength of what exceeds so many standard deviations of a reading at rest.
    Normalised {
        /// Number of standard deviations.
        threshold: f64,
    },
}

impl Display for Features {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AsTheyAre => f.write_str("plain"),
            Self::Normalised { threshold } => write!(f, "normalised:{threshold}"),
        }
    }
}

impl FromStr for Features {
    type Err = String;

    /// Parses `plain`, `normalised` or `normalised:K`.
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let rule = || {
            "give plain, normalised, or normalised:K, with a threshold of K (0 to 10) standard deviations".to_owned()
        };
        let threshold = match text.split_once(':') {
            None if text == "plain" => return Ok(Self::AsTheyAre),
            None if text == "normalised" => THRESHOLD,
            Some(("normalised", number)) => number.parse().map_err(|_| rule())?,
            _ => return Err(rule()),
        };
        if (0.0..=10.0).contains(&threshold) {
            Ok(Self::Normalised { threshold })
        } else {
            Err(rule())
        }
    }
}

impl Serialize for Features {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl TryFrom<String> for Features {
    type Error = String;

    fn try_from(text: String) -> std::result::Result<Self, String> {
        text.parse()
    }
}

/// Features for outputs of either kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kinds {
    /// Features for places.
    pub places: Features,
    /// Features for amounts.
    pub amounts: Features,
}

impl Kinds {
    /// Readings as they are for all outputs.
    pub const AS_THEY_ARE: Self = Self::all(Features::AsTheyAre);

    /// These features for all outputs.
    pub const fn all(features: Features) -> Self {
        Self { places: features, amounts: features }
    }

    fn of(self, kind: Kind) -> Features {
        match kind {
            Kind::Place => self.places,
            Kind::Amount => self.amounts,
        }
    }
}

/// Outputs that share a network, and what stands before it.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Outputs of the data set.
    pub outputs: Range<usize>,
    /// What makes shape and strength of readings; `None` for readings as they are.
    pub touch: Option<FittedTouch>,
}

/// What makes shape and strength of readings, as the blob will hold it.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedTouch {
    kind: Kind,
    block: Vec<f32>,
    /// Typical strength of a touch in training: ΣS²/ΣS.
    typical: f64,
}

impl Group {
    /// Groups of the outputs of `dataset`, in their order: one of all outputs if `kinds` has readings as they are for all
    /// of them, else one for each run of outputs of a kind.
    pub fn all(dataset: &Dataset, kinds: Kinds) -> Vec<Self> {
        let names = &dataset.outputs.names;
        let kind = |index: &usize| {
            if columns::is_place(&names[*index]) { Kind::Place } else { Kind::Amount }
        };
        let all: Vec<usize> = (0..names.len()).collect();
        if all.iter().all(|index| kinds.of(kind(index)) == Features::AsTheyAre) {
            return vec![Self { outputs: 0..names.len(), touch: None }];
        }
        let fit = |features| match features {
            Features::AsTheyAre => None,
            Features::Normalised { threshold } => Some(FittedTouch::fit(dataset, threshold)),
        };
        let places = fit(kinds.places);
        let amounts =
            if kinds.amounts == kinds.places { places.clone() } else { fit(kinds.amounts) };
        let of_run = |run: &[usize]| {
            let kind = kind(&run[0]);
            let touch = match kind {
                Kind::Place => &places,
                Kind::Amount => &amounts,
            };
            let touch = touch.clone().map(|touch| FittedTouch { kind, ..touch });
            Self { outputs: run[0]..run[run.len() - 1] + 1, touch }
        };
        all.chunk_by(|a, b| kind(a) == kind(b)).map(of_run).collect()
    }

    /// Frames of `dataset` that have one of these outputs, with these alone, and their indices.
    fn frames(&self, dataset: &Dataset) -> (Dataset, Vec<usize>) {
        let outputs = dataset.outputs.columns(self.outputs.start, self.outputs.len());
        let is_all = self.touch.is_none() && self.outputs.len() == dataset.outputs.names.len();
        let has_one = |line: &[f64]| is_all || line.iter().any(|output| !output.is_nan());
        let lines = outputs.lines().enumerate().filter(|(_, line)| has_one(line));
        let kept: Vec<usize> = lines.map(|(index, _)| index).collect();
        (Dataset { outputs, ..dataset.clone() }.subset(&kept), kept)
    }
}

/// Frames that the networks of a group of outputs are trained on.
#[derive(Debug, Clone)]
pub struct GroupFrames {
    /// The outputs, and what makes shape and strength of readings.
    pub group: Group,
    /// Frames that have one of the outputs.
    pub all: Dataset,
    /// These as the group's network is given them before a projection: an even selection of them, where there are many
    /// and readings do not stay as they are.
    pub examples: Dataset,
    /// Index of each of the examples among the frames of the data set.
    pub kept: Vec<usize>,
}

impl GroupFrames {
    /// Frames of `dataset` for these outputs.
    pub fn new(group: Group, dataset: &Dataset) -> Self {
        let (all, kept) = group.frames(dataset);
        let Some(touch) = &group.touch else {
            return Self { group, examples: all.clone(), all, kept };
        };
        let lines: Vec<usize> = (0..kept.len()).collect();
        let examples = touch.apply(&all.subset(&examples_of(&lines)));
        Self { group, all, examples, kept: examples_of(&kept) }
    }

    /// What networks behind a projection of these `parameters`, if any, see of all frames.
    ///
    /// # Panics
    /// If the projection is one of other readings.
    pub fn seen(&self, parameters: Option<&[f32]>) -> Seen {
        seen(self.group.touch.as_ref(), parameters, &self.all)
    }
}

/// An even selection of these `frames`, where there are many.
fn examples_of(frames: &[usize]) -> Vec<usize> {
    let step = frames.len().div_ceil(MOST_EXAMPLES).max(1);
    frames.iter().copied().step_by(step).collect()
}

/// Fresh frames as a group of outputs is trained on them.
pub(super) struct Fresh<'f> {
    pub fresh: &'f dyn FreshFrames,
    pub group: &'f Group,
}

impl FreshFrames for Fresh<'_> {
    fn frames(&self, step: usize, count: usize) -> Dataset {
        let (frames, _) = self.group.frames(&self.fresh.frames(step, count));
        match &self.group.touch {
            Some(touch) => touch.apply(&frames),
            None => frames,
        }
    }
}

impl FittedTouch {
    /// Fits level, threshold and strengths to `dataset`.
    fn fit(dataset: &Dataset, threshold: f64) -> Self {
        // An input may have no value at rest.
        let is_known = |rest: &AtRest| rest.level.iter().all(|level| level.is_finite());
        let known = dataset.at_rest.clone().filter(is_known);
        let AtRest { level, deviation } = known.unwrap_or_else(|| unknown_rest(&dataset.inputs));
        let of_readings = level.iter().zip(&deviation);
        let pairs: Vec<f32> =
            of_readings.flat_map(|(level, d)| [*level as f32, (threshold * d) as f32]).collect();
        let made = |[floor, logarithm_floor, least, most]: [f64; 4], side: f32| {
            let head = [floor, logarithm_floor, least, most].map(|it| it as f32);
            let block = [&head[..], &[side], &pairs].concat();
            Self { kind: Kind::Amount, block, typical: 1.0 }
        };
        let smallest = f64::from(f32::MIN_POSITIVE) * 1e9;
        let either = made([smallest; 4], 0.0);
        let changes = |lines: &[f64]| {
            let (shapes, strengths) = either.shapes(lines);
            changes(&shapes, &strengths)
        };
        let inputs = &dataset.inputs;
        let size = FRAMES_AT_ONCE * inputs.names.len();
        let side = one_side(&parallel::pieces(&inputs.values, size, &changes));
        let of_side = made([smallest; 4], side);
        let strengths = |lines: &[f64]| of_side.shapes(lines).1;
        let strengths = parallel::pieces(&inputs.values, size, &strengths).into_iter().flatten();
        let (sum, squares, most) =
            strengths.map(f64::from).fold((0.0, 0.0, 0.0), |(sum, squares, most), s| {
                (sum + s, squares + s * s, f64::max(most, s))
            });
        let typical = f64::max(squares / sum, smallest);
        let has_threshold = pairs.iter().skip(1).step_by(2).any(|threshold| *threshold > 0.0);
        let floor = typical * FLOOR[usize::from(!has_threshold)];
        let logarithm_floor = typical * LOGARITHM_FLOOR;
        let least = floor + strength_at_rest(&deviation, threshold, side);
        Self { typical, ..made([floor, logarithm_floor, least, (most + floor) * MOST], side) }
    }

    /// Shape and strength of frames with these `readings`, as inputs of a network, and the strength of each.
    fn shapes<'r>(&self, readings: &'r [f64]) -> (Cow<'r, [f64]>, Vec<f32>) {
        infer::given(&Front { outputs: 0, touch: Some(self.view()), projection: None }, readings)
    }

    /// Kind of the outputs.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Whether the shapes that it makes are those of the `other` one.
    pub(super) fn makes_shapes_of(&self, other: &Self) -> bool {
        self.block == other.block
    }

    /// As the blob holds it.
    ///
    /// # Panics
    /// Never: its numbers are finite.
    pub fn view(&self) -> Touch<'_> {
        Touch::new(self.kind, &self.block).expect("numbers that are finite")
    }

    /// How much the place of a touch of this strength counts: half as much as at most where it is typical, and nothing
    /// where a device does not tell it.
    fn weight(&self, strength: f32) -> f64 {
        let is_told = strength >= self.view().strengths().least;
        let strength = f64::from(strength);
        if is_told { strength / (strength + self.typical) } else { 0.0 }
    }

    /// Frames with shape and strength as inputs, and with outputs and weights as the network's training needs them.
    fn apply(&self, frames: &Dataset) -> Dataset {
        let Seen { mut table, strengths } = seen(Some(self), None, frames);
        if let Some(strengths) = strengths {
            let lines = table.outputs.values.chunks_exact_mut(table.outputs.names.len());
            for (line, strength) in lines.zip(&strengths) {
                line.iter_mut().for_each(|output| *output /= strength);
            }
        }
        table
    }
}

/// What networks see of `frames` behind a `touch` and a projection of these `parameters`, if there are any. Features are one
/// row, all scaled by the largest span of any.
///
/// # Panics
/// If the projection is one of other readings.
pub fn seen(touch: Option<&FittedTouch>, parameters: Option<&[f32]>, frames: &Dataset) -> Seen {
    let mut names = frames.inputs.names.clone();
    names.extend(touch.map(|_| STRENGTH.into()));
    let projection = parameters.map(|parameters| projection::view(parameters, names.len()));
    let front = Front { outputs: 0, touch: touch.map(FittedTouch::view), projection };
    let (Cow::Owned(values), strengths) = infer::given(&front, &frames.inputs.values) else {
        return frames.clone().into();
    };
    let mut table = frames.clone();
    if let Some(projection) = projection {
        names = (1..=projection.features()).map(|feature| format!("feature{feature}")).collect();
        (table.rows, table.common_span, table.at_rest) = (1, true, None);
    }
    (table.inputs, table.relative_inputs) = (Table { names, values: values.into() }, false);
    let Some(touch) = touch else { return table.into() };
    let amounts = strengths.iter().copied().map(f64::from).collect::<Vec<_>>();
    let (weights, strengths) = match touch.kind {
        Kind::Place => (strengths.iter().map(|s| touch.weight(*s).sqrt()).collect(), None),
        Kind::Amount => (amounts.iter().map(|s| s / touch.typical).collect(), Some(amounts)),
    };
    table.weights = Some(weights);
    Seen { table, strengths }
}

/// Sums of the changes up and down of frames with these `shapes` and strengths.
fn changes(shapes: &[f64], strengths: &[f32]) -> [f64; 2] {
    let (mut up, mut down) = (0.0, 0.0);
    let inputs = shapes.len() / strengths.len().max(1);
    for (frame, strength) in shapes.chunks_exact(inputs.max(1)).zip(strengths) {
        for share in &frame[..inputs - 1] {
            let change = share * f64::from(*strength);
            if change > 0.0 { up += change } else { down -= change }
        }
    }
    [up, down]
}

/// 1 or −1 if nearly all `changes`, in pieces, are up or down, and else 0. Noise at rest, which has either sign, hardly
/// counts.
fn one_side(changes: &[[f64; 2]]) -> f32 {
    let [up, down] = [0, 1].map(|side| changes.iter().map(|of| of[side]).sum::<f64>());
    if down < OTHER_SIDE * (up + down) {
        1.0
    } else if up < OTHER_SIDE * (up + down) {
        -1.0
    } else {
        0.0
    }
}

/// Strength that noise alone hardly reaches, of readings with these standard deviations at rest, by the moments of what
/// normal noise exceeds the threshold by, to one `side` or, for 0, to both.
fn strength_at_rest(deviations: &[f64], threshold: f64, side: f32) -> f64 {
    let density = exp(-0.5 * threshold * threshold) / std::f64::consts::TAU.sqrt();
    let above = 1.0 - normal_share_below(threshold);
    let sides = if side == 0.0 { 2.0 } else { 1.0 };
    let mean = sides * (density - threshold * above);
    let square = sides * ((1.0 + threshold * threshold) * above - threshold * density);
    let (sum, squares): (f64, f64) =
        deviations.iter().fold((0.0, 0.0), |(sum, squares), d| (sum + d, squares + d * d));
    mean * sum + LEAST_DEVIATIONS * ((square - mean * mean) * squares).sqrt()
}

/// Level of inputs whose rest is not known, without noise: 0 where they are changes already, and else their median.
fn unknown_rest(inputs: &Table) -> AtRest {
    let (means, deviations) = (inputs.means(), inputs.deviations());
    let near = means.iter().zip(&deviations).filter(|(mean, d)| mean.abs() <= **d).count();
    let count = means.len();
    let level = if 2 * near >= count { vec![0.0; count] } else { inputs.medians() };
    AtRest { level, deviation: vec![0.0; count] }
}
