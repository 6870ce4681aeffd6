//! Min–max scaling of readings.

/// Range that scaled readings are clamped to: the training range [0, 1], and an eighth of it more on either
/// side.
///
/// The clamp bounds every distance to a centre, so that no reading can leave the region where the
/// network was fitted. It is not tight, because a clamp at 0 and 1 bends readings that exceed the
/// training range by a hair. Neighbouring channels are so alike that weights of 1e3 and more depend on their
/// differences: without noise, a tight clamp alone made the error in z of `press` 0.0195 mm instead of
/// 0.0071 mm.
pub const CLAMP: [f32; 2] = [-0.125, 1.125];

/// Scales one `reading` by its training minimum and by `per_span` = 1/(maximum − minimum), so that
/// the training range becomes [0, 1], and clamps the result to [`CLAMP`].
///
/// A NaN reading stays NaN.
///
/// ```
/// use taxel_core::scale::scale;
/// assert_eq!(scale(60.0, 50.0, 0.05), 0.5);
/// assert_eq!(scale(1000.0, 50.0, 0.05), 1.125);
/// ```
#[inline]
pub fn scale(reading: f32, minimum: f32, per_span: f32) -> f32 {
    scale_and_tell(reading, minimum, per_span).0
}

/// Scales one `reading` as [`scale`] does, and tells whether it was clamped: whether it lies below the lower end of
/// [`CLAMP`], or at the upper end or beyond. True for NaN.
#[inline]
pub(crate) fn scale_and_tell(reading: f32, minimum: f32, per_span: f32) -> (f32, bool) {
    let scaled = (reading - minimum) * per_span;
    (scaled.clamp(CLAMP[0], CLAMP[1]), !(CLAMP[0]..CLAMP[1]).contains(&scaled))
}

/// Half the width of [`CLAMP`], in spans of the training range.
pub const HALF_RANGE: f32 = (CLAMP[1] - CLAMP[0]) / 2.0;

/// Number of units in [`HALF_RANGE`]; networks in `fixed16` count inputs in these units, from the middle of the
/// training range.
///
/// The conversion to `i32`, which saturates, is then the clamp: it takes a Cortex-M4F one cycle, where comparisons
/// take eight.
pub const UNITS: f32 = 2_147_483_648.0;

/// Number of [`UNITS`] in one step of the 16-bit format, whose inputs are the upper halves of these integers.
pub const UNITS_PER_STEP: f32 = 65_536.0;

/// Whether a scaled reading in [`UNITS`] is clamped: the conversion to `i32` saturates below −[`UNITS`], and at
/// [`UNITS`] and above. True for NaN.
///
/// A Cortex-M4F finds this out at no cost: such a conversion leaves the flag of an invalid operation behind.
#[inline]
pub fn saturates(scaled: f32) -> bool {
    !(-UNITS..UNITS).contains(&scaled)
}

/// Clamps a scaled reading in [`UNITS`] and rounds it down to a step; NaN becomes 0.
#[inline]
pub fn clamp_steps(scaled: f32) -> i32 {
    (scaled as i32) >> 16
}
