//! Reading model: the statistics of a sensor's readings, which fill those that are missing, find frames that are novel,
//! and tell how far off outputs may be.
//!
//! Readings move together: a press changes many at once. Factor analysis describes that by a few common factors (Lawley
//! and Maxwell, *Factor analysis as a statistical method*, 1971): r = m + L·f + noise of each reading's own, with standard
//! normal f. With s one over each reading's own noise, z = (r − m)·s are standardised readings, and V their parts in the
//! factors, turned so that I − VVᵀ is the inverse of the covariance of z.
//!
//! - **Filling.** For readings M that are missing and O that are there,
//!
//!   > E\[z_M | z_O\] = V_M·(I − V_Mᵀ·V_M)⁻¹·V_Oᵀ·z_O.
//!
//! - **Novelty.** The features of a frame are its scores Vᵀz and its distance √(‖z‖² − ‖Vᵀz‖²) from all frames that the
//!   factors explain. A mixture of Gaussians describes them (Bishop, "Novelty detection and neural network validation",
//!   IEE Proc. Vis. Image Signal Process. 141, 1994): ln π_k·N(f | μ_k, Σ_k) = c_k − ½‖W_k·f − o_k‖². Novelty is −ln p(f)
//!   minus its threshold, in nats: above 0, the frame is less probable than nearly all frames of training.
//! - **Deviation** of an output: √(Σ_k γ_k·v_k), with v_k its mean squared error on frames of component k, calibrated, and
//!   γ_k the component's probability given f. Components below [`LEAST_PROBABILITY`] of the most probable one do not count.
//!
//! It knows nothing of the networks, and decodes nothing: estimates are the same bits with it and without.
//! `docs/reading-model.md` has what it finds and what it costs.

use crate::exp::exp;
use crate::projection::{self, Projection};
use crate::rbf::NetworkError;
use crate::relative::relative;

/// Share of a frame's readings that may be missing: one in so many. If more are, they are not filled.
pub const MOST_MISSING: usize = 4;

/// Probability of a component, relative to the most probable one, below which it counts for no deviation.
pub const LEAST_PROBABILITY: f32 = 1.0 / 64.0;

/// Sizes of a [`ReadingModel`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sizes {
    /// Number of readings in a frame.
    pub readings: usize,
    /// Number of factors. Features are one more.
    pub factors: usize,
    /// Number of components of the mixture; 0 for a model that only fills missing readings.
    pub components: usize,
    /// Number of outputs of all rows.
    pub outputs: usize,
}

impl Sizes {
    /// Number of features: the scores of a frame in the factors, and its distance from what they explain.
    pub const fn features(self) -> usize {
        self.factors.saturating_add(1)
    }

    /// Number of floats of a component: c, −o, and W column after column.
    pub const fn component_floats(self) -> usize {
        projection::block_floats(self.features(), self.features()).saturating_add(1)
    }

    /// Number of floats of working space that [`ReadingModel::assess`] and [`ReadingModel::fill`] need.
    pub const fn scratch_floats(self) -> usize {
        let assessing = self.features().saturating_add(self.components);
        let filling = triangle(self.factors);
        let more = if assessing > filling { assessing } else { filling };
        self.readings.saturating_add(self.features()).saturating_add(more)
    }

    /// Number of floats in the block.
    pub const fn block_floats(self) -> usize {
        let scale = self.readings.saturating_mul(2);
        let factors = projection::block_floats(self.readings, self.factors);
        let all = scale.saturating_add(factors);
        if self.components == 0 {
            return all;
        }
        let mixture = self.components.saturating_mul(self.component_floats());
        let outputs = self.components.saturating_add(1).saturating_mul(self.outputs);
        all.saturating_add(mixture).saturating_add(outputs).saturating_add(1)
    }
}

/// Reading model, borrowed from a blob.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReadingModel<'a> {
    sizes: Sizes,
    block: &'a [f32],
}

/// The arrays of a block, in their order.
#[derive(Debug, Clone, Copy, Default)]
struct Arrays<'a> {
    mean: &'a [f32],
    scale: &'a [f32],
    /// A zero for each factor, then V of every factor for one reading after the other.
    projection: &'a [f32],
    /// c, −o of every feature, and W column after column, for one component after the other.
    mixture: &'a [f32],
    /// v of every output, for one component after the other.
    variances: &'a [f32],
    /// Half of an output's 95 % interval, in deviations.
    ratios_95: &'a [f32],
    threshold: f32,
}

