//! The assembly's functions, made safe: all that they read and write is measured here.
#![expect(unsafe_code, reason = "calls to assembly, with lengths taken from slices and arrays")]
#![expect(
    clippy::manual_div_ceil,
    reason = "no K comes near an overflow, and this is shorter code"
)]

use core::mem::MaybeUninit;

use crate::rbf::{Finite, USUAL_INPUTS as INPUTS, USUAL_OUTPUTS as OUTPUTS, expanded, fixed16};

/// Activations of the f32 kernel between its two halves: 512 bytes of stack.
const MOST_CENTRES_AT_ONCE: usize = 128;

core::arch::global_asm!(include_str!("cortex_m4.s"), options(raw));

/// What a network takes in.
#[derive(Clone, Copy)]
pub(crate) enum Inputs<'a> {
    /// In the readings' unit.
    Readings(&'a [f32; INPUTS]),
    /// In [`UNITS`](crate::scale::UNITS).
    Scaled(&'a [f32; INPUTS]),
}

impl<'a> Inputs<'a> {
    /// And the flag that tells.
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
    /// From the floating-point status behind a kernel: a conversion to integers that saturates, or meets
    /// NaN, is an invalid operation, and no other operation of a kernel is.
    fn of_status(fpscr: u32) -> Self {
        const INVALID_OPERATION: u32 = 1;
        if fpscr & INVALID_OPERATION == 0 { Self::Known } else { Self::Unknown }
    }
}

/// Bits of `flags`.
const AFFINE: u32 = 1;
const SCALED: u32 = 2;

/// The outputs of a network with expanded distances: 18 of them.
pub(crate) fn expanded(
    network: &expanded::Network<'_>,
    inputs: Inputs<'_>,
    output: &mut [f32; OUTPUTS],
) -> Finite {
    let (inputs, scaled) = inputs.parts();
    let (fours, flags) = (fours(network), flags(network.has_affine_tail(), scaled));
    let mut activations = MaybeUninit::uninit();
    // SAFETY: a network's block is checked against its shape when it is made, and the caller has checked the
    // shape against INPUTS and OUTPUTS; activations are written, 128 at most, before they are read.
    unsafe {
        let block = network.block().as_ptr();
        Finite::of_status(taxel_f32(inputs, block, output, fours, flags, activations.as_mut_ptr()))
    }
}

/// As [`expanded`], in several groups of 18. Not inlined: its stack would burden the other.
#[inline(never)]
pub(crate) fn expanded_array(
    network: &expanded::Network<'_>,
    inputs: Inputs<'_>,
    groups: &mut [[f32; OUTPUTS]],
) -> Finite {
    let (inputs, scaled) = inputs.parts();
    let (fours, flags) = (fours(network), flags(network.has_affine_tail(), scaled));
    let (output, groups) = (groups.as_mut_ptr().cast(), groups.len() as u32);
    let mut activations = MaybeUninit::uninit();
    // SAFETY: as in `expanded`; the shape has as many outputs as the groups, which are not none.
    unsafe {
        let block = network.block().as_ptr();
        let activations = activations.as_mut_ptr();
        Finite::of_status(taxel_f32_array(inputs, block, output, fours, flags, activations, groups))
    }
}

fn fours(network: &expanded::Network<'_>) -> u32 {
    ((network.shape().centres + 3) / 4) as u32
}

fn flags(affine: bool, scaled: u32) -> u32 {
    (u32::from(affine) * AFFINE) | scaled
}

/// The outputs of a network in fixed point: 18 of them.
pub(crate) fn fixed16(
    network: &fixed16::Network<'_>,
    inputs: Inputs<'_>,
    output: &mut [f32; OUTPUTS],
) -> Finite {
    let (inputs, scaled) = inputs.parts();
    let (sixteens, flags) = (sixteens(network), flags(network.has_affine_tail(), scaled));
    let block = network.block().as_ptr();
    // SAFETY: as in `expanded`.
    Finite::of_status(unsafe { taxel_fixed16(inputs, block, output, sixteens, flags) })
}

/// As [`fixed16`], in several groups of 18. Not inlined: its stack would burden the other.
#[inline(never)]
pub(crate) fn fixed16_array(
    network: &fixed16::Network<'_>,
    inputs: Inputs<'_>,
    groups: &mut [[f32; OUTPUTS]],
) -> Finite {
    let (inputs, scaled) = inputs.parts();
    let (sixteens, flags) = (sixteens(network), flags(network.has_affine_tail(), scaled));
    let block = network.block().as_ptr();
    let (output, groups) = (groups.as_mut_ptr().cast(), groups.len() as u32);
    // SAFETY: as in `expanded_array`.
    Finite::of_status(unsafe {
        taxel_fixed16_array(inputs, block, output, sixteens, flags, groups)
    })
}

fn sixteens(network: &fixed16::Network<'_>) -> u32 {
    ((network.shape().centres + 15) / 16) as u32
}

/// See `Projection::project`: an even number of `readings`, and a `block` for as many.
pub(crate) fn project(block: &[f32], readings: &[f32], features: &mut [f32; INPUTS]) {
    let pairs = (readings.len() / 2) as u32;
    // SAFETY: the caller has checked the lengths; a projection has readings.
    unsafe { taxel_project(readings.as_ptr(), block.as_ptr(), features, pairs) }
}

/// See `gate::give_rest`.
pub(crate) fn give_rest(
    readings: &[f32; INPUTS],
    baseline: &[f32; INPUTS],
    tolerance: f32,
    rest: &[f32; OUTPUTS],
    outputs: &mut [f32; OUTPUTS],
) -> bool {
    // SAFETY: no more is read and written than these arrays.
    unsafe { taxel_give_rest(readings, baseline, rest, outputs, tolerance) != 0 }
}
