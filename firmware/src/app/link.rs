//! The host's side: reports to it, and what is counted for it.

use serde::Serialize;

use super::frame_clock::LongClock;
use crate::link::message::{KeepFault, Refusal, Report, Setting, Statistics};
use crate::link::{cobs, packet};
use crate::platform::{Clock, Line, Storage, Watchdog};
use crate::store::KeepError;

/// Longest time in µs without progress of a report; then it is given up.
const STALL_US: u32 = 50_000;
/// Longest time in µs that all reports of a turn of the loop may take together. With the longest scan it is less
/// than a watchdog's period.
const TURN_US: u32 = 2_000_000;

/// Most writes between two restarts: flash wears, and a host may be in an endless loop.
const MOST_WRITES: u16 = 100;

/// The board's serial line, with room for one report.
pub struct Link<'m, P> {
    platform: P,
    buffer: &'m mut [u8],
    time: LongClock,
    pub statistics: Statistics,
    /// Number of times that the host may still have something kept before the next restart.
    pub writes_left: u16,
    /// Whether the last report was given up in the middle, so that its frame must still be ended.
    cut: bool,
    /// What is left of [`TURN_US`].
    left_us: u32,
}

impl<P: Watchdog> Link<'_, P> {
    /// Counts a write of `kept`, if there was one, and converts its outcome.
    pub fn count_write(&mut self, kept: Result<bool, KeepError>) -> Result<(), Refusal> {
        if kept != Ok(false) {
            self.platform.feed_watchdog(); // an erase may have taken half a second
            self.writes_left = self.writes_left.saturating_sub(1);
        }
        match kept {
            Ok(_) => Ok(()),
            Err(KeepError::TooLarge) => Err(Refusal::Keep(KeepFault::TooLarge)),
            Err(KeepError::Failed) => Err(Refusal::Flash),
        }
    }

    /// Keeps the postcard fields of `content` for `setting`.
    pub fn keep<T: Serialize>(&mut self, setting: Setting, content: &T) -> Result<(), Refusal>
    where
        P: Storage,
    {
        let bytes = postcard::to_slice(content, self.buffer);
        let bytes = bytes.map_err(|_| Refusal::Keep(KeepFault::TooLarge))?;
        let written = self.platform.journal().keep(setting.into(), &[bytes]);
        self.count_write(written)
    }

    /// Checks that the host may have something kept.
    pub fn may_write(&self) -> Result<(), Refusal> {
        if self.writes_left > 0 { Ok(()) } else { Err(Refusal::Keep(KeepFault::TooOften)) }
    }
}

impl<'m, P: Line + Clock> Link<'m, P> {
    pub fn new(mut platform: P, buffer: &'m mut [u8]) -> Self {
        let time = LongClock::starting_at(platform.now_us());
        let (statistics, writes_left) = (Statistics::default(), MOST_WRITES);
        Self { platform, buffer, time, statistics, writes_left, cut: false, left_us: TURN_US }
    }

    /// Begins a turn of the loop.
    pub fn begin_turn(&mut self) {
        self.left_us = TURN_US;
    }

    pub fn platform(&mut self) -> &mut P {
        &mut self.platform
    }

    /// The time in µs that has passed since the start.
    pub fn now_us(&mut self) -> u64 {
        self.time.at(self.platform.now_us())
    }

    /// Sends one report. If the host's side takes no more bytes, it is lost, which the statistics count. Returns whether all
    /// bytes were taken.
    pub fn send(&mut self, number: u16, report: &Report<'_>) -> bool {
        let sent = self.try_send(number, report);
        if !sent {
            let lost = &mut self.statistics.lost_reports;
            *lost = lost.saturating_add(1);
        }
        sent
    }

    /// Sends one report; returns `false` if the host's side takes no more bytes.
    fn try_send(&mut self, number: u16, report: &Report<'_>) -> bool {
        let Some(bytes) = packet::encode(number, report, self.buffer) else { return false };
        let platform = &mut self.platform;
        let (start_us, left_us) = (platform.now_us(), self.left_us);
        let mut send = |bytes: &[u8]| send_in_time(platform, bytes, start_us, left_us);
        let sent = (!self.cut || send(&[cobs::END])) && cobs::encode(bytes, send);
        self.cut = !sent;
        self.left_us = left_us.saturating_sub(self.platform.now_us().wrapping_sub(start_us));
        sent
    }
}

/// Sends all bytes, unless the other end takes none for [`STALL_US`], or the time is over; returns whether it did.
fn send_in_time<P: Line + Clock>(
    platform: &mut P,
    mut bytes: &[u8],
    start_us: u32,
    left_us: u32,
) -> bool {
    let mut stall_start_us = None;
    loop {
        let taken = platform.send(bytes);
        bytes = bytes.get(taken..).unwrap_or_default();
        if bytes.is_empty() {
            return true;
        }
        let now_us = platform.now_us();
        if taken > 0 {
            stall_start_us = None;
        }
        let stalled_us = now_us.wrapping_sub(*stall_start_us.get_or_insert(now_us));
        if stalled_us >= STALL_US || now_us.wrapping_sub(start_us) >= left_us {
            return false;
        }
    }
}
