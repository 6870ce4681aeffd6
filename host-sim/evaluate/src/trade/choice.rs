//! Choice of one point within the user's bounds.

use serde::Serialize;
use taxel_data::BadValue;

use super::SLOT_BYTES;
use crate::device::Times;
use crate::error::{Bounded, NoPoint, Unmet};

/// Bounds that a user sets for the chosen point.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Bounds {
    /// Largest RMSE of the group, in its unit; the cheapest point within it is chosen.
    pub error: Option<f64>,
    /// Largest number of cycles of a frame, at zero wait.
    pub cycles: Option<u64>,
    /// Largest size of the blob; a slot's ([`SLOT_BYTES`]) unless given.
    pub blob_bytes: Option<usize>,
    /// Least number of frames a second.
    pub frame_rate_hz: Option<f64>,
    /// Longest time of scan and decoding.
    pub latency_ms: Option<f64>,
}

/// What a way to decode has to offer: everything that can be bounded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Offer {
    pub rmse: f64,
    pub cycles: u64,
    pub blob_bytes: usize,
    pub times: Times,
}

impl Bounds {
    /// Checks that the bounds can be met at all.
    pub fn check(&self) -> Result<(), BadValue> {
        for Unmet { bounded, bound, .. } in self.each() {
            if !(bound.is_finite() && bound > 0.0) {
                return Err(BadValue::new(bounded.option(), bound, "give a positive number"));
            }
        }
        Ok(())
    }

    /// Whether any bound is given.
    pub fn any(&self) -> bool {
        *self != Self::default()
    }

    /// Index of the best offer within all bounds; `None` if no bound was given.
    ///
    /// The best offer is the cheapest one within the bound on the error; without such a bound, the cheapest of those that are
    /// as good as the one with the smallest error, by `is_as_good` of two indices. The cheapest takes the least time for
    /// scan and decoding; among equals, the fewest cycles, then the least flash.
    ///
    /// # Errors
    /// [`NoPoint`] if no offer is within the bounds, with the nearest that offers come to them.
    pub(super) fn choose(
        &self,
        offers: &[Offer],
        is_as_good: &dyn Fn(usize, usize) -> bool,
        unit: &str,
    ) -> Result<Option<usize>, NoPoint> {
        if !self.any() {
            return Ok(None);
        }
        let bounds = self.each();
        let within = |i: &usize| within(&bounds, &offers[*i], None);
        let by_error = |a: &usize, b: &usize| offers[*a].rmse.total_cmp(&offers[*b].rmse);
        let least = (0..offers.len()).filter(within).min_by(by_error);
        let least = least.filter(|_| self.error.is_none());
        let key = |i: usize| {
            let Offer { rmse, cycles, blob_bytes, times } = offers[i];
            [times.frame_ms, cycles as f64, blob_bytes as f64, rmse]
        };
        let compare = |a: &usize, b: &usize| {
            let ordered = key(*a).into_iter().zip(key(*b)).map(|(a, b)| a.total_cmp(&b));
            ordered.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
        };
        let near = |i: &usize| within(i) && least.is_none_or(|least| is_as_good(*i, least));
        let best = (0..offers.len()).filter(near).min_by(compare);
        best.map(Some).ok_or_else(|| refusal(&bounds, offers, unit, false))
    }

    /// Checks that the bounds can be met by any of the `offers` that are known before anything is trained: the least that
    /// each way to decode can come down to.
    pub(super) fn check_possible(&self, offers: &[Offer], unit: &str) -> Result<(), NoPoint> {
        let bounds = if self.any() { self.each() } else { vec![] };
        if offers.is_empty() || offers.iter().any(|offer| within(&bounds, offer, None)) {
            return Ok(());
        }
        Err(refusal(&bounds, offers, unit, true))
    }

    /// Every bound that applies, without the nearest value.
    fn each(&self) -> Vec<Unmet> {
        let unmet = |bounded, bound| Unmet { bounded, bound, is_slot: false, nearest: f64::NAN };
        let given = [
            (Bounded::Error, self.error),
            (Bounded::Cycles, self.cycles.map(|cycles| cycles as f64)),
            (Bounded::FrameRate, self.frame_rate_hz),
            (Bounded::Latency, self.latency_ms),
        ];
        let given = given.into_iter().filter_map(|(of, bound)| Some(unmet(of, bound?)));
        let most = self.blob_bytes.unwrap_or(SLOT_BYTES) as f64;
        let is_slot = self.blob_bytes.is_none();
        given.chain([Unmet { is_slot, ..unmet(Bounded::Flash, most) }]).collect()
    }
}

impl Offer {
    /// Quantity that can be bounded.
    fn of(&self, bounded: Bounded) -> f64 {
        match bounded {
            Bounded::Error => self.rmse,
            Bounded::Cycles => self.cycles as f64,
            Bounded::Flash => self.blob_bytes as f64,
            Bounded::FrameRate => self.times.frames_per_s,
            Bounded::Latency => self.times.frame_ms,
        }
    }
}

/// Whether an offer is within all bounds, but for one of them.
fn within(bounds: &[Unmet], offer: &Offer, but_for: Option<Bounded>) -> bool {
    let mut others = bounds.iter().filter(|unmet| Some(unmet.bounded) != but_for);
    others.all(|unmet| unmet.bounded.allows(offer.of(unmet.bounded), unmet.bound))
}

