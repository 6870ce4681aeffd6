//! Min–max scaling of readings to [0, 1].

/// Scales one `reading` by its training minimum and by `per_span` = 1/(maximum − minimum), and
/// clamps the result to [0, 1].
///
/// The clamp bounds every distance to a centre, so an input far outside the training range
/// cannot leave the region where the network was fitted. A NaN reading stays NaN.
///
/// ```
/// use model_core::scale::scale;
/// assert_eq!(scale(60.0, 50.0, 0.05), 0.5);
/// assert_eq!(scale(1000.0, 50.0, 0.05), 1.0);
/// ```
#[inline]
#[must_use]
pub fn scale(reading: f32, minimum: f32, per_span: f32) -> f32 {
    ((reading - minimum) * per_span).clamp(0.0, 1.0)
}
