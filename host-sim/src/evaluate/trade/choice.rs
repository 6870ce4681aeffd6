//! Picking one point within limits.

use super::Point;
use crate::error::{Error, Result};

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
    /// [`Error::Usage`] for one that is not a positive number.
    pub fn check(&self) -> Result<()> {
        let positive = [
            ("--max-error", self.error),
            ("--max-cycles", self.cycles.map(|cycles| cycles as f64)),
            ("--max-flash", self.flash_bytes.map(|bytes| bytes as f64)),
        ];
        for (option, limit) in positive {
            if let Some(limit) = limit.filter(|limit| !(limit.is_finite() && *limit > 0.0)) {
                return Err(Error::Usage(format!("{option} {limit}: give a positive number")));
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
    /// [`Error::Usage`] if no point is within the limits: how near the points come.
    pub(super) fn choose(
        &self,
        points: &[Point],
        group: &str,
        unit: &str,
    ) -> Result<Option<usize>> {
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
        best.map(Some).ok_or_else(|| Error::Usage(self.refusal(points, group, unit)))
    }

    fn allow(&self, point: &Point, group: &str) -> bool {
        self.error.is_none_or(|most| point.rmse(group) <= most)
            && self.cycles.is_none_or(|most| point.frame.cycles <= most)
            && point.flash_bytes <= self.flash_bytes.unwrap_or(super::SLOT_BYTES)
    }

    /// How near points within the other limits, or else all points, come to each limit that was given.
    fn refusal(&self, points: &[Point], group: &str, unit: &str) -> String {
        let nearest = |others: Self, what: &str, of: &dyn Fn(&Point) -> f64, decimals: usize| {
            let within = points.iter().filter(|point| others.allow(point, group));
            let (least, whose) = match within.map(of).reduce(f64::min) {
                Some(least) => (least, "within the rest"),
                None => (points.iter().map(of).fold(f64::INFINITY, f64::min), "of all points"),
            };
            format!("the {what} {whose}: {least:.decimals$}")
        };
        let error = self.error.map(|_| {
            let others = Self { error: None, ..*self };
            nearest(others, "smallest error", &|p| p.rmse(group), 4) + &format!(" {unit} ({group})")
        });
        let cycles = self.cycles.map(|_| {
            let others = Self { cycles: None, ..*self };
            nearest(others, "fewest cycles", &|p| p.frame.cycles as f64, 0)
        });
        let others = Self { flash_bytes: Some(usize::MAX), ..*self };
        let flash = nearest(others, "smallest blob", &|p| p.flash_bytes as f64, 0) + " bytes";
        let nearest: Vec<String> = [error, cycles, Some(flash)].into_iter().flatten().collect();
        format!("no point is within {self}; {}: loosen a limit", nearest.join("; "))
    }
}

impl std::fmt::Display for Limits {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let error = self.error.map(|error| format!("--max-error {error}"));
        let cycles = self.cycles.map(|cycles| format!("--max-cycles {cycles}"));
        let flash =
            self.flash_bytes.map_or(format!("a slot of {} bytes", super::SLOT_BYTES), |bytes| {
                format!("--max-flash {bytes}")
            });
        let given: Vec<String> = [error, cycles, Some(flash)].into_iter().flatten().collect();
        f.write_str(&given.join(", "))
    }
}
