//! The shape of a touch apart from its strength: inputs of a network that stay the same when one presses harder.
//!
//! With a the change of a reading from its level at rest, w is what of |a| exceeds a threshold, with the sign of a. Where
//! a touch moves readings to one side only, w is what of a exceeds the threshold to that side. The strength of the touch
//! is S = Σ|w| + S₀, and its shape n = w/S. A touch twice as strong has the same shape, so that a linear map of n places
//! it, as a centroid does. Noise on cells that nothing touches stays below the threshold.
//!
//! The inputs are the shape, and then the [logarithm](binary_logarithm) of the strength. Sums are taken in the order of
//! the readings, so that host and device get the same bits.

#[cfg(cortex_m4f)]
use crate::cortex_m4;
use crate::rbf::NetworkError;
use crate::relative::relative;

/// Numbers of a touch before those of single readings, in the unit of the inputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strengths {
    /// S₀, which keeps the shape finite without a touch.
    pub floor: f32,
    /// Number that is added to S before its logarithm: below it, strengths hardly differ.
    pub logarithm_floor: f32,
    /// Least strength of a touch that has a place.
    pub least: f32,
    /// Largest strength that outputs are multiplied by.
    pub most: f32,
    /// 1 or −1 if a touch moves readings up or down, 0 if it moves them either way.
    pub side: f32,
}

/// Number of floats in [`Strengths`].
const HEAD: usize = 5;

/// Number of floats in the block of a frame of so many `readings`.
pub const fn block_floats(readings: usize) -> usize {
    readings.saturating_mul(2).saturating_add(HEAD)
}

/// Relation of a network's outputs to the strength of a touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Outputs are the place of a touch. They are NaN below the least strength, as there is no place without a touch.
    Place,
    /// Outputs are amounts of a touch, such as forces, depths and deformations: the network's outputs times S.
    Amount,
}

/// Transformation of readings to the shape and the strength of a touch, borrowed from a blob.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch<'a> {
    kind: Kind,
    /// The [`Strengths`], and then the level at rest and the threshold of one reading after the other.
    block: &'a [f32],
    /// Found once, because the assembly asks in every frame.
    whole_changes: bool,
}

impl<'a> Touch<'a> {
    /// Makes one of its numbers: those of [`Strengths`] in their order, and then level and threshold of each reading.
    ///
    /// # Errors
    /// [`NetworkError::Empty`] without a reading, [`NetworkError::Length`] for half a reading,
    /// [`NetworkError::NotFinite`] for a number that is NaN or infinite, or negative where it must not be.
    pub fn new(kind: Kind, block: &'a [f32]) -> Result<Self, NetworkError> {
        let (head, of_readings) = block.split_at_checked(HEAD).unwrap_or_default();
        if of_readings.is_empty() {
            return Err(NetworkError::Empty);
        }
        let (pairs, rest) = of_readings.as_chunks::<2>();
        if !rest.is_empty() {
            let (expected, found) = (block.len().saturating_add(1), block.len());
            return Err(NetworkError::Length { what: "touch", expected, found });
        }
        let positive = |value: &f32| value.is_normal() && *value > 0.0;
        let sound = |[level, threshold]: &[f32; 2]| {
            level.is_finite() && threshold.is_finite() && *threshold >= 0.0
        };
        let sides = [-1.0, 0.0, 1.0];
        let (side, strengths) = head.split_last().unwrap_or((&f32::NAN, head));
        let are_sound = strengths.iter().all(positive) && sides.contains(side);
        if !are_sound || !pairs.iter().all(sound) {
            return Err(NetworkError::NotFinite { what: "touch" });
        }
        Ok(Self::of_checked(kind, block))
    }

    /// Makes one of an array in a program, as [`new`](Self::new) takes it. Numbers are not checked.
    ///
    /// # Panics
    /// If it has no reading, or half of one.
    pub const fn of_array(kind: Kind, array: &'a [f32]) -> Self {
        assert!(
            array.len() > HEAD && (array.len() - HEAD).is_multiple_of(2),
            "a touch of half a reading"
        );
        Self::of_checked(kind, array)
    }

    /// Makes one of a block that [`new`](Self::new) has checked before.
    pub(crate) const fn of_checked(kind: Kind, block: &'a [f32]) -> Self {
        let mut touch = Self { kind, block, whole_changes: false };
        let mut without_threshold = true;
        let mut pairs = touch.pairs();
        while let [[_, threshold], rest @ ..] = pairs {
            without_threshold &= *threshold == 0.0;
            pairs = rest;
        }
        touch.whole_changes = without_threshold && touch.strengths().side == 0.0;
        touch
    }

    /// Relation of the network's outputs to the strength.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Whether w is all of a: there is no threshold, and a touch moves readings either way. This costs less.
    pub fn whole_changes(&self) -> bool {
        self.whole_changes
    }

