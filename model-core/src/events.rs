//! Events of a touch that a robot acts on: it begins, its load exceeds a threshold, it slips; and their ends.
//!
//! A touch slips when it leaves the place where it rested. That place is a mean over the last tenth of a second, in which
//! places count by how well they were known. A touch that goes on at v is v·(τ + dt) ahead of the mean over τ of all frames
//! before, dt apart, so that the distance over τ + dt is a speed. Rates of a [tracker](crate::track) tell less: they are known
//! to some 10 mm/s.

use core::mem;

use crate::contact::Detector;
use crate::reading_model::sqrt;

/// Time τ in s over which a touch's place is averaged.
const REST_S: f32 = 0.1;

/// Time in s from the beginning of a touch in which it does not slip: its place is still to be found.
const LANDING_S: f32 = 0.04;

/// Time in s in which a slip goes on while the place is not known, as behind a frame that no contact explains.
const LOST_S: f32 = 0.02;

/// Standard deviations of the place that a distance must exceed to begin a slip.
const CERTAIN: f32 = 2.5;

/// Least variance in mm² of a place.
const LEAST_VARIANCE: f32 = 1e-6;

/// Kind of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Something touches.
    Touch,
    /// The load exceeds its threshold.
    Load,
    /// The touch slips: its place moves over the sensor.
    Slip,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Touch, Self::Load, Self::Slip];
}

/// Thresholds above which load and slip begin; 0 is off. They end below six tenths of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Load, in its unit.
    pub load: f32,
    /// Speed of the touch's place in mm/s.
    pub slip_mm_per_s: f32,
}

/// Touch in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shown {
    /// Time in µs at which the frame began, by a clock of any start.
    pub start_us: u64,
    /// Whether something touches.
    pub is_touched: bool,
    /// Load, in its unit; NaN counts as none.
    pub load: f32,
    /// Place along x and y in mm, and its standard deviation; `None` if it is not known, or was found anew.
    pub place_mm: Option<([f32; 2], f32)>,
}

/// Events that are going on, and those that the newest frame changed.
///
/// ```
/// use taxel_core::events::{Events, Kind, Settings, Shown};
/// let settings = Settings { load: 0.5, slip_mm_per_s: 0.0 };
/// let mut events = Events::default();
/// let pressed = Shown { start_us: 0, is_touched: true, load: 0.7, place_mm: None };
/// events.update(settings, pressed);
/// assert_eq!(Kind::ALL.map(|kind| events.changed(kind)), [Some(true), Some(true), None]);
/// events.update(settings, Shown { load: 0.2, ..pressed });
/// assert_eq!(Kind::ALL.map(|kind| events.changed(kind)), [None, Some(false), None]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Events {
    load: Detector,
    slip: Detector,
    now: [bool; 3],
    before: [bool; 3],
    last_us: u64,
    touched_s: f32,
    /// Where the touch rested, and what the mean weighs.
    rest_mm: [f32; 2],
    weight: f32,
}

impl Events {
    /// Takes the touch in the newest frame. There is no slip without touch or load.
    pub fn update(&mut self, settings: Settings, shown: Shown) {
        let level = |threshold: f32| if threshold > 0.0 { threshold } else { f32::INFINITY };
        let load = self.load.update(shown.load, level(settings.load));
        let speed = self.speed_mm_per_s(shown);
        let slip = speed.map_or(self.slip.is_touched(), |speed| {
            self.slip.update(speed, level(settings.slip_mm_per_s))
        });
        self.before = mem::replace(&mut self.now, [shown.is_touched, load, slip]);
    }

    /// Speed at which the touch leaves the place where it rested, as far as that is certain; `None` for a moment in which the
    /// place of a touch that slips is not known.
    fn speed_mm_per_s(&mut self, shown: Shown) -> Option<f32> {
        let Shown { start_us, is_touched, place_mm, .. } = shown;
        let after_s = start_us.saturating_sub(self.last_us).max(1) as f32 * 1e-6;
        let is_touched = is_touched || self.load.is_touched();
        if place_mm.is_none() && is_touched && self.slip.is_touched() && after_s < LOST_S {
            return None;
        }
        self.last_us = start_us;
        self.touched_s = if is_touched { self.touched_s + after_s } else { 0.0 };
        let Some((place_mm, deviation_mm)) = place_mm.filter(|_| self.touched_s > LANDING_S) else {
            self.weight = 0.0;
            return Some(0.0);
        };
        let weight = after_s / (deviation_mm * deviation_mm).max(LEAST_VARIANCE);
        self.weight = self.weight / (1.0 + after_s / REST_S) + weight;
        let [x, y] = [0, 1].map(|axis| place_mm[axis] - self.rest_mm[axis]);
        let share = weight / self.weight;
        self.rest_mm = [self.rest_mm[0] + share * x, self.rest_mm[1] + share * y];
        let uncertain = if self.slip.is_touched() { 0.0 } else { CERTAIN * deviation_mm };
        let speed = (sqrt(x * x + y * y) - uncertain) / (REST_S + after_s);
        Some(if share < 1.0 { speed } else { 0.0 })
    }

    /// Whether an event of this kind is going on.
    pub fn is_on(&self, kind: Kind) -> bool {
        self.now[kind as usize]
    }