/// Bounds that no offer meets. If each can be met, the nearest that offers within the others come to it.
fn refusal(bounds: &[Unmet], offers: &[Offer], unit: &str, predicted: bool) -> NoPoint {
    let nearest = |bounded: Bounded, offers: &mut dyn Iterator<Item = &Offer>| {
        offers.map(|offer| offer.of(bounded)).reduce(|a, b| bounded.nearer(a, b))
    };
    let unmet = bounds.iter().filter_map(|bound| {
        let nearest = nearest(bound.bounded, &mut offers.iter())?;
        let missed = !bound.bounded.allows(nearest, bound.bound);
        missed.then_some(Unmet { nearest, ..*bound })
    });
    let (unmet, unit): (Vec<Unmet>, String) = (unmet.collect(), unit.into());
    if !unmet.is_empty() {
        return NoPoint::Each { unmet, unit, predicted };
    }
    let near = bounds.iter().map(|bound| {
        let mut others = offers.iter().filter(|o| within(bounds, o, Some(bound.bounded)));
        let nearest = nearest(bound.bounded, &mut others);
        (Unmet { nearest: nearest.unwrap_or(f64::NAN), ..*bound }, nearest.is_some())
    });
    NoPoint::Together { bounds: near.collect(), unit, predicted }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn offer(rmse: f64, scan_ms: f64, cycles: u64) -> Offer {
        let decode_ms = cycles as f64 / 180_000.0;
        let frame_ms = scan_ms + decode_ms;
        let times = Times {
            scan_ms: Some(scan_ms),
            decode_ms,
            frame_ms,
            frames_per_s: 1000.0 / frame_ms,
            age_ms: None,
        };
        Offer { rmse, cycles, blob_bytes: 1000, times }
    }

    /// One sample a reading and many centres; four samples and few centres; four samples and many centres.
    fn offers() -> [Offer; 3] {
        [offer(0.04, 6.0, 36_000), offer(0.04, 23.0, 18_000), offer(0.03, 23.0, 36_000)]
    }

    #[test]
    fn the_cheapest_point_takes_the_least_time_for_scan_and_decoding() {
        let chosen = |bounds: Bounds| {
            bounds.choose(&offers(), &|a, b| offers()[a].rmse <= offers()[b].rmse, "mm").unwrap()
        };
        assert_eq!(chosen(Bounds::default()), None);
        // Fewer cycles do not make up for a longer scan.
        assert_eq!(chosen(Bounds { error: Some(0.045), ..Bounds::default() }), Some(0));
        assert_eq!(chosen(Bounds { error: Some(0.035), ..Bounds::default() }), Some(2));
        assert_eq!(chosen(Bounds { cycles: Some(50_000), ..Bounds::default() }), Some(2));
        assert_eq!(chosen(Bounds { cycles: Some(20_000), ..Bounds::default() }), Some(1));
        assert_eq!(chosen(Bounds { frame_rate_hz: Some(100.0), ..Bounds::default() }), Some(0));
        assert_eq!(chosen(Bounds { frame_rate_hz: Some(43.0), ..Bounds::default() }), Some(2));
        assert_eq!(chosen(Bounds { latency_ms: Some(6.2), ..Bounds::default() }), Some(0));
    }

    #[test]
    fn what_no_slot_holds_is_not_chosen_unless_a_bound_allows_it() {
        let large = Offer { blob_bytes: SLOT_BYTES + 1, ..offer(0.03, 6.0, 9000) };
        let offers = [large, offer(0.04, 6.0, 36_000)];
        let chosen = |blob_bytes| {
            let bounds = Bounds { error: Some(0.05), blob_bytes, ..Bounds::default() };
            bounds.choose(&offers, &|a, b| a == b, "mm").unwrap()
        };
        assert_eq!((chosen(None), chosen(Some(SLOT_BYTES + 1))), (Some(1), Some(0)));
    }

    #[test]
    fn nobody_pays_for_an_error_that_is_smaller_by_next_to_nothing() {
        let offers =
            [offer(0.0404, 6.0, 9000), offer(0.0401, 6.0, 36_000), offer(0.04, 6.0, 90_000)];
        let rate = Bounds { frame_rate_hz: Some(100.0), ..Bounds::default() };
        assert_eq!(
            rate.choose(&offers, &|a, b| offers[a].rmse <= 1.005 * offers[b].rmse, "mm").unwrap(),
            Some(1)
        );
    }

    #[test]
    fn a_refusal_names_the_nearest_value_which_can_be_asked_for() {
        let none = Bounds::default();
        for (bounds, nearest) in [
            (Bounds { frame_rate_hz: Some(500.0), ..none }, "the highest rate is 161.2 frames"),
            (Bounds { latency_ms: Some(1.0), ..none }, "the shortest time is 6.200 ms"),
            (
                Bounds { error: Some(0.035), frame_rate_hz: Some(100.0), ..none },
                "without --frame-rate 100, the highest rate is 43.1 frames",
            ),
        ] {
            let refused = bounds
                .choose(&offers(), &|a, b| offers()[a].rmse <= offers()[b].rmse, "mm")
                .unwrap_err()
                .to_string();
            assert!(refused.contains(nearest), "{refused}");
        }
    }

    #[test]
    fn only_bounds_that_nothing_can_meet_are_refused_beforehand() {
        let check = |bounds: Bounds| bounds.check_possible(&offers(), "mm");
        assert!(check(Bounds::default()).is_ok());
        assert!(check(Bounds { frame_rate_hz: Some(160.0), ..Bounds::default() }).is_ok());
        let refused = check(Bounds { blob_bytes: Some(999), ..Bounds::default() }).unwrap_err();
        let refused = refused.to_string();
        assert!(refused.contains("the smallest blob takes at least 1000 bytes"), "{refused}");
        assert!(refused.ends_with("raise the bound; nothing was trained"), "{refused}");
    }
}
