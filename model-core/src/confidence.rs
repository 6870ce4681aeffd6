//! Confidence: how far off a frame's outputs may be, and how novel the frame is.
//!
//! A mixture of Gaussians describes the frames of training: the classic density model for novelty (Bishop, "Novelty
//! detection and neural network validation", IEE Proc. Vis. Image Signal Process. 141, 1994). Readings r are
//! standardised to z = (r − m)·s. Features are f = Σ_j z_j·p_j along orthonormal directions p, and one more: the length
//! √(‖z‖² − ‖f‖²) of what they leave out. For component k, ln π_k·N(f | μ_k, Σ_k) = c_k − ½‖W_k·f − o_k‖², with W_k the
//! inverse of Σ_k's Cholesky factor and o_k = W_k·μ_k.
//!
//! - **Novelty** is −ln p(f) minus its threshold, in nats: above 0, the frame is less probable than nearly all frames of
//!   training.
//! - The **deviation** of an output is √(Σ_k γ_k·v_k): v_k is the output's mean squared error on frames of component k,
//!   calibrated, and γ_k the component's probability given f. Of the components, the [`MOST_PROBABLE`] count.
//!
//! It knows nothing of the networks, and decodes nothing: estimates are the same bits with it and without.
//! `docs/confidence.md` has what it finds and what it costs.

#[cfg(cortex_m4f)]
use crate::cortex_m4;
use crate::exp::exp;
use crate::projection::{self, Projection};
use crate::rbf::NetworkError;

/// Number of components that deviations are formed of: the most probable ones.
pub const MOST_PROBABLE: usize = 4;

/// Nats below the most probable component from which another one does not count: all of them together are below what
/// an f32 resolves.
const NEGLIGIBLE: f32 = 24.0;

/// Sizes of a [`Confidence`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sizes {
    /// Number of readings in a frame.
    pub readings: usize,
    /// Number of directions that readings are projected to, at most the number of readings. Features are one more.
    pub directions: usize,
    /// Number of components of the mixture.
    pub components: usize,
    /// Number of outputs of all rows.
    pub outputs: usize,
}

impl Sizes {
    /// Number of features: the directions, and what they leave out.
    pub const fn features(self) -> usize {
        self.directions.saturating_add(1)
    }

    const fn component_floats(self) -> usize {
        component_floats(self.features())
    }

    /// Number of floats of working space that [`Confidence::assess`] needs.
    pub const fn scratch_floats(self) -> usize {
        self.readings.saturating_add(self.features()).saturating_add(self.components)
    }

    /// Number of floats in the block.
    pub const fn block_floats(self) -> usize {
        let scale = self.readings.saturating_mul(2);
        let projection = projection::block_floats(self.readings, self.directions);
        let mixture = self.components.saturating_mul(self.component_floats());
        let outputs = self.components.saturating_add(1).saturating_mul(self.outputs);
        let all = scale.saturating_add(projection).saturating_add(mixture);
        all.saturating_add(outputs).saturating_add(1)
    }
}

/// Number of floats that a component of so many `features` takes: c, o and W.
const fn component_floats(features: usize) -> usize {
    let triangle = features.saturating_mul(features.saturating_add(1)) / 2;
    features.saturating_add(1).saturating_add(triangle)
}

/// Confidence of a model, borrowed from a blob.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Confidence<'a> {
    sizes: Sizes,
    block: &'a [f32],
}

/// The arrays of a block, in their order.
#[derive(Debug, Clone, Copy, Default)]
struct Arrays<'a> {
    mean: &'a [f32],
    scale: &'a [f32],
    /// A zero for each direction, then p of every direction for one reading after the other.
    projection: &'a [f32],
    /// c, o and the rows of the lower triangle W, for one component after the other.
    mixture: &'a [f32],
    /// v of every output, for one component after the other.
    variances: &'a [f32],
    /// Half of an output's 95 % interval, in deviations.
    ratios_95: &'a [f32],
    threshold: f32,
}

