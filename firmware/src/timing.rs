//! Times of settling, samples and scans, as pure functions.
//!
//! Waiting times are rounded up; a time that does not fit its type becomes the type's largest number.

use crate::link::message::Configuration;

/// Clock of the converters' bus on the NUCLEO-F446RE in Hz: 45 MHz/64. An MCP3208 takes at most 1 MHz at 3.3 V, and the
/// divider has powers of two.
pub const NUCLEO_SPI_HZ: u32 = 703_125;

/// Bytes that a sample of an MCP3208 takes on its bus.
const MCP3208_BYTES: u32 = 3;

/// Time constant in ns of a resistance (Ω) that charges a capacitance (pF).
///
/// ```
/// assert_eq!(firmware::timing::time_constant_ns(560.0, 1000.0), 560.0); // 560 Ω and 1 nF
/// ```
pub fn time_constant_ns(resistance_ohm: f32, capacitance_pf: f32) -> f32 {
    resistance_ohm * capacitance_pf / 1000.0
}

/// Time in µs until a voltage is within half a count of its final value: τ·ln 2^(bits + 1).
///
/// ```
/// use firmware::timing::settling_us;
/// assert_eq!(settling_us(5_000.0, 12), 46); // τ = 5 µs, 12 bits: nine time constants
/// ```
pub fn settling_us(time_constant_ns: f32, bits: u8) -> u32 {
    let us = time_constant_ns * 1e-3 * ((f32::from(bits) + 1.0) * core::f32::consts::LN_2);
    let whole = us as u32; // saturates; NaN and negative times become 0
    whole.saturating_add(u32::from((whole as f32) < us))
}

/// Time in ns of so many bytes over SPI, without gaps; `u32::MAX` for a clock of 0 Hz.
///
/// ```
/// assert_eq!(firmware::timing::spi_transfer_ns(3, 1_000_000), 24_000);
/// ```
pub fn spi_transfer_ns(bytes: u32, clock_hz: u32) -> u32 {
    if clock_hz == 0 {
        return u32::MAX;
    }
    let bits_ns = (u64::from(bytes) * 8).saturating_mul(1_000_000_000);
    u32::try_from(bits_ns.div_ceil(u64::from(clock_hz))).unwrap_or(u32::MAX)
}

/// Plan of a scan: numbers of rows, columns and samples, and the time of each step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScanPlan {
    /// Number of rows that are driven one after the other.
    pub rows: u16,
    /// Number of columns that are sampled for each row.
    pub columns: u16,
    /// Whether every column is sampled once more while all rows idle.
    pub idle_samples: bool,
    /// Waiting time in µs after every change of the rows.
    pub settling_us: u32,
    /// Number of samples averaged for a reading.
    pub oversampling: u16,
    /// Time of one sample in ns.
    pub sample_ns: u32,
}

impl ScanPlan {
    /// Plan of the NUCLEO-F446RE's image for so many wires: its converters' bus, and its first configuration's wait.
    ///
    /// ```
    /// assert_eq!(firmware::timing::ScanPlan::of_nucleo(8, 18, 1).scan_us(), 6_430);
    /// ```
    pub fn of_nucleo(rows: u16, columns: u16, oversampling: u16) -> Self {
        Self {
            rows,
            columns,
            idle_samples: true,
            settling_us: Configuration::DEFAULT.scan.settling_us,
            oversampling,
            sample_ns: spi_transfer_ns(MCP3208_BYTES, NUCLEO_SPI_HZ),
        }
    }

    /// Time of the whole scan in µs.
    ///
    /// ```
    /// use firmware::timing::{ScanPlan, spi_transfer_ns};
    /// let plan = ScanPlan {
    ///     rows: 8,
    ///     columns: 18,
    ///     idle_samples: true,
    ///     settling_us: 46,
    ///     oversampling: 2,
    ///     sample_ns: spi_transfer_ns(3, 1_000_000),
    /// };
    /// assert_eq!(plan.scan_us(), 8_190); // fits the 10 ms of 100 Hz
    /// ```
    pub fn scan_us(&self) -> u32 {
        let steps = u64::from(self.rows) + u64::from(self.idle_samples);
        let samples_of_a_step = u64::from(self.columns) * u64::from(self.oversampling.max(1));
        let sampling_us =
            (steps * samples_of_a_step).saturating_mul(u64::from(self.sample_ns)).div_ceil(1000);
        let waiting_us = steps.saturating_mul(u64::from(self.settling_us));
        u32::try_from(sampling_us.saturating_add(waiting_us)).unwrap_or(u32::MAX)
    }

