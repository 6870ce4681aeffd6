//! Assembly routines for a Cortex-M4F, and their sizes, which every target knows.
//!
//! The assembly is made for the paper's sizes: 18 inputs, and outputs in groups of 18. It reads networks as
//! plain blocks of words. The functions below count the words that it reads, and a test compares these counts
//! with the formats' own. Every routine has a compiled twin: portable Rust code that gives the same bits.

#[cfg(cortex_m4f)]
mod routines;

#[cfg(cortex_m4f)]
pub(crate) use routines::{
    Inputs, expanded, expanded_array, fixed16, fixed16_array, give_rest, project,
};

/// Inputs a row of the paper's sensor; inner loops are made for this number, in assembly or compiled.
pub(crate) const INPUTS: usize = 18;
/// Outputs a row of the paper's sensor; inner loops are made for groups of this number.
pub(crate) const OUTPUTS: usize = 18;

/// Whether the readings of an inference were finite, as far as the inference itself has seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finite {
    /// All readings were finite.
    #[cfg_attr(not(cortex_m4f), expect(dead_code, reason = "assembly alone tells on the side"))]
    Known,
    /// Some reading may have been NaN or infinite, or just beyond the clamp.
    Unknown,
}

/// A network's parameters as plain words, with the counts that tell how to read them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)] // the counts first, so that they are at the same place in a network of any format
pub struct Block<'a> {
    pub inputs: usize,
    pub centres: usize,
    pub outputs: usize,
    /// Whether there is an affine tail.
    pub affine: bool,
    pub words: &'a [u32],
}

/// Number of words that [`expanded_array`] reads from a block, for `groups` groups of outputs.
#[cfg(any(test, cortex_m4f))]
pub(crate) const fn expanded_words(centres: usize, affine: bool, groups: usize) -> usize {
    let outputs = OUTPUTS * groups;
    let affine = if affine { INPUTS * outputs } else { 0 };
    2 * INPUTS + 1 + outputs + affine + centres.next_multiple_of(4) * (1 + INPUTS + outputs)
}

/// Number of words that [`fixed16_array`] reads from a block, for `groups` groups of outputs.
#[cfg(any(test, cortex_m4f))]
pub(crate) const fn fixed16_words(centres: usize, affine: bool, groups: usize) -> usize {
    let outputs = OUTPUTS * groups;
    let affine = if affine { INPUTS / 2 * outputs } else { 0 };
    let sixteen_centres = 16 * (1 + INPUTS / 2) + 8 * outputs;
    2 * INPUTS + 1 + 2 * outputs + affine + centres.div_ceil(16) * sixteen_centres
}
