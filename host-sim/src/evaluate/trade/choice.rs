//! Choice of one point within the user's bounds.

use taxel_data::BadValue;

use super::Point;
use crate::error::{Bounded, NoPoint, Unmet};

/// Bounds that a user sets for the chosen point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bounds {
    /// Largest RMSE of the group, in its unit; the cheapest point within it is chosen.
    pub error: Option<f64>,
    /// Largest number of cycles of a frame.
    pub cycles: Option<u64>,
    /// Largest size of the blob; a slot's ([`SLOT_BYTES`](super::SLOT_BYTES)) unless given.
    pub flash_bytes: Option<usize>,
}

impl Bounds {
    /// Checks that the bounds can be met at all.
    ///
    /// # Errors
    /// [`BadValue`] for a bound that is not a positive number.
    pub fn check(&self) -> Result<(), BadValue> {
        let bounds = [
            (Bounded::Error, self.error),
            (Bounded::Cycles, self.cycles.map(|cycles| cycles as f64)),
            (Bounded::Flash, self.flash_bytes.map(|bytes| bytes as f64)),
        ];
        for (bounded, bound) in bounds {
            if let Some(bound) = bound.filter(|bound| !(bound.is_finite() && *bound > 0.0)) {
                return Err(BadValue::new(bounded.name(), bound, "give a positive number"));
            }
        }
        Ok(())
    }

    fn any(&self) -> bool {
        self.error.is_some() || self.cycles.is_some() || self.flash_bytes.is_some()
    }

    /// Index of the best point within all bounds; `None` if no bound was given.
    ///
    /// With a bound on the error, the best point takes the fewest cycles; otherwise it has the smallest
    /// error. Among equals, it needs the fewest samples, then the least flash.
    ///
    /// # Errors
    /// [`NoPoint`] if no point is within the bounds, with the nearest that points come to them.
    pub(super) fn choose(
        &self,
        points: &[Point],
        group: &str,
        unit: &str,
    ) -> Result<Option<usize>, NoPoint> {
        if !self.any() {
            return Ok(None);
        }
        let key = |point: &Point| {
            let (cycles, error) = (point.frame.cycles as f64, point.rmse(group));
            let first = if self.error.is_some() { [cycles, error] } else { [error, cycles] };
            let rest = [point.samples_averaged as f64, point.flash_bytes as f64];
            [first[0], rest[0], rest[1], first[1]]
        };
        let compare = |a: &[f64; 4], b: &[f64; 4]| {
            let ordered = a.iter().zip(b).map(|(a, b)| a.total_cmp(b));
            ordered.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
        };
        let best = (0..points.len())
            .filter(|i| self.allow(&points[*i], group))
            .min_by(|a, b| compare(&key(&points[*a]), &key(&points[*b])));
        best.map(Some).ok_or_else(|| self.refusal(points, group, unit))
    }

    fn allow(&self, point: &Point, group: &str) -> bool {
        self.error.is_none_or(|most| point.rmse(group) <= most)
            && self.cycles.is_none_or(|most| point.frame.cycles <= most)
            && point.flash_bytes <= self.flash_bytes.unwrap_or(super::SLOT_BYTES)
    }

    /// Bounds that no point meets. If each can be met, the nearest that points within the others come to
    /// it.
    fn refusal(&self, points: &[Point], group: &str, unit: &str) -> NoPoint {
        let unit = format!("{unit} ({group})");
        let least = |within: Self, bound: &Bound| {
            let within = points.iter().filter(|point| within.allow(point, group));
            within.map(|point| (bound.of)(point, group)).reduce(f64::min)
        };
        let bounds = self.each();
        let unmet: Vec<Unmet> = bounds
            .iter()
            .filter_map(|bound| {
                let least = least(NONE, bound).filter(|least| *least > bound.unmet.most)?;
                Some(Unmet { least, ..bound.unmet })
            })
            .collect();
        if !unmet.is_empty() {
            return NoPoint::Each { unmet, unit };
        }
        let near = bounds.iter().map(|bound| {
            let least = least(bound.others, bound);
            (Unmet { least: least.unwrap_or(f64::NAN), ..bound.unmet }, least.is_some())
        });
        NoPoint::Together { bounds: near.collect(), unit }
    }

    /// Every bound that applies.
    fn each(&self) -> Vec<Bound> {
        let unmet = |bounded, most| Unmet { bounded, most, is_slot: false, least: f64::NAN };
        let error = self.error.map(|most| Bound {
            unmet: unmet(Bounded::Error, most),
            others: Self { error: None, ..*self },
            of: |point, group| point.rmse(group),
        });
        let cycles = self.cycles.map(|most| Bound {
            unmet: unmet(Bounded::Cycles, most as f64),
            others: Self { cycles: None, ..*self },
            of: |point, _| point.frame.cycles as f64,
        });
        let most = self.flash_bytes.unwrap_or(super::SLOT_BYTES);
        let is_slot = self.flash_bytes.is_none();
        let flash = Bound {
            unmet: Unmet { is_slot, ..unmet(Bounded::Flash, most as f64) },
            others: Self { flash_bytes: NONE.flash_bytes, ..*self },
            of: |point, _| point.flash_bytes as f64,
        };
        error.into_iter().chain(cycles).chain([flash]).collect()
    }
}

/// Bounds that every point is within.
const NONE: Bounds = Bounds { error: None, cycles: None, flash_bytes: Some(usize::MAX) };

/// One of several bounds.
struct Bound {
    /// Description of the bound, with the least value still to be filled in.
    unmet: Unmet,
    /// All bounds but this one.
    others: Bounds,
    /// Quantity of a point that is bounded.
    of: fn(&Point, &str) -> f64,
}
