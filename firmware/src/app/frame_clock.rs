//! When the next frame is due.

/// Counts periods of a clock that starts anew after its largest value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameClock {
    /// When the last period began.
    last_us: u32,
}

impl FrameClock {
    /// The first frame is due one period after `now_us`.
    pub const fn starting_at(now_us: u32) -> Self {
        Self { last_us: now_us }
    }

    /// Lets the next frame be due one period after `now_us`.
    pub fn restart(&mut self, now_us: u32) {
        self.last_us = now_us;
    }

    /// `Some` when a frame is due: how many before it could not be scanned in time. Must be called more
    /// often than the clock starts anew; a period of 0 is never due.
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
        assert_eq!(clock.due(2100, 1000), Some(0)); // and yet not delayed
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