impl<'a> Arrays<'a> {
    fn cut(sizes: Sizes, block: &'a [f32]) -> Option<Self> {
        let Sizes { readings, directions, components, outputs } = sizes;
        let (mean, rest) = block.split_at_checked(readings)?;
        let (scale, rest) = rest.split_at_checked(readings)?;
        let projected = projection::block_floats(readings, directions);
        let (projection, rest) = rest.split_at_checked(projected)?;
        let mixed = components.checked_mul(sizes.component_floats())?;
        let (mixture, rest) = rest.split_at_checked(mixed)?;
        let (variances, rest) = rest.split_at_checked(components.checked_mul(outputs)?)?;
        let (ratios_95, rest) = rest.split_at_checked(outputs)?;
        let [threshold] = *rest else { return None };
        Some(Self { mean, scale, projection, mixture, variances, ratios_95, threshold })
    }
}

impl<'a> Confidence<'a> {
    /// Makes a confidence of a block, whose arrays are in this order: m and s of every reading; a zero for each
    /// direction, then p of every direction for one reading after the other; c, o and the rows of the lower triangle W
    /// for one component after the other; v of every output (in its unit, squared) for one component after the other;
    /// half the 95 % interval of every output, in deviations; the threshold of −ln p(f).
    ///
    /// # Errors
    /// [`NetworkError::Empty`] if a size is 0, [`NetworkError::Length`] for a block of another length,
    /// [`NetworkError::NotFinite`] for a number that is NaN or infinite, [`NetworkError::NotPositive`] for a scale,
    /// variance or ratio that is negative, or a diagonal of W that is not positive.
    pub fn new(sizes: Sizes, block: &'a [f32]) -> Result<Self, NetworkError> {
        let Sizes { readings, directions, components, outputs } = sizes;
        if [readings, directions, components, outputs].contains(&0) {
            return Err(NetworkError::Empty);
        }
        let (what, expected, found) = ("confidence", sizes.block_floats(), block.len());
        let length = NetworkError::Length { what, expected, found };
        if expected != found {
            return Err(length);
        }
        if directions > readings {
            let (what, expected, found) = ("directions", readings, directions);
            return Err(NetworkError::Length { what, expected, found });
        }
        if !block.iter().all(|value| value.is_finite()) {
            return Err(NetworkError::NotFinite { what });
        }
        let arrays = Arrays::cut(sizes, block).ok_or(length)?;
        // So that no sum of variances leaves f32.
        if arrays.variances.iter().any(|v| *v > f32::MAX / MOST_PROBABLE as f32) {
            return Err(NetworkError::NotFinite { what });
        }
        let mut not_negative = [arrays.scale, arrays.variances, arrays.ratios_95].into_iter();
        let usable = |values: &[f32]| values.iter().all(|value| *value >= 0.0);
        let mut components = arrays.mixture.chunks_exact(sizes.component_floats());
        let positive = |component: &[f32]| {
            triangle(sizes.features(), component)
                .all(|row| row.last().is_some_and(|last| *last > 0.0))
        };
        if !not_negative.all(usable) || !components.all(positive) {
            return Err(NetworkError::NotPositive { what });
        }
        Ok(Self { sizes, block })
    }

    /// Makes a confidence of an array in a program, as [`new`](Self::new) takes it. Numbers are not looked at.
    ///
    /// # Panics
    /// If the array has another length.
    pub const fn of_array(sizes: Sizes, array: &'a [f32]) -> Self {
        assert!(array.len() == sizes.block_floats(), "a confidence of another length");
        Self::of_checked(sizes, array)
    }

    /// Makes a confidence of a block that [`new`](Self::new) has checked before.
    pub(crate) const fn of_checked(sizes: Sizes, block: &'a [f32]) -> Self {
        Self { sizes, block }
    }

    /// The confidence's sizes.
    pub const fn sizes(&self) -> Sizes {
        self.sizes
    }

