//! Networks whose parameters are one block of words, as in all formats that have an assembly routine.
//!
//! A format implements [`Layout`]: how long its blocks are, what they may hold, and how to infer from them. A
//! Cortex-M4F infers by an assembly routine. Elsewhere the routine's compiled twin is used: portable Rust that gives
//! the same bits.
#![cfg_attr(
    cortex_m4f,
    expect(unsafe_code, reason = "calls to assembly, whose conditions are checked before")
)]

use core::fmt::Debug;

use super::parameters::{NetworkError, Shape, check_length};
#[cfg(cortex_m4f)]
use crate::cortex_m4::Inputs;
use crate::cortex_m4::{Block, INPUTS, OUTPUTS};
use crate::feature::{Built, Feature};

/// A number format whose networks are one block of words.
pub trait Layout: Copy + Debug + PartialEq {
    /// Most centres of a batch of the assembly routine.
    const BATCH: usize;

    /// The part of decoding that the format is, and the proof that it is built.
    const FEATURE: Feature;
    /// The proof.
    type Proof: Built;

    /// Parameters of a network, cut from its block.
    type Parameters<'a>;

    /// Number of words in the block of a network of this shape, with an affine tail or without.
    fn block_words(shape: Shape, affine: bool) -> usize;

    /// Checks the format's limits on a shape, beyond the length of its block.
    ///
    /// # Errors
    /// [`NetworkError::TooManyInputs`], or whatever the format rejects.
    #[inline(always)]
    fn check_shape(_: Shape) -> Result<(), NetworkError> {
        Ok(())
    }

    /// Checks every value of `network`.
    ///
    /// # Errors
    /// The variant of [`NetworkError`] that names the first bad value.
    fn check_values(network: &Network<'_, Self>) -> Result<(), NetworkError>;

    /// The parameters of `network`.
    fn parameters<'a>(network: &Network<'a, Self>) -> Self::Parameters<'a>;

    /// Converts readings to the format's unit of inputs, not clamped yet, in `scaled`. Returns whether one
    /// [will be clamped](crate::scale::saturates), or is NaN.
    fn scale(network: &Network<'_, Self>, reading: &[f32], scaled: &mut [f32]) -> bool;

    /// Lowest and highest reading of `input` in training, in its unit; NaN if there is no such input.
    fn training_range(network: &Network<'_, Self>, input: usize) -> [f32; 2];

    /// Width σ of all centres on inputs scaled to [0, 1].
    fn width(parameters: &Self::Parameters<'_>) -> f32;

    /// Infers `output` from `scaled` inputs, which are overwritten, in Rust: the same bits as the routine's.
    fn infer_scaled_in_rust(network: &Network<'_, Self>, scaled: &mut [f32], output: &mut [f32]);

    /// Infers `output` by the format's assembly routine. Returns whether an input was clamped, NaN or infinite.
    ///
    /// # Safety
    /// The caller must check that there are as many `inputs`, with their space, and outputs as `network` has.
    #[cfg(cortex_m4f)]
    unsafe fn routine(network: &Network<'_, Self>, inputs: Inputs<'_>, output: &mut [f32]) -> bool;
}

/// A network whose parameters are one borrowed block of words, checked against its shape.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)] // the shape first, so that it is at the same place in a network of any format
pub struct Network<'a, L: Layout> {
    block: Block<'a>,
    proof: L::Proof,
}

impl<'a, L: Layout> Network<'a, L> {
    /// Makes a network after checking the length and values of `block`, the words of the format's parameters.
    ///
    /// After that, no reading can drive an exponent out of the format's range, nor an output out of f32. That the
    /// sums of 16-bit weights fit is not checked here: it is proved where a network is quantised.
    ///
    /// # Errors
    /// Every variant of [`NetworkError`]; the length is checked before values.
    pub fn try_new(shape: Shape, affine: bool, block: &'a [u32]) -> Result<Self, NetworkError> {
        let network = Self::with_length_checked(shape, affine, block)?;
        network.check_values()?;
        Ok(network)
    }

    /// Makes a network after checking the length alone, for a block whose values were checked before.
    #[inline(always)]
    pub(crate) fn with_length_checked(
        shape: Shape,
        affine: bool,
        block: &'a [u32],
    ) -> Result<Self, NetworkError> {
        if shape.inputs == 0 || shape.centres == 0 || shape.outputs == 0 {
            return Err(NetworkError::Empty);
        }
        let proof = NetworkError::proof(L::FEATURE)?;
        L::check_shape(shape)?;
        check_length("block", block, Self::block_words(shape, affine))?;
        let Shape { inputs, centres, outputs } = shape;
        let block = Block::new([inputs, centres, outputs], affine, block, L::BATCH);
        Ok(Self { block, proof })
    }

    /// Number of words in the block of a network of this shape, with an affine tail or without.
    #[inline]
    pub fn block_words(shape: Shape, affine: bool) -> usize {
        L::block_words(shape, affine)
    }

    /// The network's numbers of inputs, centres and outputs.
    pub fn shape(&self) -> Shape {
        let Block { inputs, centres, outputs, .. } = self.block;
        Shape { inputs, centres, outputs }
    }

    /// Whether the network has an affine tail.
    pub fn has_affine_tail(&self) -> bool {
        self.block.affine()
    }

    /// All words of the network.
    pub fn block(&self) -> &'a [u32] {
        self.block.words
    }

    /// The words with their counts, as the routines take them.
    #[cfg(cortex_m4f)]
    #[inline(always)]
    pub(super) fn counted(&self) -> &Block<'a> {
        &self.block
    }

    /// The network's parameters, cut from its block.
    pub fn parameters(&self) -> L::Parameters<'a> {
        L::parameters(self)
    }