    /// Change by the newest frame: `Some(true)` if the event began, `Some(false)` if it ended.
    pub fn changed(&self, kind: Kind) -> Option<bool> {
        let [now, before] = [self.now, self.before].map(|of| of[kind as usize]);
        (now != before).then_some(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times in ms at which slip began and ended, of a touch whose place along x in mm is known to 10 µm at each ms, or not at all.
    fn slips(place_mm: impl Fn(u16) -> Option<f32>) -> ([u16; 2], usize) {
        let (mut events, mut at_ms, mut changes) = (Events::default(), [0; 2], 0);
        for ms in 0..1000 {
            let place_mm = place_mm(ms).map(|x| ([x, 5.0], 0.01));
            let (start_us, is_touched) = (1000 * u64::from(ms), ms >= 100);
            let settings = Settings { load: 0.0, slip_mm_per_s: 5.0 };
            events.update(settings, Shown { start_us, is_touched, load: 9.0, place_mm });
            assert!(!events.is_on(Kind::Load), "it is off");
            if let Some(begins) = events.changed(Kind::Slip) {
                (at_ms[usize::from(!begins)], changes) = (ms, changes + 1);
            }
        }
        (at_ms, changes)
    }

    #[test]
    fn a_touch_slips_once_it_has_left_its_place_and_not_as_it_lands() {
        // It is found where it was not expected, and then rests.
        assert_eq!(
            slips(|ms| Some(if ms < 135 { 0.1 * f32::from(ms) } else { 13.0 })),
            ([0; 2], 0)
        );
        // A step of a place that is known to 10 µm: 0.505 mm and the certainty of 0.025 mm.
        assert_eq!(slips(|ms| Some(if ms < 500 { 7.0 } else { 7.52 })).1, 0);
        assert_eq!(slips(|ms| Some(if ms < 500 { 7.0 } else { 7.55 })).0[0], 500);
        // At 20 mm/s it is 0.53 mm ahead of its mean after 31 ms, and 0.3 mm again some 190 ms after it stops.
        let ([begins, ends], changes) = slips(|ms| Some(slide_mm(ms)));
        assert!((528..=534).contains(&begins) && (870..=900).contains(&ends), "{begins} {ends}");
        assert_eq!(changes, 2);
    }

    /// Place of a touch that slides at 20 mm/s from 500 to 700 ms.
    fn slide_mm(ms: u16) -> f32 {
        0.02 * f32::from(ms.clamp(500, 700) - 500)
    }

    #[test]
    fn a_slip_goes_on_while_its_place_is_lost_for_a_moment() {
        let whole = slips(|ms| Some(slide_mm(ms)));
        for lost_ms in [1, 19] {
            let found = slips(|ms| (!(600..600 + lost_ms).contains(&ms)).then(|| slide_mm(ms)));
            assert!(found.0[1].abs_diff(whole.0[1]) < 15, "{found:?} {whole:?}");
            assert_eq!((found.0[0], found.1), (whole.0[0], 2), "{lost_ms}");
        }
        // Longer, it must be found again; and a place that is lost for good ends it.
        assert_eq!(slips(|ms| (!(600..621).contains(&ms)).then(|| slide_mm(ms))).1, 4);
        assert_eq!(slips(|ms| (ms < 600).then(|| slide_mm(ms))).0[1], 619);
        // What touches no more slips no more.
        let mut events = Events { touched_s: 1.0, ..Events::default() };
        let settings = Settings { load: 0.0, slip_mm_per_s: 5.0 };
        let mut slips = |place_mm: Option<f32>, ms: u64, is_touched| {
            let place_mm = place_mm.map(|x| ([x, 5.0], 0.01));
            let shown = Shown { start_us: 1000 * ms, is_touched, load: 0.0, place_mm };
            events.update(settings, shown);
            events.is_on(Kind::Slip)
        };
        assert!(!slips(Some(1.0), 1, true) && slips(Some(2.0), 2, true) && slips(None, 3, true));
        assert!(!slips(None, 4, false));
    }

    #[test]
    fn speeds_are_right_at_any_frame_rate() {
        for frame_us in [1000_u64, 6360, 21_000] {
            let mut events = Events { touched_s: 1.0, ..Events::default() };
            let mut speed = None;
            for frame in 1..2000_u16 {
                let start_us = frame_us * u64::from(frame);
                let place_mm = Some(([20e-6 * start_us as f32, 5.0], 1e-3));
                let shown = Shown { start_us, is_touched: true, load: 0.0, place_mm };
                speed = events.speed_mm_per_s(shown);
            }
            // Less what is not certain.
            assert!((19.95..20.0).contains(&speed.unwrap()), "{frame_us} {speed:?}");
        }
    }

    #[test]
    fn what_is_not_known_begins_nothing() {
        let mut events = Events::default();
        let settings = Settings { load: 0.1, slip_mm_per_s: 1.0 };
        for ms in 0..200_u16 {
            let place_mm = Some(([f32::from(ms), 0.0], 0.01)).filter(|_| ms % 2 == 0);
            let shown = Shown { start_us: 1000, is_touched: true, load: f32::NAN, place_mm };
            events.update(settings, shown);
            assert!(!events.is_on(Kind::Load) && !events.is_on(Kind::Slip));
        }
    }
}