    /// The confidence's numbers, as [`new`](Self::new) takes them.
    pub fn block(&self) -> &'a [f32] {
        self.block
    }

    /// Half of each output's 95 % interval, in deviations. Half of its 68 % interval is one deviation.
    pub fn ratios_95(&self) -> &'a [f32] {
        self.arrays().ratios_95
    }

    fn arrays(&self) -> Arrays<'a> {
        Arrays::cut(self.sizes, self.block).unwrap_or_default()
    }

    /// Writes the deviation of every output (in its unit) to `deviation`, and returns the frame's novelty in nats.
    ///
    /// `readings` are those of the whole frame in the model's unit, or relative to the baseline for a model that takes
    /// them so: as many as the sizes say. If one is missing (NaN, or infinite where training saw no change), all results
    /// are NaN. A frame so far from all of training that its density
    /// leaves f32 has the novelty [`f32::MAX`], and NaN for deviations.
    ///
    /// # Errors
    /// [`NetworkError::Length`] if `deviation` is not as long as there are outputs, or `scratch` shorter than
    /// [`scratch_floats`](Sizes::scratch_floats); nothing is written then.
    pub fn assess(
        &self,
        readings: impl Iterator<Item = f32>,
        scratch: &mut [f32],
        deviation: &mut [f32],
    ) -> Result<f32, NetworkError> {
        let Sizes { readings: count, components, outputs, .. } = self.sizes;
        let length = |what, expected, found| NetworkError::Length { what, expected, found };
        if deviation.len() != outputs {
            return Err(length("deviation", outputs, deviation.len()));
        }
        let (expected, found) = (self.sizes.scratch_floats(), scratch.len());
        let too_short = length("scratch", expected, found);
        let (z, rest) = scratch.split_at_mut_checked(count).ok_or(too_short)?;
        let (features, rest) = rest.split_at_mut_checked(self.sizes.features()).ok_or(too_short)?;
        let densities = rest.get_mut(..components).ok_or(too_short)?;
        let arrays = self.arrays();
        let scaling = [arrays.mean, arrays.scale];
        let missing = !project(readings, scaling, arrays.projection, z, features);
        let best = if missing { f32::NAN } else { self.densities(features, densities) };
        if !best.is_finite() {
            deviation.fill(f32::NAN);
            return Ok(if missing { f32::NAN } else { f32::MAX });
        }
        let mut sum = 0.0;
        for density in densities.iter_mut() {
            *density = exp(*density - best);
            sum += *density;
        }
        deviations(densities, arrays.variances, deviation);
        Ok((-(best + libm::logf(sum)) - arrays.threshold).clamp(f32::MIN, f32::MAX))
    }

    /// Writes ln π_k·N(f | μ_k, Σ_k) of every component; returns the largest, or what is not finite if it leaves f32.
    fn densities(&self, features: &[f32], densities: &mut [f32]) -> f32 {
        let arrays = self.arrays();
        let size = self.sizes.component_floats().max(1);
        let mut best = f32::NEG_INFINITY;
        for (place, component) in densities.iter_mut().zip(arrays.mixture.chunks_exact(size)) {
            let density = density(component, features, best - NEGLIGIBLE);
            *place = density;
            // Not `max`, which passes NaN over.
            if density.is_nan() || density > best {
                best = density;
            }
        }
        best
    }
}

/// Writes the features of a frame, as [`Confidence::assess`] computes them: training needs the very same bits.
///
/// `z` takes the standardised readings. `scaling` is m and s of every reading, `projection` the zeros and p of a
/// [block](Confidence::new). Returns whether no reading is missing (NaN, or infinite where s is 0).
pub fn project(
    readings: impl Iterator<Item = f32>,
    [mean, scale]: [&[f32]; 2],
    projection: &[f32],
    z: &mut [f32],
    features: &mut [f32],
) -> bool {
    let mut square = 0.0;
    let places = z.iter_mut().zip(readings).zip(mean.iter().zip(scale));
    for ((z, reading), (mean, scale)) in places {
        *z = (reading - mean) * scale;
        square += *z * *z;
    }
    let Some((left_out, directions)) = features.split_last_mut() else { return false };
    Projection::of_checked(directions.len(), projection).project(z, directions);
    let along = directions.iter().map(|value| value * value).sum::<f32>();
    *left_out = sqrt((square - along).max(0.0));
    !square.is_nan()
}