    /// Width σ of all centres on inputs scaled to [0, 1].
    pub fn width(&self) -> f32 {
        L::width(&self.parameters())
    }

    pub(crate) fn check_values(&self) -> Result<(), NetworkError> {
        L::check_values(self)
    }

    pub(super) fn training_range(&self, input: usize) -> [f32; 2] {
        L::training_range(self, input)
    }

    #[inline(always)]
    pub(crate) fn scale(&self, reading: &[f32], scaled: &mut [f32]) -> bool {
        L::scale(self, reading, scaled)
    }

    /// Infers `output` from one row of readings; `scaled` is working space. All must have the lengths of the shape.
    /// Returns whether a reading was clamped, NaN or infinite.
    #[inline(always)]
    pub(crate) fn infer(&self, reading: &[f32], scaled: &mut [f32], output: &mut [f32]) -> bool {
        #[cfg(cortex_m4f)]
        if reading.len() == self.block.inputs && self.fit(scaled, output) {
            // SAFETY: the lengths are the network's, as was just checked.
            return unsafe { L::routine(self, Inputs::Readings(reading, scaled), output) };
        }
        #[cfg(not(cortex_m4f))]
        {
            let clamped = self.scale(reading, scaled);
            L::infer_scaled_in_rust(self, scaled, output);
            clamped
        }
        #[cfg(cortex_m4f)]
        true
    }

    /// Infers `output` from `scaled` inputs, which are overwritten. Both must have the lengths of the shape.
    #[inline(always)]
    pub(crate) fn infer_scaled(&self, scaled: &mut [f32], output: &mut [f32]) {
        #[cfg(cortex_m4f)]
        if self.fit(scaled, output) {
            // SAFETY: the lengths are the network's, as was just checked.
            unsafe { L::routine(self, Inputs::Scaled(scaled), output) };
        }
        #[cfg(not(cortex_m4f))]
        L::infer_scaled_in_rust(self, scaled, output);
    }

    /// Whether buffers have the lengths of the shape.
    #[cfg(cortex_m4f)]
    #[inline(always)]
    fn fit(&self, scaled: &[f32], output: &[f32]) -> bool {
        scaled.len() == self.block.inputs && output.len() == self.block.outputs
    }

    /// Infers `output` from `scaled` inputs by the compiled twin, with separate code for the usual sizes.
    #[inline(always)]
    pub(super) fn infer_scaled_by_twin(&self, scaled: &mut [f32], output: &mut [f32]) {
        let usual: (Result<&mut [f32; INPUTS], _>, Result<&mut [f32; OUTPUTS], _>) =
            ((&mut *scaled).try_into(), (&mut *output).try_into());
        if let (Ok(scaled), Ok(output)) = usual {
            L::infer_scaled_in_rust(self, scaled, output);
        } else {
            L::infer_scaled_in_rust(self, scaled, output);
        }
    }
}
