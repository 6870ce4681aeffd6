//! The assembly routines, called with slices and counts instead of pointers.
//!
//! A function is unsafe if it reads more than its arguments' types guarantee. Its section *Safety* then says
//! what the caller must have checked.
#![expect(unsafe_code, reason = "calls to assembly, which reads as many words as it is told to")]
#![expect(
    clippy::manual_div_ceil,
    reason = "no K comes near an overflow, and this is shorter code"
)]

use core::mem::MaybeUninit;

use super::{Block, Finite, INPUTS, OUTPUTS, expanded_words, fixed16_words};

/// Number of activations that the f32 routine keeps between its two halves: 512 bytes of stack.
const MOST_CENTRES_AT_ONCE: usize = 128;

core::arch::global_asm!(include_str!("../cortex_m4.s"), options(raw));

/// Inputs of one inference, with their unit.
#[derive(Clone, Copy)]
pub enum Inputs<'a> {
    /// Readings in their own unit, not scaled yet.
    Readings(&'a [f32; INPUTS]),
    /// Scaled inputs, in units of the clamp ([`UNITS`](crate::scale::UNITS)).
    Scaled(&'a [f32; INPUTS]),
}

impl<'a> Inputs<'a> {
    /// The numbers, and the routine's flag for their unit.
    fn parts(self) -> (&'a [f32; INPUTS], u32) {
        match self {
            Self::Readings(readings) => (readings, 0),
            Self::Scaled(scaled) => (scaled, SCALED),
        }
    }
}

unsafe extern "C" {
    fn taxel_f32(
        inputs: *const [f32; INPUTS],
        block: *const u32,
        output: *mut [f32; OUTPUTS],
        fours: u32,
        flags: u32,
        activations: *mut [f32; MOST_CENTRES_AT_ONCE],
    ) -> u32;
    fn taxel_fixed16(
        inputs: *const [f32; INPUTS],
        block: *const u32,
        output: *mut [f32; OUTPUTS],
        sixteens: u32,
        flags: u32,
    ) -> u32;
    fn taxel_project(
        readings: *const f32,
        block: *const f32,
        features: *mut [f32; INPUTS],
        pairs: u32,
    );
    fn taxel_f32_array(
        inputs: *const [f32; INPUTS],
        block: *const u32,
        output: *mut f32,
        fours: u32,
        flags: u32,
        activations: *mut [f32; MOST_CENTRES_AT_ONCE],
        groups: u32,
    ) -> u32;
    fn taxel_fixed16_array(
        inputs: *const [f32; INPUTS],
        block: *const u32,
        output: *mut f32,
        sixteens: u32,
        flags: u32,
        groups: u32,
    ) -> u32;
    fn taxel_give_rest(
        readings: *const [f32; INPUTS],
        baseline: *const [f32; INPUTS],
        rest: *const [f32; OUTPUTS],
        outputs: *mut [f32; OUTPUTS],
        tolerance: f32,
    ) -> u32;
}

impl Finite {
    /// The verdict from the floating-point status after a routine. A conversion to an integer that saturates or
    /// meets NaN is an invalid operation; no other operation of a routine is.
    fn of_status(fpscr: u32) -> Self {
        const INVALID_OPERATION: u32 = 1;
        if fpscr & INVALID_OPERATION == 0 { Self::Known } else { Self::Unknown }
    }
}

/// Bit of `flags`: the network has an affine tail.
const AFFINE: u32 = 1;
const SCALED: u32 = 2;

fn flags(affine: bool, scaled: u32) -> u32 {
    (u32::from(affine) * AFFINE) | scaled
}

/// Number of groups of four centres, as the f32 routines count them.
fn fours(centres: usize) -> u32 {
    ((centres + 3) / 4) as u32
}

/// Number of groups of sixteen centres, as the fixed-point routines count them.
fn sixteens(centres: usize) -> u32 {
    ((centres + 15) / 16) as u32
}

/// Infers the 18 outputs of a network with expanded distances from 18 inputs.
///
/// # Safety
/// The caller must check that `block` has at least one centre, and [`expanded_words`] words for its centres and
/// one group.
pub(crate) unsafe fn expanded(
    block: &Block<'_>,
    inputs: Inputs<'_>,
    output: &mut [f32; OUTPUTS],
) -> Finite {
    debug_assert!(
        block.centres > 0 && block.words.len() >= expanded_words(block.centres, block.affine, 1)
    );
    let (inputs, scaled) = inputs.parts();
    let (fours, flags) = (fours(block.centres), flags(block.affine, scaled));
    let mut activations = MaybeUninit::uninit();
    // SAFETY: the caller has checked the block. The routine reads 18 inputs and writes 18 outputs, as the types
    // say. It writes at most 128 activations, and writes each before it reads it.
    unsafe {
        let (block, activations) = (block.words.as_ptr(), activations.as_mut_ptr());
        Finite::of_status(taxel_f32(inputs, block, output, fours, flags, activations))
    }
}

/// Infers the outputs of a network with expanded distances, in groups of 18, from 18 inputs.
///
/// # Safety
/// The caller must check that there is at least one of the `groups`, and that `block` has at least one centre,
/// and [`expanded_words`] words for its
/// centres and as many groups.
#[inline(never)] // its stack would burden the routine for one group
pub(crate) unsafe fn expanded_array(
    block: &Block<'_>,
    inputs: Inputs<'_>,
    groups: &mut [[f32; OUTPUTS]],
) -> Finite {
    debug_assert!(block.centres > 0 && !groups.is_empty());
    debug_assert!(block.words.len() >= expanded_words(block.centres, block.affine, groups.len()));
    let (inputs, scaled) = inputs.parts();
    let (fours, flags) = (fours(block.centres), flags(block.affine, scaled));
    let (output, groups) = (groups.as_mut_ptr().cast(), groups.len() as u32);
    let mut activations = MaybeUninit::uninit();
    // SAFETY: as in `expanded`; the routine writes as many groups as there are.
    unsafe {
        let (block, activations) = (block.words.as_ptr(), activations.as_mut_ptr());
        Finite::of_status(taxel_f32_array(inputs, block, output, fours, flags, activations, groups))
    }
}

/// Infers the 18 outputs of a network in 16-bit fixed point from 18 inputs.
///
/// # Safety
/// The caller must check that `block` has at least one centre, and [`fixed16_words`] words for its centres and
/// one group.
pub(crate) unsafe fn fixed16(
    block: &Block<'_>,
    inputs: Inputs<'_>,
    output: &mut [f32; OUTPUTS],
) -> Finite {
    debug_assert!(
        block.centres > 0 && block.words.len() >= fixed16_words(block.centres, block.affine, 1)
    );
    let (inputs, scaled) = inputs.parts();
    let (sixteens, flags) = (sixteens(block.centres), flags(block.affine, scaled));
    // SAFETY: the caller has checked the block. The routine reads 18 inputs and writes 18 outputs, as the types
    // say.
    Finite::of_status(unsafe {
        taxel_fixed16(inputs, block.words.as_ptr(), output, sixteens, flags)
    })
}

/// Infers the outputs of a network in 16-bit fixed point, in groups of 18, from 18 inputs.
///
/// # Safety
/// The caller must check that there is at least one of the `groups`, and that `block` has at least one centre,
/// and [`fixed16_words`] words for its
/// centres and as many groups.
#[inline(never)] // its stack would burden the routine for one group
pub(crate) unsafe fn fixed16_array(
    block: &Block<'_>,
    inputs: Inputs<'_>,
    groups: &mut [[f32; OUTPUTS]],
) -> Finite {
    debug_assert!(block.centres > 0 && !groups.is_empty());
    debug_assert!(block.words.len() >= fixed16_words(block.centres, block.affine, groups.len()));
    let (inputs, scaled) = inputs.parts();
    let (sixteens, flags) = (sixteens(block.centres), flags(block.affine, scaled));
    let (output, groups) = (groups.as_mut_ptr().cast(), groups.len() as u32);
    // SAFETY: as in `fixed16`; the routine writes as many groups as there are.
    Finite::of_status(unsafe {
        taxel_fixed16_array(inputs, block.words.as_ptr(), output, sixteens, flags, groups)
    })
}

/// Projects `readings` to 18 features: the first 18 numbers of `block`, plus 18 more numbers for each reading,
/// times the reading.
///
/// # Safety
/// The caller must check that `readings.len()` is even and not 0, and that `block` has at least
/// 18 · (1 + `readings.len()`) numbers.
pub(crate) unsafe fn project(block: &[f32], readings: &[f32], features: &mut [f32; INPUTS]) {
    debug_assert!(!readings.is_empty() && readings.len().is_multiple_of(2));
    debug_assert!(block.len() >= INPUTS * (1 + readings.len()));
    let pairs = (readings.len() / 2) as u32;
    // SAFETY: the caller has checked the block and the number of readings.
    unsafe { taxel_project(readings.as_ptr(), block.as_ptr(), features, pairs) }
}

/// Copies `rest` to `outputs` if the `readings` are at rest; returns whether they are.
pub(crate) fn give_rest(
    readings: &[f32; INPUTS],
    baseline: &[f32; INPUTS],
    tolerance: f32,
    rest: &[f32; OUTPUTS],
    outputs: &mut [f32; OUTPUTS],
) -> bool {
    // SAFETY: the routine reads and writes nothing but these arrays.
    unsafe { taxel_give_rest(readings, baseline, rest, outputs, tolerance) != 0 }
}