/// ln π·N(f | μ, Σ) of a `component` that fits the `features`; NaN of one that does not. If it is below `floor`, the
/// result may be any number below `floor`.
#[cfg_attr(
    cortex_m4f,
    expect(unsafe_code, reason = "a call to assembly, whose condition is checked before")
)]
fn density(component: &[f32], features: &[f32], floor: f32) -> f32 {
    #[cfg(cortex_m4f)]
    if !features.is_empty() && component.len() == component_floats(features.len()) {
        // SAFETY: the condition.
        return unsafe { cortex_m4::density(component, features, floor) };
    }
    density_portably(component, features, floor)
}

/// Density as [`density`] tells it, to the bit, in portable Rust: the compiled twin of the assembly.
fn density_portably(component: &[f32], features: &[f32], floor: f32) -> f32 {
    let Some((constant, offsets)) = component.split_first() else { return f32::NAN };
    let mut density = *constant;
    for (row, offset) in triangle(features.len(), component).zip(offsets) {
        let whitened = product(row, features) - offset;
        density -= 0.5 * (whitened * whitened);
        // It only falls.
        if density < floor {
            break;
        }
    }
    density
}

/// Rows of a component's lower triangle: one number, then two, and so on.
fn triangle(features: usize, component: &[f32]) -> impl Iterator<Item = &[f32]> {
    let mut rest = component.get(features.saturating_add(1)..).unwrap_or_default();
    (1..=features).map_while(move |length| {
        let (row, after) = rest.split_at_checked(length)?;
        rest = after;
        Some(row)
    })
}

/// Product of a `row` with as many of the first `features`.
fn product(row: &[f32], features: &[f32]) -> f32 {
    // In groups, because the compiler does not unroll the loop for a device.
    let (groups, rest) = row.as_chunks::<4>();
    let (features, last) =
        features.split_at_checked(groups.as_flattened().len()).unwrap_or_default();
    let mut sum = 0.0;
    for ([a, b, c, d], [e, f, g, h]) in groups.iter().zip(features.as_chunks().0) {
        sum += (a * e + b * f) + (c * g + d * h);
    }
    rest.iter().zip(last).fold(sum, |sum, (w, f)| sum + w * f)
}

/// Writes √(Σ γ·v) of every output, over the most probable components. `probabilities` need not sum to 1.
fn deviations(probabilities: &[f32], variances: &[f32], deviation: &mut [f32]) {
    // The most probable components, each with its probability; the best first.
    let mut chosen = [(0, 0.0); MOST_PROBABLE];
    for (index, probability) in probabilities.iter().enumerate() {
        let mut next = (index, *probability);
        for place in &mut chosen {
            if next.1 > place.1 {
                core::mem::swap(&mut next, place);
            }
        }
    }
    // The best component alone makes the sum 1.
    let per_sum = 1.0 / chosen.iter().map(|(_, probability)| probability).sum::<f32>();
    let [(a, of_a), (b, of_b), (c, of_c), (d, of_d)] =
        chosen.map(|(index, probability)| (index, probability * per_sum));
    let of = |index: usize| {
        variances.get(index.saturating_mul(deviation.len())..).unwrap_or_default().iter()
    };
    let variances = of(a).zip(of(b)).zip(of(c)).zip(of(d));
    for (place, (((a, b), c), d)) in deviation.iter_mut().zip(variances) {
        *place = sqrt((of_a * a + of_b * b) + (of_c * c + of_d * d));
    }
}

/// Square root, rounded correctly.
fn sqrt(value: f32) -> f32 {
    #[cfg(cortex_m4f)]
    return cortex_m4::sqrt(value);
    #[cfg(not(cortex_m4f))]
    return libm::sqrtf(value);
}

#[cfg(test)]
mod tests;
