//! A clock for frames: tells when the next one is due.

/// Counts frame periods by a clock in µs that wraps around to 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameClock {
    /// Time in µs at which the last period began.
    last_us: u32,
}

impl FrameClock {
    /// Makes a clock whose first frame is due one period after `now_us`.
    pub const fn starting_at(now_us: u32) -> Self {
        Self { last_us: now_us }
    }

    /// Lets the next frame be due one period after `now_us`.
    pub fn restart(&mut self, now_us: u32) {
        self.last_us = now_us;
    }

    /// Whether a frame is due: `Some` number of earlier frames that were missed, or `None` if none is due yet.
    ///
    /// Must be called more often than the clock wraps around. With a period of 0 no frame is ever due.
    pub fn due(&mut self, now_us: u32, period_us: u32) -> Option<u32> {
        let elapsed_us = now_us.wrapping_sub(self.last_us);
        let periods = elapsed_us.checked_div(period_us).filter(|periods| *periods > 0)?;
        self.last_us = self.last_us.wrapping_add(periods.wrapping_mul(period_us));
        Some(periods - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_keep_to_the_period_however_late_they_are_looked_for() {
        let mut clock = FrameClock::starting_at(100);
        assert_eq!(clock.due(1099, 1000), None);
        assert_eq!(clock.due(1700, 1000), Some(0)); // late by 600 µs
        assert_eq!(clock.due(2099, 1000), None);
        assert_eq!(clock.due(2100, 1000), Some(0)); // on time, although the last was late
        assert_eq!(clock.due(6050, 1000), Some(2)); // frames at 3100 and 4100 were missed
        assert_eq!(clock.due(6099, 1000), None);
        assert_eq!(clock.due(6100, 1000), Some(0));
    }

    #[test]
    fn the_clock_may_start_anew() {
        let mut clock = FrameClock::starting_at(u32::MAX - 400);
        assert_eq!(clock.due(598, 1000), None);
        assert_eq!(clock.due(599, 1000), Some(0));
        assert_eq!(clock.due(1598, 1000), None);
    }

    #[test]
    fn a_period_of_zero_is_never_due() {
        assert_eq!(FrameClock::starting_at(0).due(u32::MAX, 0), None);
    }
}
