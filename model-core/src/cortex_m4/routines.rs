//! The assembly routines, called with slices instead of pointers.
//!
//! A function is unsafe if it reads or writes more than its arguments' types guarantee. Its section *Safety* then
//! says what the caller must have checked.
#![expect(unsafe_code, reason = "calls to assembly, which reads as many words as it is told to")]

use super::Block;

core::arch::global_asm!(
    include_str!("common.s"),
    include_str!("fixed16.s"),
    include_str!("projection.s"),
    include_str!("touch.s"),
    options(raw)
);

/// Inputs of one inference, with their unit, and as many words of working space.
pub enum Inputs<'a> {
    /// Readings in their own unit, not scaled yet, and the space.
    Readings(&'a [f32], &'a mut [f32]),
    /// Scaled inputs, in units of the clamp ([`UNITS`](crate::scale::UNITS)); they are the space as well.
    Scaled(&'a mut [f32]),
}

impl Inputs<'_> {
    /// Whether there are `count` inputs and as many words of space.
    fn are(&self, count: usize) -> bool {
        match self {
            Self::Readings(readings, space) => readings.len() == count && space.len() == count,
            Self::Scaled(scaled) => scaled.len() == count,
        }
    }

    /// Addresses of the inputs and of the space. Routines expect the latter odd (one byte beyond) if the inputs are
    /// scaled.
    fn addresses(self) -> (*const f32, *mut f32) {
        match self {
            Self::Readings(readings, space) => (readings.as_ptr(), space.as_mut_ptr()),
            Self::Scaled(scaled) => {
                let at = scaled.as_mut_ptr();
                (at, at.wrapping_byte_add(1))
            }
        }
    }
}

unsafe extern "C" {
    // A block holds a slice. Its layout is asserted where it is defined.
    #[expect(improper_ctypes, reason = "assembly reads the slice's address, which stands first")]
    fn taxel_fixed16(
        block: *const Block<'_>,
        inputs: *const f32,
        output: *mut f32,
        space: *mut f32,
    ) -> u32;
    fn taxel_project(
        readings: *const f32,
        block: *const f32,
        features: *mut f32,
        count: usize,
        features: usize,
    );
    fn taxel_multiply(numbers: *mut f32, count: usize, factor: f32);
    fn taxel_touch(
        readings: *const f32,
        pairs: *const [f32; 2],
        shape: *mut f32,
        count: usize,
        reciprocals: *const f32,
        floor: f32,
        side: f32,
        whole_changes: bool,
    ) -> f32;
}

/// Whether an input was clamped, NaN or infinite, from the floating-point status after a routine. The conversion of
/// such an input to an integer is an invalid operation; no other operation on finite inputs is.
fn has_clamped(fpscr: u32) -> bool {
    const INVALID_OPERATION: u32 = 1;
    fpscr & INVALID_OPERATION != 0
}

/// Infers the outputs of a network in 16-bit fixed point. Returns whether an input was clamped, NaN or infinite.
///
/// # Safety
/// The caller must check that `block` has no count of 0 and all words of such a network, and that there are as many
/// inputs, words of space, and outputs as it says.
#[inline(always)]
pub(crate) unsafe fn fixed16(block: &Block<'_>, inputs: Inputs<'_>, output: &mut [f32]) -> bool {
    debug_assert!(inputs.are(block.inputs) && output.len() == block.outputs);
    let (inputs, space) = inputs.addresses();
    // SAFETY: the caller has checked all lengths. The routine reads the inputs and the block's words, and writes the
    // space and the outputs.
    has_clamped(unsafe { taxel_fixed16(block, inputs, output.as_mut_ptr(), space) })
}

/// Projects `readings` to `features`: the first numbers of `block`, one a feature, plus as many more for each
/// reading, times the reading.
///
/// # Safety
/// The caller must check that there are readings and features, and that `block` has
/// `features.len()` · (1 + `readings.len()`) numbers.
pub(crate) unsafe fn project(block: &[f32], readings: &[f32], features: &mut [f32]) {
    debug_assert!(!readings.is_empty() && !features.is_empty());
    debug_assert!(block.len() == features.len() * (1 + readings.len()));
    let (count, of) = (readings.len(), features.len());
    // SAFETY: the caller has checked the lengths.
    unsafe {
        taxel_project(readings.as_ptr(), block.as_ptr(), features.as_mut_ptr(), count, of);
    }
}

/// Multiplies all `numbers` by a `factor`.
pub(crate) fn multiply(numbers: &mut [f32], factor: f32) {
    // SAFETY: the routine reads and writes the numbers alone.
    unsafe { taxel_multiply(numbers.as_mut_ptr(), numbers.len(), factor) }
}

/// Writes the shape of a touch, and returns its strength. `pairs` are level and threshold of each reading; if changes are
/// `whole`, the side and all thresholds are 0.
///
/// # Safety
/// The caller must check that there are as many pairs, places of the shape and, if any, reciprocals as there are `readings`,
/// which are not 0.
#[inline(always)]
pub(crate) unsafe fn touch(
    pairs: &[[f32; 2]],
    readings: &[f32],
    reciprocals: Option<&[f32]>,
    shape: &mut [f32],
    [floor, side]: [f32; 2],
    whole: bool,
) -> f32 {
    let count = readings.len();
    debug_assert!(count > 0 && pairs.len() == count && shape.len() == count);
    debug_assert!(reciprocals.is_none_or(|of| of.len() == count));
    let (pairs, shape) = (pairs.as_ptr(), shape.as_mut_ptr());
    let reciprocals = reciprocals.map_or(core::ptr::null(), <[f32]>::as_ptr);
    // SAFETY: the caller has checked the lengths.
    unsafe { taxel_touch(readings.as_ptr(), pairs, shape, count, reciprocals, floor, side, whole) }
}

/// Square root of a number that is not negative, rounded correctly.
#[inline(always)]
pub(crate) fn sqrt(value: f32) -> f32 {
    let mut bits = value.to_bits();
    // SAFETY: the instructions read and write these two registers alone. The compiler offers no floating-point register
    // for operands, since it asks for double precision first.
    unsafe {
        core::arch::asm!(
            "vmov s0, {bits}",
            "vsqrt.f32 s0, s0",
            "vmov {bits}, s0",
            bits = inout(reg) bits,
            out("s0") _,
            options(pure, nomem, nostack, preserves_flags),
        );
    }
    f32::from_bits(bits)
}