    /// Numbers of the transformation.
    pub fn block(&self) -> &'a [f32] {
        self.block
    }

    /// Number of readings of a frame.
    pub const fn readings(&self) -> usize {
        self.pairs().len()
    }

    /// Number of inputs that it gives the network: one more than readings.
    pub const fn inputs(&self) -> usize {
        self.readings().saturating_add(1)
    }

    /// Numbers before those of single readings.
    pub const fn strengths(&self) -> Strengths {
        let [floor, logarithm_floor, least, most, side] = match self.block.first_chunk::<HEAD>() {
            Some(head) => *head,
            None => [f32::NAN; HEAD],
        };
        Strengths { floor, logarithm_floor, least, most, side }
    }

    /// Level at rest and threshold of one reading after the other.
    pub const fn pairs(&self) -> &'a [[f32; 2]] {
        match self.block.split_at_checked(HEAD) {
            Some((_, pairs)) => pairs.as_chunks::<2>().0,
            None => &[],
        }
    }

    /// Factor of a network's outputs at this `strength`; `None` for places without a touch.
    #[inline(always)]
    pub fn factor(&self, strength: f32) -> Option<f32> {
        match self.kind {
            Kind::Place if strength < self.strengths().least => None,
            Kind::Place => Some(1.0),
            Kind::Amount => {
                let most = self.strengths().most;
                Some(if strength > most { most } else { strength })
            }
        }
    }

    /// Writes shape and logarithm of the strength of a frame to `inputs`, and returns the strength S. `reciprocals` are
    /// those of the baseline, for readings that are to be [relative](crate::relative) to it.
    ///
    /// All inputs and S are NaN if a reading is missing, or lacks a baseline. Inputs beyond their number are not
    /// written.
    #[cfg_attr(cortex_m4f, inline(never))]
    pub fn apply(&self, readings: &[f32], reciprocals: Option<&[f32]>, inputs: &mut [f32]) -> f32 {
        let (shape, rest) = inputs.split_at_mut_checked(self.readings()).unwrap_or_default();
        let strength = self.shape(readings, reciprocals, shape);
        if let Some(last) = rest.first_mut() {
            *last = binary_logarithm(strength + self.strengths().logarithm_floor);
        }
        strength
    }

    /// Writes the shape, and returns the strength.
    #[cfg_attr(
        cortex_m4f,
        expect(unsafe_code, reason = "a call to assembly, whose condition is checked before")
    )]
    fn shape(&self, readings: &[f32], reciprocals: Option<&[f32]>, shape: &mut [f32]) -> f32 {
        let count = self.readings();
        let suits = reciprocals.is_none_or(|of| of.len() == count) && readings.len() == count;
        if !suits || shape.len() != count {
            shape.fill(f32::NAN);
            return f32::NAN;
        }
        #[cfg(cortex_m4f)]
        {
            let Strengths { floor, side, .. } = self.strengths();
            let (pairs, whole) = (self.pairs(), self.whole_changes);
            // SAFETY: the lengths are equal, and not 0, because `new` rejects such a touch.
            unsafe { cortex_m4::touch(pairs, readings, reciprocals, shape, [floor, side], whole) }
        }
        #[cfg(not(cortex_m4f))]
        self.shape_portably(readings, reciprocals, shape)
    }

    /// Writes the shape of as many `readings` as the touch has, and returns the strength, in portable Rust: the compiled
    /// twin of the assembly.
    pub fn shape_portably(
        &self,
        readings: &[f32],
        reciprocals: Option<&[f32]>,
        shape: &mut [f32],
    ) -> f32 {
        let Strengths { floor, side, .. } = self.strengths();
        for (index, (input, reading)) in shape.iter_mut().zip(readings).enumerate() {
            let reciprocal = reciprocals.and_then(|of| of.get(index));
            *input = reciprocal.map_or(*reading, |of| relative(*reading, *of));
        }
        let mut sum = 0.0;
        for (input, [level, threshold]) in shape.iter_mut().zip(self.pairs()) {
            let [twice, signed] = twice_beyond(*input - level, *threshold, side);
            sum += twice;
            *input = signed;
        }
        let strength = 0.5 * sum + floor;
        let scale = 0.5 / strength;
        shape.iter_mut().for_each(|input| *input *= scale);
        strength
    }
}

/// Twice what of a `change` exceeds the `threshold` to this `side`, or to any (0), and the same with the sign of the
/// change.
#[inline(always)]
pub fn twice_beyond(change: f32, threshold: f32, side: f32) -> [f32; 2] {
    if side == 0.0 {
        let twice = twice_positive(change.abs() - threshold);
        [twice, twice.copysign(change)]
    } else {
        [twice_positive(side * change - threshold); 2]
    }
}

/// Twice the positive part of `x`, without a branch or a comparison.
#[inline(always)]
fn twice_positive(x: f32) -> f32 {
    x + x.abs()
}