impl<'a> Arrays<'a> {
    fn cut(sizes: Sizes, block: &'a [f32]) -> Option<Self> {
        let Sizes { readings, factors, components, outputs } = sizes;
        let (mean, rest) = block.split_at_checked(readings)?;
        let (scale, rest) = rest.split_at_checked(readings)?;
        let (projection, rest) =
            rest.split_at_checked(projection::block_floats(readings, factors))?;
        let factors = Self { mean, scale, projection, ..Self::default() };
        if components == 0 {
            return rest.is_empty().then_some(factors);
        }
        let mixed = components.checked_mul(sizes.component_floats())?;
        let (mixture, rest) = rest.split_at_checked(mixed)?;
        let (variances, rest) = rest.split_at_checked(components.checked_mul(outputs)?)?;
        let (ratios_95, rest) = rest.split_at_checked(outputs)?;
        let [threshold] = *rest else { return None };
        Some(Self { mixture, variances, ratios_95, threshold, ..factors })
    }
}

impl<'a> ReadingModel<'a> {
    /// Makes a reading model of a block, whose arrays are in this order: m of every reading, in its unit; s of every
    /// reading, one over its unit, and 0 for a reading that never changed; a zero for each factor; V of every factor for
    /// one reading after the other. With components, there follow c, −o of every feature, and W column after column for
    /// one component after the other; v of every output (in its unit, squared) for one component after the other; half
    /// the 95 % interval of every output, in deviations; the threshold of −ln p(f).
    ///
    /// # Errors
    /// [`NetworkError::Empty`] without readings, factors or outputs, [`NetworkError::Length`] for a block of another
    /// length, [`NetworkError::NotFinite`] for a number that is NaN or infinite, or variances whose sum may be,
    /// [`NetworkError::NotPositive`] for a scale, variance or ratio that is negative, or parts V of a reading whose
    /// squares sum up to 1 or more.
    pub fn new(sizes: Sizes, block: &'a [f32]) -> Result<Self, NetworkError> {
        const WHAT: &str = "reading model";
        if [sizes.readings, sizes.factors, sizes.outputs].contains(&0) {
            return Err(NetworkError::Empty);
        }
        let (expected, found) = (sizes.block_floats(), block.len());
        let length = NetworkError::Length { what: WHAT, expected, found };
        if expected != found {
            return Err(length);
        }
        let arrays = Arrays::cut(sizes, block).ok_or(length)?;
        let most = f32::MAX / sizes.components.max(1) as f32;
        let is_finite = |value: &f32| value.is_finite();
        if !block.iter().all(is_finite) || arrays.variances.iter().any(|v| *v > most) {
            return Err(NetworkError::NotFinite { what: WHAT });
        }
        let model = Self { sizes, block };
        let mut not_negative = [arrays.scale, arrays.variances, arrays.ratios_95].into_iter();
        let mut channels = model.channels();
        let is_sound = |parts: &[f32]| parts.iter().map(|part| part * part).sum::<f32>() < 1.0;
        if not_negative.all(|values| values.iter().all(|value| *value >= 0.0))
            && channels.all(|(_, _, parts)| is_sound(parts))
        {
            Ok(model)
        } else {
            Err(NetworkError::NotPositive { what: WHAT })
        }
    }

    /// Makes a reading model of an array in a program, as [`new`](Self::new) takes it. Numbers are not checked.
    ///
    /// # Panics
    /// If the array has another length.
    pub const fn of_array(sizes: Sizes, array: &'a [f32]) -> Self {
        assert!(array.len() == sizes.block_floats(), "a reading model of another length");
        Self::of_checked(sizes, array)
    }

    /// Makes a reading model of a block that [`new`](Self::new) has checked before, or will.
    pub(crate) const fn of_checked(sizes: Sizes, block: &'a [f32]) -> Self {
        Self { sizes, block }
    }

    /// The model's sizes.
    pub const fn sizes(&self) -> Sizes {
        self.sizes
    }

