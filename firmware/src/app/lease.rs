//! Leases: what a host has changed for a while ends when the host goes away.

/// Time in µs without a request after which an upload ends.
const UPLOAD_US: u32 = 10_000_000;

/// Longest lease in ms, by far less than the clock's turn.
pub const MOST_LEASE_MS: u32 = 1_800_000;

/// When the host was heard last, and how long the configuration in force outlasts its silence. Times are those of a
/// clock in µs that wraps around to 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lease {
    heard_us: u32,
    /// Length of the lease in µs; 0 without one.
    length_us: u32,
}

impl Lease {
    /// Makes a state without a lease.
    pub const NONE: Self = Self { heard_us: 0, length_us: 0 };

    /// Notes a request of the host at the time `now_us`.
    pub fn hear(&mut self, now_us: u32) {
        self.heard_us = now_us;
    }

    /// Starts a lease of `length_ms`, but at most half an hour; 0 ends it.
    pub fn set(&mut self, length_ms: u32) {
        self.length_us = 1000 * length_ms.min(MOST_LEASE_MS);
    }

    /// Time in ms until the lease ends, rounded up; 0 without one.
    pub fn left_ms(self, now_us: u32) -> u32 {
        let left_us = self.length_us.saturating_sub(self.silence_us(now_us));
        if self.length_us == 0 { 0 } else { left_us / 1000 + 1 }
    }

    /// Whether there is a lease, and it has ended. Must be looked at more often than the clock wraps around.
    pub fn has_ended(self, now_us: u32) -> bool {
        self.length_us > 0 && self.silence_us(now_us) >= self.length_us
    }

    /// Whether an upload has ended.
    pub fn has_upload_ended(self, now_us: u32) -> bool {
        self.silence_us(now_us) >= UPLOAD_US
    }

    /// Time in µs without a request.
    fn silence_us(self, now_us: u32) -> u32 {
        now_us.wrapping_sub(self.heard_us)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lease_lasts_from_the_last_request() {
        for start_us in [1_000, u32::MAX - 2_000] {
            let at = |us: u32| start_us.wrapping_add(us);
            let mut lease = Lease::NONE;
            assert!(!lease.has_ended(u32::MAX));
            assert_eq!(lease.left_ms(5), 0);
            lease.hear(start_us);
            lease.set(3);
            assert_eq!((lease.left_ms(start_us), lease.left_ms(at(2_500))), (4, 1));
            assert!(!lease.has_ended(at(2_999)) && lease.has_ended(at(3_000)));
            lease.hear(at(2_999));
            assert!(!lease.has_ended(at(5_998)) && lease.has_ended(at(5_999)));
            assert_eq!(lease.left_ms(at(9_999)), 1);
            lease.set(0);
            assert!(!lease.has_ended(at(u32::MAX - 3_000)));
        }
    }

    #[test]
    fn the_longest_lease_ends_after_half_an_hour() {
        let mut lease = Lease::NONE;
        lease.set(u32::MAX);
        assert!(!lease.has_ended(1_799_999_999) && lease.has_ended(1_800_000_000));
    }

    #[test]
    fn an_upload_outlasts_less_than_its_time_of_silence() {
        let mut lease = Lease::NONE;
        lease.hear(7);
        assert!(!lease.has_upload_ended(10_000_006) && lease.has_upload_ended(10_000_007));
    }
}
