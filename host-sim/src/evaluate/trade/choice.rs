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
        let within = |point: &Point| {
            self.error.is_none_or(|most| point.rmse(group) <= most)
                && self.cycles.is_none_or(|most| point.frame.cycles <= most)
                && point.flash_bytes <= self.flash_bytes.unwrap_or(super::SLOT_BYTES)
        };
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
            .filter(|i| within(&points[*i]))
            .min_by(|a, b| compare(&key(&points[*a]), &key(&points[*b])));
        best.map(Some).ok_or_else(|| {
            let least = |of: fn(&Point) -> f64| points.iter().map(of).fold(f64::INFINITY, f64::min);
            let error = points.iter().map(|p| p.rmse(group)).fold(f64::INFINITY, f64::min);
            Error::Usage(format!(
                "no point is within {self}; the smallest error is {error:.4} {unit} ({group}), the fewest \
                 cycles {}, the smallest blob {} bytes: loosen a limit",
                least(|p| p.frame.cycles as f64),
                least(|p| p.flash_bytes as f64)
            ))
        })
    }
}

impl std::fmt::Display for Limits {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let error = self.error.map(|error| format!("--max-error {error}"));
        let cycles = self.cycles.map(|cycles| format!("--max-cycles {cycles}"));
        let flash = self.flash_bytes.map(|bytes| format!("--max-flash {bytes}"));
        let given: Vec<String> = [error, cycles, flash].into_iter().flatten().collect();
        f.write_str(&given.join(" "))
    }
}