    /// The model's numbers, as [`new`](Self::new) takes them.
    pub const fn block(&self) -> &'a [f32] {
        self.block
    }

    /// Whether the model estimates novelty and deviations, besides filling missing readings.
    pub const fn assesses(&self) -> bool {
        self.sizes.components > 0
    }

    /// Half of each output's 95 % interval, in deviations; half of its 68 % interval is one deviation. Empty if the model
    /// estimates no deviations.
    pub fn ratios_95(&self) -> &'a [f32] {
        self.arrays().ratios_95
    }

    /// m, s and the parts V of every reading.
    pub fn channels(&self) -> impl Iterator<Item = (f32, f32, &'a [f32])> {
        let Arrays { mean, scale, projection, .. } = self.arrays();
        let parts = projection.chunks_exact(self.sizes.factors.max(1)).skip(1);
        mean.iter().zip(scale).zip(parts).map(|((mean, scale), parts)| (*mean, *scale, parts))
    }

    fn arrays(&self) -> Arrays<'a> {
        Arrays::cut(self.sizes, self.block).unwrap_or_default()
    }

    /// Replaces missing readings (not finite) of a frame by those expected from the others, in their unit. Returns the
    /// number of readings that were filled.
    ///
    /// For a model with relative inputs, `reciprocals` are those of the baseline, and a reading without one stays as it is.
    /// `scratch` is working space of [`scratch_floats`](Sizes::scratch_floats). Nothing is filled if none is missing, if
    /// more than one in [`MOST_MISSING`] is, or if a slice is too short.
    ///
    /// ```
    /// use taxel_core::reading_model::{ReadingModel, Sizes};
    /// // Four readings near 60 Ω, with noise of 0.1 Ω, that move together by 3 Ω.
    /// let part = 3.0 / f32::sqrt(4.0 * 9.0 + 0.01);
    /// let sizes = Sizes { readings: 4, factors: 1, components: 0, outputs: 1 };
    /// let block = [&[60.0; 4][..], &[10.0; 4], &[0.0], &[part; 4]].concat();
    /// let model = ReadingModel::new(sizes, &block)?;
    /// let mut frame = [63.0, f32::NAN, 63.0, 63.0];
    /// assert_eq!(model.fill(&mut frame, None, &mut [0.0; 7]), 1);
    /// assert!((frame[1] - 63.0).abs() < 0.01);
    /// # Ok::<(), taxel_core::rbf::NetworkError>(())
    /// ```
    pub fn fill(
        &self,
        readings: &mut [f32],
        reciprocals: Option<&[f32]>,
        scratch: &mut [f32],
    ) -> usize {
        let Some([z, factors, matrix]) =
            cut_scratch(self.sizes, scratch, triangle(self.sizes.factors))
        else {
            return 0;
        };
        if readings.len() != self.sizes.readings || readings.iter().all(|it| it.is_finite()) {
            return 0;
        }
        self.standardise(readings, reciprocals, z);
        let missing = z.iter().filter(|z| !z.is_finite()).count();
        let few = missing.saturating_mul(MOST_MISSING) <= self.sizes.readings;
        let Some((_, factors)) = factors.split_last_mut().filter(|_| few) else { return 0 };
        self.equations(z, matrix);
        let projection = self.arrays().projection;
        Projection::of_checked(self.sizes.factors, projection).project(z, factors);
        if !solve(matrix, factors) {
            return 0;
        }
        let mut filled = 0_usize;
        for (at, (reading, (mean, scale, parts))) in
            readings.iter_mut().zip(self.channels()).enumerate()
        {
            if !reading.is_finite() {
                let moved = if scale > 0.0 { product(parts, factors) / scale } else { 0.0 };
                let of_input = reciprocals.map_or(1.0, |all| at_place(all, at));
                let expected = (mean + moved) / of_input;
                if expected.is_finite() {
                    *reading = expected;
                    filled = filled.saturating_add(1);
                }
            }
        }
        filled
    }

    /// Writes the deviation of every output (in its unit) to `deviation`, and returns the frame's novelty in nats; `None`
    /// if the model estimates neither, and nothing is written then.
    ///
    /// `readings` are those of the whole frame in the model's unit, as many as the sizes say; a model with relative inputs
    /// takes the `reciprocals` of the baseline, too. If a reading is missing (NaN, or infinite where training saw no
    /// change), all results are NaN. A frame so far from all of training that its density leaves f32 has the novelty
    /// [`f32::MAX`], and NaN for deviations.
    ///
    /// # Errors
    /// [`NetworkError::Length`] if there are not as many `readings` or places of `deviation` as the sizes say, or `scratch`
    /// is shorter than [`scratch_floats`](Sizes::scratch_floats); nothing is written then.
    pub fn assess(
        &self,
        readings: &[f32],
        reciprocals: Option<&[f32]>,
        scratch: &mut [f32],
        deviation: &mut [f32],
    ) -> Result<Option<f32>, NetworkError> {
        let Sizes { readings: count, components, outputs, .. } = self.sizes;
        let length = |what, expected, found| NetworkError::Length { what, expected, found };
        if !self.assesses() {
            return Ok(None);
        }
        if readings.len() != count {
            return Err(length("frame", count, readings.len()));
        }
        if deviation.len() != outputs {
            return Err(length("deviation", outputs, deviation.len()));
        }
        let too_short = length("scratch", self.sizes.scratch_floats(), scratch.len());
        let size = self.sizes.features().saturating_add(components);
        let [z, features, rest] = cut_scratch(self.sizes, scratch, size).ok_or(too_short)?;
        let (whitened, densities) =
            rest.split_at_mut_checked(self.sizes.features()).ok_or(too_short)?;
        let missing = !self.features(readings, reciprocals, z, features);
        let best = if missing { f32::NAN } else { self.densities(features, whitened, densities) };
        if !best.is_finite() {
            deviation.fill(f32::NAN);
            return Ok(Some(if missing { f32::NAN } else { f32::MAX }));
        }
        let mut sum = 0.0;
        for density in densities.iter_mut() {
            *density = exp(*density - best);
            sum += *density;
        }
        let Arrays { variances, threshold, .. } = self.arrays();
        deviations(densities, variances, deviation);
        Ok(Some((-(best + libm::logf(sum)) - threshold).clamp(f32::MIN, f32::MAX)))
    }

    /// Writes the [features](Sizes::features) of a frame, as [`assess`](Self::assess) computes them: training needs the
    /// very same bits.
    ///
    /// `z` takes the standardised readings. Returns whether no reading is missing (NaN, or infinite where s is 0).
    pub fn features(
        &self,
        readings: &[f32],
        reciprocals: Option<&[f32]>,
        z: &mut [f32],
        features: &mut [f32],
    ) -> bool {
        let square = self.standardise(readings, reciprocals, z);
        let Some((distance, scores)) = features.split_last_mut() else { return false };
        let projection = self.arrays().projection;
        Projection::of_checked(self.sizes.factors, projection).project(z, scores);
        let explained = scores.iter().map(|score| score * score).sum::<f32>();
        *distance = sqrt((square - explained).max(0.0));
        !square.is_nan()
    }

    /// Writes the standardised readings, and returns the sum of their squares.
    fn standardise(&self, readings: &[f32], reciprocals: Option<&[f32]>, z: &mut [f32]) -> f32 {
        let Arrays { mean, scale, .. } = self.arrays();
        let mut square = 0.0;
        let places = z.iter_mut().zip(readings).zip(mean.iter().zip(scale));
        for (at, ((z, reading), (mean, scale))) in places.enumerate() {
            let input = reciprocals.map_or(*reading, |all| relative(*reading, at_place(all, at)));
            *z = (input - mean) * scale;
            square += *z * *z;
        }
        square
    }

    /// Writes ln π_k·N(f | μ_k, Σ_k) of every component; returns the largest, or what is not finite if it leaves f32.
    fn densities(&self, features: &[f32], whitened: &mut [f32], densities: &mut [f32]) -> f32 {
        let size = self.sizes.component_floats();
        let components = self.arrays().mixture.chunks_exact(size.max(1));
        let mut best = f32::NEG_INFINITY;
        for (place, component) in densities.iter_mut().zip(components) {
            let Some((constant, whitening)) = component.split_first() else { continue };
            Projection::of_checked(self.sizes.features(), whitening).project(features, whitened);
            let distance = whitened.iter().map(|it| it * it).sum::<f32>();
            *place = constant - 0.5 * distance;
            // Not `max`, which passes NaN over.
            if place.is_nan() || *place > best {
                best = *place;
            }
        }
        best
    }

    /// Writes the lower triangle of I − V_Mᵀ·V_M, row after row, and 0 for those of `z` that are missing.
    fn equations(&self, z: &mut [f32], matrix: &mut [f32]) {
        matrix.fill(0.0);
        for row in 0..self.sizes.factors {
            if let Some(diagonal) = matrix.get_mut(triangle(row).saturating_add(row)) {
                *diagonal = 1.0;
            }
        }
        for (z, (_, _, parts)) in z.iter_mut().zip(self.channels()).filter(|(z, _)| !z.is_finite())
        {
            *z = 0.0;
            let mut places = matrix.iter_mut();
            for (row, part) in parts.iter().enumerate() {
                let places = places.by_ref().zip(parts).take(row.saturating_add(1));
                places.for_each(|(place, other)| *place -= part * other);
            }
        }
    }
}

