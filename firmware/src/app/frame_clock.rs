//! Clocks for frames: when the next one is due, and the time since the start.

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

/// Time since the start in µs, from a clock of 32 bits that wraps around to 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LongClock {
    us: u64,
}

impl LongClock {
    /// Makes a clock that shows `now_us`.
    pub const fn starting_at(now_us: u32) -> Self {
        Self { us: now_us as u64 }
    }

    /// Time since the start in µs, when the short clock shows `now_us`.
    ///
    /// Must be called more often than the short clock wraps around.
    pub fn at(&mut self, now_us: u32) -> u64 {
        self.us += u64::from(now_us.wrapping_sub(self.us as u32));
        self.us
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_goes_on_where_the_short_clock_wraps_around() {
        let mut clock = LongClock::starting_at(u32::MAX - 1);
        assert_eq!(clock.at(u32::MAX), u64::from(u32::MAX));
        assert_eq!(clock.at(5), u64::from(u32::MAX) + 6);
        assert_eq!(clock.at(5), u64::from(u32::MAX) + 6);
        assert_eq!(clock.at(4), 2 * (1 << 32) + 4);
    }

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
        assert_eq!(clock.due(u32::MAX, 0), None); // no period at all
        let mut clock = FrameClock::starting_at(u32::MAX - 400);
        assert_eq!(clock.due(598, 1000), None);
        assert_eq!(clock.due(599, 1000), Some(0));
        assert_eq!(clock.due(1598, 1000), None);
    }
}
