//! Assembly routines for a Cortex-M4F, and the blocks of words that they read, which every target knows.
//!
//! The assembly takes any number of inputs, centres and outputs. It is fastest at 18 inputs, and at outputs in
//! groups of 18: the paper's sizes. Every routine has a compiled twin: portable Rust code that gives the same bits.

#[cfg(cortex_m4f)]
mod routines;

#[cfg(cortex_m4f)]
pub(crate) use routines::{Inputs, fixed16, multiply, project, sqrt, touch};

/// Inputs a row of the paper's sensor; inner loops are made for this number, in assembly or compiled.
pub(crate) const INPUTS: usize = 18;
/// Outputs a row of the paper's sensor; inner loops are made for groups of this number.
pub(crate) const OUTPUTS: usize = 18;
/// Most centres of a batch of the routine for `fixed16`.
const BATCH: usize = 256;

/// A network's parameters as plain words, with the counts that are needed to read them. Assembly reads this, so that
/// order and sizes are its own.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Block<'a> {
    pub inputs: usize,
    pub centres: usize,
    pub outputs: usize,
    form: Form,
    pub words: &'a [u32],
}

/// What else a routine needs to know of a network: bits, so that the paper's is recognised by a 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(transparent)]
struct Form(u32);

impl Form {
    /// There is an affine tail.
    const AFFINE: u32 = 1;
    /// There are not 18 inputs, or more than 18 outputs.
    const OTHER_SIZES: u32 = 2;
    /// There are more centres than a batch has.
    const BATCHES: u32 = 4;
    /// From this bit on is the number of outputs, if there are 18 inputs and fewer than 18 outputs.
    const OUTPUTS_SHIFT: u32 = 8;
}

impl<'a> Block<'a> {
    /// Makes a block of these counts.
    #[inline(always)]
    pub const fn new(counts: [usize; 3], affine: bool, words: &'a [u32]) -> Self {
        let [inputs, centres, outputs] = counts;
        let sizes = if inputs != INPUTS || outputs > OUTPUTS {
            Form::OTHER_SIZES
        } else if outputs < OUTPUTS {
            (outputs as u32) << Form::OUTPUTS_SHIFT
        } else {
            0
        };
        let affine = if affine { Form::AFFINE } else { 0 };
        let batches = if centres > BATCH { Form::BATCHES } else { 0 };
        Self { inputs, centres, outputs, form: Form(affine | sizes | batches), words }
    }

    /// Whether there is an affine tail.
    #[inline]
    pub fn affine(&self) -> bool {
        self.form.0 & Form::AFFINE != 0
    }
}

// What the assembly relies on.
#[cfg(cortex_m4f)]
const _: () = {
    use core::mem::offset_of;
    assert!(offset_of!(Block<'_>, inputs) == 0 && offset_of!(Block<'_>, centres) == 4);
    assert!(offset_of!(Block<'_>, outputs) == 8 && offset_of!(Block<'_>, form) == 12);
    assert!(offset_of!(Block<'_>, words) == 16 && size_of::<Block<'_>>() == 24);
};