/// Cuts the working space into standardised readings, features, and so many floats `more`.
fn cut_scratch(sizes: Sizes, scratch: &mut [f32], more: usize) -> Option<[&mut [f32]; 3]> {
    let (z, rest) = scratch.split_at_mut_checked(sizes.readings)?;
    let (features, rest) = rest.split_at_mut_checked(sizes.features())?;
    Some([z, features, rest.get_mut(..more)?])
}

/// Reciprocal of the baseline of one reading; NaN without one.
fn at_place(reciprocals: &[f32], at: usize) -> f32 {
    reciprocals.get(at).copied().unwrap_or(f32::NAN)
}

/// Writes √(Σ γ·v) of every output, over the components that are probable. The most probable one has the number 1.
fn deviations(probabilities: &[f32], variances: &[f32], deviation: &mut [f32]) {
    deviation.fill(0.0);
    let mut sum = 0.0;
    let of_components = variances.chunks_exact(deviation.len().max(1));
    for (probability, variances) in probabilities.iter().zip(of_components) {
        if *probability >= LEAST_PROBABILITY {
            sum += probability;
            deviation.iter_mut().zip(variances).for_each(|(to, of)| *to += probability * of);
        }
    }
    deviation.iter_mut().for_each(|variance| *variance = sqrt(*variance / sum));
}

