//! Whether something touches the sensor, told by the strength of a touch.

/// Share of the level at which a touch begins below which it ends.
const END: f32 = 0.6;

/// Detector of touch, with hysteresis.
///
/// ```
/// use taxel_core::contact::Detector;
/// let mut detector = Detector::default();
/// let strengths = [9.0, 11.0, 7.0, 5.0, 7.0];
/// assert_eq!(strengths.map(|it| detector.update(it, 10.0)), [false, true, true, false, false]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Detector {
    is_touched: bool,
}

impl Detector {
    /// Takes the `strength` of the newest frame. A touch begins above the level `begin`, and ends below six tenths of it.
    /// Returns whether something touches.
    pub fn update(&mut self, strength: f32, begin: f32) -> bool {
        self.is_touched = strength > if self.is_touched { END * begin } else { begin };
        self.is_touched
    }

    /// Whether something touched in the last frame.
    pub fn is_touched(&self) -> bool {
        self.is_touched
    }
}
