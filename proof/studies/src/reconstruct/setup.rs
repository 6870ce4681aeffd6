//! What the paper leaves open, as axes with a few values each, and a set-up: one value of each axis.

use serde::{Deserialize, Serialize};
use taxel_data::random::Random;
use taxel_learn::decoders::textbook::{Scaling, SpreadMeaning};
use taxel_simulate::motion;
use taxel_simulate::motion::{Independent, Press};

/// Axis of the search: what is open, and the values that are tried.
#[derive(Debug, Clone, Copy)]
pub struct Axis {
    /// What the paper leaves open.
    pub name: &'static str,
    /// Values, as pages name them.
    pub values: &'static [&'static str],
}

/// Every axis, in the order of a [`Setup`]'s values.
pub const AXES: [Axis; 10] = [
    Axis { name: "what moves", values: &["x, y and z", "z alone", "one contact"] },
    Axis { name: "range of Δz", values: &["0 … 1 mm", "±1 mm"] },
    Axis { name: "samples N", values: &["50", "100", "200", "400", "600"] },
    Axis {
        name: "centres K",
        values: &["5 % of N", "10 %", "20 %", "30 %", "50 %", "N (standard)"],
    },
    Axis {
        name: "noise is a share of",
        values: &["the reading", "the span", "the deviation", "the power", "the mean reading"],
    },
    Axis {
        name: "inputs scaled",
        values: &["to [0, 1]", "to [-1, 1]", "by the maximum", "by a common range", "by deviation"],
    },
    Axis { name: "spread is", values: &["σ", "half the height"] },
    Axis { name: "bias", values: &["no", "yes"] },
    Axis {
        name: "judged on",
        values: &["fresh samples", "training deformations, fresh noise", "the training samples"],
    },
    Axis { name: "network", values: &["readings to Δ", "Δ to readings, inverted"] },
];

const FRAMES: [usize; 5] = [50, 100, 200, 400, 600];
const CENTRES_PERCENT: [usize; 6] = [5, 10, 20, 30, 50, 100];
/// Largest number of centres that is tried: the work grows with its square.
const MOST_CENTRES: usize = 200;

/// What the noise level is a share of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoiseOf {
    Reading,
    /// A channel's span over the training samples.
    Span,
    /// A channel's standard deviation.
    Deviation,
    /// A channel's variance: the level is a ratio of powers.
    Power,
    Mean,
}

/// Samples that a table is judged on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JudgedOn {
    /// Deformations and noise that training did not see.
    Fresh,
    /// Deformations of training with fresh noise.
    SameDeformations,
    /// Samples of training themselves. The paper speaks of test samples, so this is outside its words.
    Training,
}

/// Index of the axis of [`JudgedOn`].
pub const JUDGED: usize = 8;
/// Index of one contact on the axis of what moves.
const CONTACT: usize = 2;
const DIRECTION: usize = 9;
/// One set-up in so many that are drawn inverts a network, which takes seconds.
const FORWARD_IN: usize = 8;
const SAMPLES: usize = 2;
const CENTRES: usize = 3;

/// Set-up of Table 1: the index of one value of each of the [`AXES`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Setup(pub [usize; AXES.len()]);

impl Setup {
    /// Draws a set-up.
    pub fn random(random: &mut Random) -> Self {
        let mut setup = Self(AXES.map(|axis| random.below(axis.values.len())));
        setup.0[DIRECTION] = usize::from(random.below(FORWARD_IN) == 0);
        setup.held()
    }

    /// Set-up that differs in one or two values, drawn at random; never in the axis `kept`.
    #[must_use]
    pub fn mutated(mut self, kept: Option<usize>, random: &mut Random) -> Self {
        for _ in 0..=random.below(2) {
            let axis = random.below(AXES.len());
            if Some(axis) != kept {
                self.0[axis] = random.below(AXES[axis].values.len());
            }
        }
        self.held()
    }

    /// The set-up with one value changed; `None` if that makes no set-up.
    #[must_use]
    pub fn with(mut self, axis: usize, value: usize) -> Option<Self> {
        self.0[axis] = value;
        (self.held() == self).then_some(self)
    }

