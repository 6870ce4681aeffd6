//! Picking one point within limits.

use taxel_data::BadValue;

use super::Point;
use crate::error::{Bounded, NoPoint, Unmet};

/// What the chosen point may be at most.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Limits {
    /// RMSE of the group, in its unit: the cheapest point within it is chosen.
    pub error: Option<f64>,
    /// Cycles of a frame.
    pub cycles: Option<u64>,
    /// Bytes of the blob; a slot's ([`SLOT_BYTES`](super::SLOT_BYTES)) unless given.
    pub flash_bytes: Option<usize>,
}

impl Limits {
    /// Whether the limits can be met at all.
    ///
    /// # Errors
    /// A limit that is not a positive number.
    pub fn check(&self) -> Result<(), BadValue> {
        let limits = [
            (Bounded::Error, self.error),
            (Bounded::Cycles, self.cycles.map(|cycles| cycles as f64)),
            (Bounded::Flash, self.flash_bytes.map(|bytes| bytes as f64)),
        ];
        for (bounded, limit) in limits {
            if let Some(limit) = limit.filter(|limit| !(limit.is_finite() && *limit > 0.0)) {
                return Err(BadValue::new(bounded.name(), limit, "give a positive number"));
            }
        }
        Ok(())
    }

    fn any(&self) -> bool {
        self.error.is_some() || self.cycles.is_some() || self.flash_bytes.is_some()
    }

    /// The point within all limits that takes the fewest cycles if an error was given, else the one with
    /// the smallest error; nothing if no limit was given. Among equals, the fewest samples, then the least
    /// flash.
    ///
    /// # Errors
    /// No point is within the limits: how near the points come.
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

    /// Which limits no point meets, or, where each can be met, how near points within the others come to it.
    fn refusal(&self, points: &[Point], group: &str, unit: &str) -> NoPoint {
        let unit = format!("{unit} ({group})");
        let least = |within: Self, limit: &Limit| {
            let within = points.iter().filter(|point| within.allow(point, group));
            within.map(|point| (limit.of)(point, group)).reduce(f64::min)
        };
        let limits = self.each();
        let unmet: Vec<Unmet> = limits
            .iter()
            .filter_map(|limit| {
                let least = least(NONE, limit).filter(|least| *least > limit.unmet.most)?;
                Some(Unmet { least, ..limit.unmet })
            })
            .collect();
        if !unmet.is_empty() {
            return NoPoint::Each { unmet, unit };
        }
        let near = limits.iter().map(|limit| {
            let least = least(limit.others, limit);
            (Unmet { least: least.unwrap_or(f64::NAN), ..limit.unmet }, least.is_some())
        });
        NoPoint::Together { bounds: near.collect(), unit }
    }

    /// Every limit that holds.
    fn each(&self) -> Vec<Limit> {
        let unmet = |bounded, most| Unmet { bounded, most, is_slot: false, least: f64::NAN };
        let error = self.error.map(|most| Limit {
            unmet: unmet(Bounded::Error, most),
            others: Self { error: None, ..*self },
            of: |point, group| point.rmse(group),
        });
        let cycles = self.cycles.map(|most| Limit {
            unmet: unmet(Bounded::Cycles, most as f64),
            others: Self { cycles: None, ..*self },
            of: |point, _| point.frame.cycles as f64,
        });
        let most = self.flash_bytes.unwrap_or(super::SLOT_BYTES);
        let is_slot = self.flash_bytes.is_none();
        let flash = Limit {
            unmet: Unmet { is_slot, ..unmet(Bounded::Flash, most as f64) },
            others: Self { flash_bytes: NONE.flash_bytes, ..*self },
            of: |point, _| point.flash_bytes as f64,
        };
        error.into_iter().chain(cycles).chain([flash]).collect()
    }
}

/// Limits that every point is within.
const NONE: Limits = Limits { error: None, cycles: None, flash_bytes: Some(usize::MAX) };

/// One of several limits.
struct Limit {
    /// What it is, but for the least.
    unmet: Unmet,
    /// All but this one.
    others: Limits,
    /// What it limits.
    of: fn(&Point, &str) -> f64,
}