    /// Largest oversampling at which a scan takes no longer than `period_us`; `None` if a single sample a reading
    /// takes longer.
    ///
    /// ```
    /// # use firmware::timing::ScanPlan;
    /// # let plan = ScanPlan { rows: 8, columns: 18, idle_samples: true, settling_us: 46,
    /// #     oversampling: 1, sample_ns: 24_000 };
    /// assert_eq!(plan.most_oversampling(10_000), Some(2));
    /// assert_eq!(plan.most_oversampling(1_000), None);
    /// ```
    pub fn most_oversampling(&self, period_us: u32) -> Option<u16> {
        let fits = |oversampling| Self { oversampling, ..*self }.scan_us() <= period_us;
        if !fits(1) {
            return None;
        }
        // Bisection: `low` fits, and nothing above `high` fits.
        let (mut low, mut high) = (1_u16, u16::MAX);
        while low < high {
            let middle = high - (high - low) / 2;
            if fits(middle) { low = middle } else { high = middle - 1 }
        }
        Some(low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAN: ScanPlan = ScanPlan {
        rows: 8,
        columns: 18,
        idle_samples: false,
        settling_us: 10,
        oversampling: 1,
        sample_ns: 1_500,
    };

    #[test]
    fn settling_leaves_less_than_half_a_count() {
        for bits in [8, 10, 12, 16] {
            for time_constant_us in [0.7_f64, 5.0, 123.4] {
                let wait_us = f64::from(settling_us((time_constant_us * 1e3) as f32, bits));
                let left_counts = (-wait_us / time_constant_us).exp() * 2_f64.powi(bits.into());
                assert!(left_counts <= 0.5 + 1e-5, "{bits} bits: {left_counts} counts");
                let sooner_us = wait_us - 1.0;
                let left_counts = (-sooner_us / time_constant_us).exp() * 2_f64.powi(bits.into());
                assert!(left_counts > 0.5 - 1e-5, "{bits} bits waits a µs too long");
            }
        }
    }

    #[test]
    fn extremes_end_at_the_largest_number_or_nothing() {
        assert_eq!(settling_us(f32::INFINITY, 12), u32::MAX);
        assert_eq!(settling_us(f32::MAX, u8::MAX), u32::MAX);
        assert_eq!((settling_us(f32::NAN, 12), settling_us(-1.0, 12)), (0, 0));
        assert_eq!((spi_transfer_ns(3, 0), spi_transfer_ns(u32::MAX, 1)), (u32::MAX, u32::MAX));
        let most = ScanPlan {
            rows: u16::MAX,
            columns: u16::MAX,
            idle_samples: true,
            settling_us: u32::MAX,
            oversampling: u16::MAX,
            sample_ns: u32::MAX,
        };
        assert_eq!(most.scan_us(), u32::MAX);
        let nothing = ScanPlan { rows: 0, columns: 0, ..PLAN };
        assert_eq!((nothing.scan_us(), nothing.most_oversampling(0)), (0, Some(u16::MAX)));
    }

    #[test]
    fn the_boards_scan_leaves_a_third_of_the_period() {
        let Configuration { frame_period_us, scan, .. } = Configuration::DEFAULT;
        let plan = ScanPlan::of_nucleo(8, 18, scan.oversampling);
        assert_eq!(plan.scan_us(), 6_430);
        assert!(plan.scan_us() * 3 <= frame_period_us * 2);
        assert_eq!(plan.most_oversampling(frame_period_us), Some(1));
    }

    #[test]
    fn a_scan_is_its_waits_and_its_samples() {
        assert_eq!(PLAN.scan_us(), 8 * 10 + 8 * 18 * 3 / 2);
        let idle = ScanPlan { idle_samples: true, ..PLAN };
        assert_eq!(idle.scan_us(), 9 * 10 + 9 * 18 * 3 / 2);
        assert_eq!(ScanPlan { oversampling: 4, ..PLAN }.scan_us(), 8 * 10 + 4 * 8 * 18 * 3 / 2);
        let most = PLAN.most_oversampling(10_000).unwrap();
        assert!(ScanPlan { oversampling: most, ..PLAN }.scan_us() <= 10_000);
        assert!(ScanPlan { oversampling: most + 1, ..PLAN }.scan_us() > 10_000);
    }
}