/// Number of floats in the lower triangle of a matrix of so many rows.
const fn triangle(rows: usize) -> usize {
    rows.saturating_mul(rows.saturating_add(1)) / 2
}

/// Row of a lower triangle, which has one number more than its index.
fn row_of(triangle_rows: &[f32], row: usize) -> &[f32] {
    let start = triangle(row);
    triangle_rows.get(start..start.saturating_add(row).saturating_add(1)).unwrap_or_default()
}

fn product(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b)
}

/// Solves the equations of a positive definite `matrix`, given by its lower triangle, for the right-hand side in `x`, by
/// Cholesky's decomposition. Returns whether the matrix is positive definite in f32.
fn solve(matrix: &mut [f32], x: &mut [f32]) -> bool {
    let size = x.len();
    for row in 0..size {
        let (before, this) = matrix.split_at_mut_checked(triangle(row)).unwrap_or_default();
        let Some(this) = this.get_mut(..=row) else { return false };
        for column in 0..row {
            let other = row_of(before, column);
            let (known, rest) = this.split_at_mut_checked(column).unwrap_or_default();
            let (Some(place), Some(diagonal)) = (rest.first_mut(), other.last()) else {
                return false;
            };
            *place = (*place - product(known, other)) / diagonal;
        }
        let Some((diagonal, known)) = this.split_last_mut() else { return false };
        let left = *diagonal - product(known, known);
        if left.is_nan() || left <= 0.0 {
            return false;
        }
        *diagonal = sqrt(left);
        let (solved, rest) = x.split_at_mut_checked(row).unwrap_or_default();
        let Some(place) = rest.first_mut() else { return false };
        *place = (*place - product(known, solved)) / *diagonal;
    }
    for row in (0..size).rev() {
        let this = row_of(matrix, row);
        let (earlier, rest) = x.split_at_mut_checked(row).unwrap_or_default();
        let (Some(place), Some((diagonal, parts))) = (rest.first_mut(), this.split_last()) else {
            return false;
        };
        *place /= *diagonal;
        earlier.iter_mut().zip(parts).for_each(|(x, part)| *x -= part * *place);
    }
    true
}

/// Square root, rounded correctly.
pub(crate) fn sqrt(value: f32) -> f32 {
    #[cfg(cortex_m4f)]
    return crate::cortex_m4::sqrt(value);
    #[cfg(not(cortex_m4f))]
    return libm::sqrtf(value);
}

#[cfg(test)]
mod tests;