/// Binary logarithm of a positive normal number within 0.008, without a table or a division: the exponent's bits, and a
/// parabola for the fraction. It is continuous and rises everywhere. The result for other numbers is not defined, but
/// NaN for NaN.
///
/// ```
/// use taxel_core::touch::binary_logarithm;
/// assert_eq!([1.0, 8.0, 0.25].map(binary_logarithm), [0.0, 3.0, -2.0]);
/// assert!((binary_logarithm(3.0) - 3.0_f32.log2()).abs() < 0.008);
/// ```
pub fn binary_logarithm(x: f32) -> f32 {
    const FRACTION: u32 = 0x007F_FFFF;
    /// Excess of the logarithm over a straight line, at most, over that of f·(1 − f).
    const BEND: f32 = 0.344_7;
    let bits = x.to_bits();
    let exponent = (bits >> 23) as f32 - 127.0;
    let fraction = f32::from_bits((bits & FRACTION) | 0x3F80_0000) - 1.0;
    let line = exponent + fraction;
    let logarithm = line + BEND * fraction * (1.0 - fraction);
    // NaN has an exponent as well.
    logarithm + 0.0 * x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_touch_twice_as_strong_has_the_same_shape() {
        // Levels 10 and 20 and 30 with thresholds 1.
        let block = [1e-6, 1e-6, 0.5, 100.0, 0.0, 10.0, 1.0, 20.0, 1.0, 30.0, 1.0];
        let touch = Touch::new(Kind::Place, &block).unwrap();
        assert_eq!((touch.readings(), touch.inputs()), (3, 4));
        let (mut one, mut two) = ([0.0; 4], [0.0; 4]);
        let strength = touch.apply(&[13.0, 15.0, 30.9], None, &mut one);
        assert!((strength - 6.0).abs() < 1e-4, "2 and 4 beyond the threshold: {strength}");
        assert!((touch.apply(&[15.0, 11.0, 29.1], None, &mut two) - 12.0).abs() < 1e-4);
        for (found, expected) in one.iter().zip([2.0 / 6.0, -4.0 / 6.0, 0.0, 6_f32.log2()]) {
            assert!((found - expected).abs() < 0.008, "{one:?}");
        }
        assert_eq!((one[2], two[2]), (0.0, 0.0), "noise stays below the threshold");
        assert!((two[3] - one[3] - 1.0).abs() < 1e-5, "{one:?} {two:?}");
        assert!((two[0] - one[0]).abs() < 1e-6 && (two[1] - one[1]).abs() < 1e-6);
    }

    #[test]
    fn a_touch_to_one_side_leaves_the_other_out() {
        for (side, expected) in [(1.0, [1.0, 0.0]), (-1.0, [0.0, 1.0])] {
            let block = [1e-9, 1e-6, 0.5, 100.0, side, 10.0, 1.0, 20.0, 1.0];
            let mut inputs = [0.0; 3];
            let touch = Touch::new(Kind::Place, &block).unwrap();
            assert_eq!(touch.apply(&[13.0, 15.0], None, &mut inputs), 3.0 - side);
            assert_eq!(inputs[..2], expected);
        }
    }

    #[test]
    fn a_missing_reading_leaves_neither_shape_nor_strength() {
        let block = [1e-6, 1e-6, 0.5, 100.0, 0.0, 1.0, 0.0, 1.0, 0.0];
        let touch = Touch::new(Kind::Amount, &block).unwrap();
        let mut inputs = [0.0; 3];
        assert!(touch.apply(&[2.0, f32::NAN], None, &mut inputs).is_nan());
        assert!(inputs.iter().all(|input| input.is_nan()));
        assert!(touch.apply(&[2.0], None, &mut inputs).is_nan());
        assert!(touch.apply(&[2.0, 2.0], Some(&[1.0, f32::NAN]), &mut inputs).is_nan());
        assert!(!touch.apply(&[2.0, 2.0], Some(&[1.0, 0.5]), &mut inputs).is_nan());
    }

    #[test]
    fn a_block_that_is_none_is_refused() {
        let refused = |block: &[f32]| Touch::new(Kind::Place, block).unwrap_err();
        assert_eq!(refused(&[1.0; 5]), NetworkError::Empty);
        let length = NetworkError::Length { what: "touch", expected: 9, found: 8 };
        assert_eq!(refused(&[1.0; 8]), length);
        for (place, wrong) in
            [(0, 0.0), (2, -1.0), (3, f32::NAN), (4, 0.5), (5, f32::INFINITY), (6, -1.0)]
        {
            let mut block = [1.0; 7];
            block[place] = wrong;
            assert_eq!(refused(&block), NetworkError::NotFinite { what: "touch" }, "{place}");
        }
    }

    #[test]
    fn the_logarithm_rises_and_is_near_the_true_one() {
        let mut last = f32::NEG_INFINITY;
        for step in 0..40_000_u16 {
            let x = (f32::from(step) * 1e-3 - 20.0).exp2();
            let found = binary_logarithm(x);
            assert!((found - x.log2()).abs() < 0.008 && found >= last, "{x} {found}");
            last = found;
        }
        assert!(binary_logarithm(f32::NAN).is_nan());
    }
}
