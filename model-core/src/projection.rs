//! Projection of a whole frame to a few features.
//!
//! f = f₀ + Σ_j r_j·p_j over all readings r of a frame, in Ω. It is linear, so that white noise averages out over
//! the array. Usually there are as many features as a row has readings, so that the same inner loops serve both. The
//! directions p come from training; `docs/training.md` explains how.

#[cfg(cortex_m4f)]
use crate::cortex_m4;
use crate::rbf::NetworkError;

/// A linear projection of a frame to features, borrowed from a blob.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection<'a> {
    features: usize,
    /// f₀ of every feature, then p of every feature for one reading after the other.
    block: &'a [f32],
}

impl<'a> Projection<'a> {
    /// Makes a projection of so many `readings` to `features` numbers. `block` holds f₀, then for each reading its
    /// part in each feature.
    ///
    /// # Errors
    /// [`NetworkError::Empty`] without readings or features, [`NetworkError::Length`] for a block that is not
    /// `(1 + readings) * features` long, [`NetworkError::NotFinite`] for a number that is NaN or infinite.
    pub fn new(readings: usize, features: usize, block: &'a [f32]) -> Result<Self, NetworkError> {
        if readings == 0 || features == 0 {
            return Err(NetworkError::Empty);
        }
        let (expected, found) = (block_floats(readings, features), block.len());
        if expected != found {
            return Err(NetworkError::Length { what: "projection", expected, found });
        }
        if !block.iter().all(|value| value.is_finite()) {
            return Err(NetworkError::NotFinite { what: "projection" });
        }
        Ok(Self { features, block })
    }

    /// Makes a projection of an array in a program: f₀, then for each reading its part in each feature. Numbers are not
    /// checked.
    pub const fn of_array<const FEATURES: usize, const LINES: usize>(
        array: &'a [[f32; FEATURES]; LINES],
    ) -> Self {
        const { assert!(FEATURES > 0 && LINES > 1, "a projection without readings or features") };
        Self { features: FEATURES, block: array.as_flattened() }
    }

    /// Makes a projection of a block that [`new`](Self::new) has checked before.
    pub(crate) fn of_checked(features: usize, block: &'a [f32]) -> Self {
        Self { features, block }
    }

    /// The projection's numbers: f₀, then for each reading its part in each feature.
    pub fn block(&self) -> &'a [f32] {
        self.block
    }

    /// Number of features.
    pub const fn features(&self) -> usize {
        self.features
    }

    /// Number of readings.
    pub fn readings(&self) -> usize {
        self.block.len().checked_div(self.features).unwrap_or(0).saturating_sub(1)
    }

    /// Projects `readings` (Ω) to `features`; all features are NaN if a reading is NaN.
    ///
    /// Readings and features beyond the projection's sizes are ignored.
    #[cfg_attr(
        cortex_m4f,
        expect(unsafe_code, reason = "a call to assembly, whose condition is checked before")
    )]
    pub fn project(&self, readings: &[f32], features: &mut [f32]) {
        #[cfg(cortex_m4f)]
        if self.suits(readings.len(), features.len()) {
            // SAFETY: `suits` has found the block to be one of so many readings and features. Neither is 0,
            // because `new` rejects such a projection.
            return unsafe { cortex_m4::project(self.block, readings, features) };
        }
        self.project_portably(readings, features);
    }

    /// Whether the projection is one of so many `readings` to so many `features`.
    #[cfg(any(cortex_m4f, test))]
    fn suits(&self, readings: usize, features: usize) -> bool {
        self.features == features && self.block.len() == block_floats(readings, features)
    }

    /// Projects as [`project`](Self::project) does, to the bit, in portable Rust: the compiled twin of the
    /// assembly.
    pub fn project_portably(&self, readings: &[f32], features: &mut [f32]) {
        let (start, parts) = self.block.split_at_checked(self.features).unwrap_or_default();
        features.iter_mut().zip(start).for_each(|(feature, start)| *feature = *start);
        for (reading, parts) in readings.iter().zip(parts.chunks_exact(self.features.max(1))) {
            for (feature, part) in features.iter_mut().zip(parts) {
                *feature += part * reading;
            }
        }
    }
}

/// Number of floats in the block of a projection.
pub(crate) const fn block_floats(readings: usize, features: usize) -> usize {
    readings.saturating_add(1).saturating_mul(features)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_are_the_sums_of_the_readings_parts() {
        let block = [1.0, -1.0, 2.0, 0.0, 0.5, 4.0];
        let projection = Projection::new(2, 2, &block).unwrap();
        assert_eq!((projection.readings(), projection.features()), (2, 2));
        let mut features = [f32::NAN; 2];
        projection.project(&[10.0, 100.0], &mut features);
        assert_eq!(features, [1.0 + 20.0 + 50.0, -1.0 + 400.0]);
        projection.project(&[10.0, f32::NAN], &mut features);
        assert!(features.iter().all(|feature| feature.is_nan()));
    }

    #[test]
    fn only_its_own_sizes_are_given_to_assembly() {
        let block = [0.0; 18 * 19];
        let suits = |readings, features, of: [usize; 2]| {
            let block = &block[..block_floats(readings, features)];
            Projection::new(readings, features, block).unwrap().suits(of[0], of[1])
        };
        assert!(suits(18, 18, [18, 18]) && suits(7, 3, [7, 3]));
        // A block can be as long as one of another shape.
        assert!(!suits(17, 1, [0, 18]) && !suits(37, 9, [18, 18]));
        assert!(!suits(18, 18, [16, 18]) && !suits(18, 18, [0, 18]) && !suits(17, 18, [17, 17]));
    }

    #[test]
    fn a_block_that_does_not_fit_is_refused() {
        let length = Err(NetworkError::Length { what: "projection", expected: 6, found: 5 });
        assert_eq!(Projection::new(2, 2, &[0.0; 5]), length);
        assert_eq!(Projection::new(0, 2, &[0.0; 2]), Err(NetworkError::Empty));
        assert_eq!(Projection::new(2, 0, &[]), Err(NetworkError::Empty));
        let block = [0.0, f32::INFINITY];
        let infinite = Err(NetworkError::NotFinite { what: "projection" });
        assert_eq!(Projection::new(1, 1, &block), infinite);
    }
}
