//! Min–max scaling of readings.

/// Scaled readings are clamped to this range: [0, 1] is the training range, and an eighth of it more
/// on either side is let through.
///
/// The clamp bounds every distance to a centre, so that no reading can leave the region where the
/// network was fitted. It is not tight, because a clamp at 0 and 1 bends readings that exceed the
/// training range by a hair, and neighbouring channels are so alike that weights of 1e3 and more
/// rest on their differences: without noise that alone made the error in z of `press` 0.0195 mm
/// instead of 0.0071 mm.
pub const CLAMP: [f32; 2] = [-0.125, 1.125];

/// Scales one `reading` by its training minimum and by `per_span` = 1/(maximum − minimum), so that
/// the training range becomes [0, 1], and clamps the result to [`CLAMP`].
///
/// A NaN reading stays NaN.
///
/// ```
/// use model_core::scale::scale;
/// assert_eq!(scale(60.0, 50.0, 0.05), 0.5);
/// assert_eq!(scale(1000.0, 50.0, 0.05), 1.125);
/// ```
#[inline]
#[must_use]
pub fn scale(reading: f32, minimum: f32, per_span: f32) -> f32 {
    ((reading - minimum) * per_span).clamp(CLAMP[0], CLAMP[1])
}