    /// The set-up with no more samples than the largest number of centres allows, and with contacts that press.
    fn held(mut self) -> Self {
        if self.0[0] == CONTACT {
            self.0[1] = 0;
        }
        while self.centres() > MOST_CENTRES {
            self.0[SAMPLES] -= 1;
        }
        self
    }

    /// Whether every value is one of its axis.
    pub fn is_valid(&self) -> bool {
        self.0.iter().zip(AXES).all(|(value, axis)| *value < axis.values.len())
            && self.held() == *self
    }

    /// Number N of training samples.
    pub fn frames(&self) -> usize {
        FRAMES[self.0[SAMPLES]]
    }

    /// Number K of centres.
    pub fn centres(&self) -> usize {
        (self.frames() * CENTRES_PERCENT[self.0[CENTRES]] / 100).max(2)
    }

    /// Motion of the electrodes.
    pub fn motion(&self) -> motion::Kind {
        const ALL_MM: [f64; 2] = [-1.0, 1.0];
        let dz_mm = [[0.0, 1.0], ALL_MM][self.0[1]];
        let sideways_mm = if self.0[0] == 0 { ALL_MM } else { [0.0; 2] };
        if self.0[0] == CONTACT {
            let (dent_radius_mm, shear_ratio) = ([2.0, 5.0], [0.0, 0.5]);
            return Press { dent_radius_mm, dent_depth_mm: dz_mm, shear_ratio }.into();
        }
        Independent { dx_mm: sideways_mm, dy_mm: sideways_mm, dz_mm }.into()
    }

    /// Largest minus smallest Δz, in mm.
    pub fn range_mm(&self) -> f64 {
        [1.0, 2.0][self.0[1]]
    }

    /// Meaning of the noise level.
    pub fn noise(&self) -> NoiseOf {
        use NoiseOf::{Deviation, Mean, Power, Reading, Span};
        [Reading, Span, Deviation, Power, Mean][self.0[4]]
    }

    /// Scaling of the inputs.
    pub fn scaling(&self) -> Scaling {
        use Scaling::{CommonRange, Maximum, Range, Standard, Symmetric};
        [Range, Symmetric, Maximum, CommonRange, Standard][self.0[5]]
    }

    /// Meaning of the spread.
    pub fn spread(&self) -> SpreadMeaning {
        [SpreadMeaning::Sigma, SpreadMeaning::HalfHeight][self.0[6]]
    }

    /// Whether networks have a bias.
    pub fn bias(&self) -> bool {
        self.0[7] == 1
    }

    /// Samples that the table is judged on.
    pub fn judged_on(&self) -> JudgedOn {
        [JudgedOn::Fresh, JudgedOn::SameDeformations, JudgedOn::Training][self.0[JUDGED]]
    }

    /// Whether networks predict readings from deformations, as the end of the paper's §3 says, and are inverted.
    pub fn is_forward(&self) -> bool {
        self.0[DIRECTION] == 1
    }

    /// Whether electrodes move along z alone.
    pub fn moves_z_alone(&self) -> bool {
        self.0[0] == 1
    }

    /// Values of the set-up by the names of their axes.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, &'static str)> {
        AXES.into_iter().zip(self.0).map(|(axis, value)| (axis.name, axis.values[value]))
    }
}

#[cfg(test)]
mod tests {
    use taxel_data::random::{Purpose, Stream};

    use super::*;

    #[test]
    fn set_ups_that_are_drawn_are_valid_and_mutation_keeps_what_it_is_told_to() {
        let mut random = Random::new(1, Stream::Training, Purpose::Setup, 0, 0);
        let mut seen = [0_usize; AXES.len()];
        for _ in 0..2000 {
            let setup = Setup::random(&mut random);
            assert!(setup.is_valid() && (2..=MOST_CENTRES).contains(&setup.centres()), "{setup:?}");
            assert!(setup.centres() <= setup.frames());
            let next = setup.mutated(Some(JUDGED), &mut random);
            assert!(next.is_valid() && next.judged_on() == setup.judged_on());
            seen.iter_mut().zip(setup.0).for_each(|(seen, value)| *seen |= 1 << value);
        }
        assert_eq!(seen, AXES.map(|axis| (1 << axis.values.len()) - 1), "every value is drawn");
    }
}
