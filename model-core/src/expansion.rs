//! Expansion of few components to the outputs of all rows.
//!
//! The outputs of a whole array lie near a space of few dimensions. A network behind a projection may thus infer
//! *components*, and outputs are o₀ + Σ_c y_c·q_c over all components y. `docs/projection.md` has what that saves.
//!
//! This is the arithmetic of a [`Projection`] the other way round, in f32 whatever the network's format: the same
//! routine does it.

use crate::projection::Projection;
use crate::rbf::NetworkError;

/// A linear expansion of components to outputs, borrowed from a blob.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expansion<'a> {
    components: usize,
    outputs: usize,
    /// o₀ of every output, then q of every output for one component after the other.
    block: &'a [f32],
}

impl<'a> Expansion<'a> {
    /// Makes an expansion of so many `components` to `outputs` numbers. `block` holds o₀, then for each component its
    /// part in each output.
    ///
    /// # Errors
    /// [`NetworkError::Empty`] without components or outputs, [`NetworkError::Length`] for a block that is not
    /// `(1 + components) * outputs` long, [`NetworkError::NotFinite`] for a number that is NaN or infinite.
    ///
    /// ```
    /// use taxel_core::expansion::Expansion;
    /// let expansion = Expansion::new(1, 2, &[1.0, 2.0, 0.5, -0.5])?;
    /// let mut outputs = [0.0; 2];
    /// expansion.expand(&[4.0], &mut outputs);
    /// assert_eq!(outputs, [3.0, 0.0]);
    /// # Ok::<(), taxel_core::rbf::NetworkError>(())
    /// ```
    pub fn new(components: usize, outputs: usize, block: &'a [f32]) -> Result<Self, NetworkError> {
        match Projection::new(components, outputs, block) {
            Ok(_) => Ok(Self { components, outputs, block }),
            Err(NetworkError::Length { expected, found, .. }) => {
                Err(NetworkError::Length { what: "expansion", expected, found })
            }
            Err(NetworkError::NotFinite { .. }) => {
                Err(NetworkError::NotFinite { what: "expansion" })
            }
            Err(cause) => Err(cause),
        }
    }

    /// Makes an expansion of a block that [`new`](Self::new) has checked before.
    pub(crate) fn of_checked(components: usize, outputs: usize, block: &'a [f32]) -> Self {
        Self { components, outputs, block }
    }

    /// Number of components.
    pub fn components(&self) -> usize {
        self.components
    }

    /// Number of outputs of all rows.
    pub fn outputs(&self) -> usize {
        self.outputs
    }

    /// The expansion's numbers: o₀, then for each component its part in each output.
    pub fn block(&self) -> &'a [f32] {
        self.block
    }

    /// Expands `components` to `outputs`.
    ///
    /// Components and outputs beyond the expansion's sizes are ignored.
    pub fn expand(&self, components: &[f32], outputs: &mut [f32]) {
        self.as_projection().project(components, outputs);
    }

    /// Expands as [`expand`](Self::expand) does, to the bit, in portable Rust: the compiled twin of the assembly.
    pub fn expand_portably(&self, components: &[f32], outputs: &mut [f32]) {
        self.as_projection().project_portably(components, outputs);
    }

    fn as_projection(&self) -> Projection<'a> {
        Projection::of_checked(self.outputs, self.block)
    }

    /// Whether no sum leaves f32 for components of at most this magnitude.
    pub(crate) fn stays_finite(&self, largest_component: f32) -> bool {
        let sum = |values: &[f32]| values.iter().map(|value| value.abs()).sum::<f32>();
        let (start, parts) = self.block.split_at_checked(self.outputs).unwrap_or_default();
        (2.0 * (sum(start) + largest_component * sum(parts))).is_finite()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outputs_are_the_sums_of_the_components_parts() {
        let block = [1.0, -1.0, 0.5, 2.0, 0.0, 0.5, 4.0, 8.0, -1.0];
        let expansion = Expansion::new(2, 3, &block).unwrap();
        assert_eq!((expansion.components(), expansion.outputs()), (2, 3));
        let expected = [1.0 + 20.0 + 400.0, -1.0 + 800.0, 0.5 + 5.0 - 100.0];
        let mut outputs = [f32::NAN; 3];
        expansion.expand(&[10.0, 100.0], &mut outputs);
        assert_eq!(outputs, expected);
        outputs.fill(f32::NAN);
        expansion.expand_portably(&[10.0, 100.0], &mut outputs);
        assert_eq!(outputs, expected);
    }

    #[test]
    fn a_block_that_does_not_fit_is_refused() {
        let length = Err(NetworkError::Length { what: "expansion", expected: 6, found: 5 });
        assert_eq!(Expansion::new(2, 2, &[0.0; 5]), length);
        assert_eq!(Expansion::new(0, 2, &[0.0; 2]), Err(NetworkError::Empty));
        let not_finite = Err(NetworkError::NotFinite { what: "expansion" });
        assert_eq!(Expansion::new(1, 1, &[f32::NAN, 0.0]), not_finite);
    }

    #[test]
    fn sums_beyond_f32_are_foreseen() {
        let expansion = Expansion::new(1, 2, &[0.0, 1.0, 1e10, -1e10]).unwrap();
        assert!(expansion.stays_finite(1e27));
        assert!(!expansion.stays_finite(1e28) && !expansion.stays_finite(f32::INFINITY));
    }
}
