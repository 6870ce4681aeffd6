//! Times of samples and scans, as pure functions.
//!
//! Waiting times are rounded up; a time that does not fit its type becomes the type's largest number.

use crate::capacity::Capacity;
use crate::link::message::Configuration;
use crate::readout::{RowTimes, SCANS_A_ROUND};

/// Clock in Hz of a bus of MCP3208 converters on a processor like the NUCLEO-F446RE's: 45 MHz/64. They take at most 1 MHz
/// at 3.3 V, and the divider has powers of two.
const NUCLEO_SPI_HZ: u32 = 703_125;

/// Clock of the NUCLEO-F446RE's processor in MHz, while it has the ST-LINK's clock.
pub const NUCLEO_MHZ: u32 = 180;

/// Speed of the NUCLEO-F446RE's serial line in bits a second, unless its image is built for another.
pub const NUCLEO_BAUD: u32 = 921_600;

/// Bytes that a sample of an MCP3208 takes on its bus.
const MCP3208_BYTES: u32 = 3;

/// Times in ns that code takes on such a processor: for a sample besides its clocks, above all the 500 ns for which the
/// chip select must be high; to turn a sample into a reading; and for a row, to shift it into the register and start.
/// From the cycles of an emulated board with such a readout, whose scans were within 3 % of the plan.
const NUCLEO_SAMPLE_NS: u32 = 1_350;
const NUCLEO_READING_NS: u32 = 850;
const NUCLEO_ROW_NS: u32 = 17_300;

/// Readout by the NUCLEO-F446RE's own converters: three convert at once, three columns each one after the other, and
/// nine multiplexers give each two halves of the columns. Their clock is an eighth of the processor's, and so of the
/// timers'.
const ONCHIP_TICKS_A_CYCLE: u32 = 8;

/// Cycles of the converters' clock: to sample a column, which its 6 kΩ and 7 pF need 10 for; to convert it; and from one
/// trigger to the next, three for the trigger itself, and three so that none comes before the converters have ended.
const ONCHIP_SAMPLE_CYCLES: u32 = 15;
const ONCHIP_COLUMN_CYCLES: u32 = ONCHIP_SAMPLE_CYCLES + 12;
const ONCHIP_TRIGGER_CYCLES: u32 = 3 * ONCHIP_COLUMN_CYCLES + 6;

/// Cycles from a trigger until the last of its columns is sampled for certain: then the multiplexers may switch. They have
/// 0.5 µs until the next trigger, and take 0.1.
const ONCHIP_SAMPLED_CYCLES: u32 = ONCHIP_TRIGGER_CYCLES - 12;

/// Most rows that the NUCLEO-F446RE drives.
pub const ONCHIP_ROWS: u16 = 16;
/// Number of columns that its own converters sample.
pub const ONCHIP_COLUMNS: u16 = 18;

/// Most samples of a reading that the NUCLEO-F446RE has memory for at once.
pub const ONCHIP_SAMPLES: u16 = 16;

/// Ticks that DMA may take to change the rows, which lengthen each wait; 0.2 µs. And ticks from the last sample's time to
/// the next row.
const ONCHIP_ROW_TICKS: u32 = 36;
const ONCHIP_END_TICKS: u32 = 16;

/// Time in µs that the processor takes to add up the samples of a scan of 8 × 18 wires by the on-chip converters, before
/// the next one starts. From the cycles of the emulated board.
pub const ONCHIP_SUMS_US: u32 = 61;

/// Time in µs that it then takes to turn the sums into Ω, while the next scan runs. Counted in QEMU: `cargo xtask cycles`.
pub const ONCHIP_READINGS_US: u32 = 160;

/// Ticks of the processor's clock from one trigger of the on-chip converters to the next.
pub const ONCHIP_TRIGGER_TICKS: u16 = (ONCHIP_TRIGGER_CYCLES * ONCHIP_TICKS_A_CYCLE) as u16;

/// Times of a row that is scanned by the NUCLEO-F446RE's own converters, in counts of a timer that divides the
/// processor's clock. The row is driven at count 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RowCounts {
    /// Ticks of the processor's clock in a count.
    pub divider: u16,
    /// Count at which the converters are triggered first, and every [`ONCHIP_TRIGGER_TICKS`] from there on.
    pub trigger: u16,
    /// Count at which the multiplexers switch to the second half of the columns.
    pub switch: u16,
    /// Number of counts of a row.
    pub period: u16,
}

impl RowCounts {
    /// Times for a wait and a number of samples, [`ONCHIP_SAMPLES`] at most, at this clock.
    ///
    /// ```
    /// use taxel_firmware::timing::RowCounts;
    /// let counts = RowCounts::new(20, 12, 180);
    /// assert_eq!((counts.divider, counts.trigger), (1, 3_637)); // 20.2 µs
    /// assert_eq!(counts.period, 20_357); // 113 µs
    /// ```
    pub fn new(settling_us: u32, samples: u16, clock_mhz: u32) -> Self {
        let trigger_ticks = u32::from(ONCHIP_TRIGGER_TICKS);
        let samples = u32::from(samples.clamp(1, ONCHIP_SAMPLES));
        let wait = settling_us.saturating_mul(clock_mhz).saturating_add(ONCHIP_ROW_TICKS);
        let switch = (samples - 1) * trigger_ticks + ONCHIP_SAMPLED_CYCLES * ONCHIP_TICKS_A_CYCLE;
        let rest = 2 * samples * trigger_ticks + ONCHIP_END_TICKS;
        // What rounding up adds is less than two counts.
        let most_counts = u32::from(u16::MAX) - 4;
        let divider = wait.saturating_add(rest).div_ceil(most_counts).min(most_counts);
        let counts = |ticks: u32| ticks.div_ceil(divider.max(1)) as u16;
        let trigger = counts(wait).saturating_add(1);
        Self {
            divider: divider as u16,
            trigger,
            switch: trigger.saturating_add(counts(switch)),
            period: trigger.saturating_add(counts(rest)),
        }
    }
}

/// Time in ns of so many bytes over SPI, without gaps; `u32::MAX` for a clock of 0 Hz.
///
/// ```
/// assert_eq!(taxel_firmware::timing::spi_transfer_ns(3, 1_000_000), 24_000);
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
    /// Number of columns that the board can sample.
    pub board_columns: u16,
    /// Waiting time in µs after every change of the rows.
    pub settling_us: u32,
    /// Number of samples averaged for a reading.
    pub oversampling: u16,
    /// Most samples of a reading between two waits: more take several passes over the rows.
    pub pass_samples: u16,
    /// Time of one sample in ns.
    pub sample_ns: u32,
    /// Time in ns to turn the samples of a reading into Ω.
    pub reading_ns: u32,
    /// Time in ns for a row besides its wait, its samples and its readings.
    pub row_ns: u32,
    /// Time in ns from the end of one pass to the start of the next.
    pub between_passes_ns: u32,
}

impl ScanPlan {
    /// Plan of a [`Scanner`](crate::readout::Scanner) with a 74HC595 and MCP3208 converters, for so many wires: a
    /// processor like the NUCLEO-F446RE's, and the first configuration's wait.
    ///
    /// ```
    /// assert_eq!(taxel_firmware::timing::ScanPlan::of_spi(8, 18, 1).scan_us(), 5_573);
    /// ```
    pub fn of_spi(rows: u16, columns: u16, oversampling: u16) -> Self {
        Self {
            rows,
            columns,
            board_columns: columns.max(Capacity::PAPER.columns as u16),
            settling_us: Configuration::DEFAULT.scan.settling_us,
            oversampling,
            pass_samples: u16::MAX,
            sample_ns: spi_transfer_ns(MCP3208_BYTES, NUCLEO_SPI_HZ) + NUCLEO_SAMPLE_NS,
            reading_ns: NUCLEO_READING_NS,
            row_ns: NUCLEO_ROW_NS,
            between_passes_ns: 0,
        }
    }

    /// Plan of the image that reads the sensor by the NUCLEO-F446RE's own converters, for so many rows. It samples all
    /// columns, however many are requested. Meanwhile, the processor decodes the previous frame.
    ///
    /// ```
    /// use taxel_firmware::timing::ScanPlan;
    /// assert_eq!(ScanPlan::of_nucleo_onchip(8, 18, 1).scan_us(), 226);
    /// assert_eq!(ScanPlan::of_nucleo_onchip(8, 3, 12).scan_us(), 913);
    /// ```
    pub fn of_nucleo_onchip(rows: u16, columns: u16, oversampling: u16) -> Self {
        let columns = columns.max(ONCHIP_COLUMNS);
        let ns = |ticks: u32| ticks * 1000 / NUCLEO_MHZ;
        Self {
            rows,
            columns,
            board_columns: columns,
            settling_us: Configuration::DEFAULT.scan.settling_us,
            oversampling,
            pass_samples: ONCHIP_SAMPLES,
            // Half of the columns at once.
            sample_ns: ns(2 * u32::from(ONCHIP_TRIGGER_TICKS)).div_ceil(u32::from(ONCHIP_COLUMNS)),
            reading_ns: 0,
            row_ns: ns(ONCHIP_ROW_TICKS + ONCHIP_END_TICKS),
            between_passes_ns: ONCHIP_SUMS_US * 1000,
        }
    }

    /// Time of a scan in µs, as a mean over a round of [`SCANS_A_ROUND`].
    ///
    /// ```
    /// use taxel_firmware::timing::{ScanPlan, spi_transfer_ns};
    /// let plan = ScanPlan {
    ///     rows: 8,
    ///     columns: 18,
    ///     board_columns: 18,
    ///     settling_us: 20,
    ///     oversampling: 2,
    ///     pass_samples: u16::MAX,
    ///     sample_ns: spi_transfer_ns(3, 1_000_000),
    ///     reading_ns: 0,
    ///     row_ns: 0,
    ///     between_passes_ns: 0,
    /// };
    /// assert_eq!(plan.scan_us(), 7_128); // fits the 10 ms of 100 Hz
    /// assert_eq!(plan.longest_us(), 7_956); // with idle samples
    /// ```
    pub fn scan_us(&self) -> u32 {
        let each_ns = self.of_round_ns() / u64::from(SCANS_A_ROUND);
        in_us(self.of_rows_ns().saturating_add(each_ns))
    }

    /// Time in µs of a scan that begins a round. The first one of a model that scans a part of the columns takes longer.
    pub fn longest_us(&self) -> u32 {
        in_us(self.of_rows_ns().saturating_add(self.of_round_ns()))
    }

    /// Number of passes over the rows.
    pub fn passes(&self) -> u16 {
        self.oversampling.div_ceil(self.pass_samples.max(1)).max(1)
    }

    /// When rows are read, in the mean over all passes.
    ///
    /// ```
    /// use taxel_firmware::timing::ScanPlan;
    /// let times = ScanPlan::of_nucleo_onchip(8, 18, 12).row_times();
    /// assert_eq!((times.first_us.round(), times.step_us.round()), (67.0, 113.0)); // the first 20 µs of 113 are a wait
    /// ```
    pub fn row_times(&self) -> RowTimes {
        let passes = f32::from(self.passes());
        let step_us = self.step_ns(self.columns) as f32 / (1000.0 * passes);
        let between_us = self.between_passes_ns as f32 / 1000.0;
        let pass_us = f32::from(self.rows) * step_us + between_us;
        let first_us = 0.5 * (step_us + self.settling_us as f32 + (passes - 1.0) * pass_us);
        RowTimes { first_us, step_us }
    }

    fn of_rows_ns(&self) -> u64 {
        let readings_ns = u64::from(self.columns) * u64::from(self.reading_ns);
        let row_ns = self.step_ns(self.columns).saturating_add(readings_ns);
        let between_ns =
            u64::from(self.passes().saturating_sub(1)) * u64::from(self.between_passes_ns);
        u64::from(self.rows).saturating_mul(row_ns).saturating_add(between_ns)
    }

    /// Time in ns that the first scan of a round takes besides its rows: for samples of every column while all rows idle,
    /// and of columns that are not read.
    fn of_round_ns(&self) -> u64 {
        let others = self.board_columns.saturating_sub(self.columns);
        self.step_ns(self.board_columns).saturating_add(self.samples_ns(others))
    }

    /// Time in ns to change the rows, wait, and sample so many columns.
    fn step_ns(&self, columns: u16) -> u64 {
        let wait_ns = u64::from(self.settling_us) * 1000 + u64::from(self.row_ns);
        self.samples_ns(columns).saturating_add(wait_ns.saturating_mul(self.passes().into()))
    }

    fn samples_ns(&self, columns: u16) -> u64 {
        let samples = u64::from(columns) * u64::from(self.oversampling.max(1));
        samples.saturating_mul(u64::from(self.sample_ns))
    }
}

fn in_us(ns: u64) -> u32 {
    u32::try_from(ns.div_ceil(1000)).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::readout::{LONGEST_SCAN_US, ScanSettings};

    const PLAN: ScanPlan = ScanPlan {
        rows: 8,
        columns: 18,
        board_columns: 18,
        settling_us: 10,
        oversampling: 1,
        pass_samples: u16::MAX,
        sample_ns: 1_500,
        reading_ns: 0,
        row_ns: 2_000,
        between_passes_ns: 0,
    };

    #[test]
    fn the_boards_scan_leaves_a_third_of_the_period() {
        let Configuration { frame_period_us, scan, .. } = Configuration::DEFAULT;
        let plan = ScanPlan::of_spi(8, 18, scan.oversampling);
        // docs/board.md has these.
        let sampling = ScanPlan { sample_ns: 34_134, reading_ns: 0, row_ns: 0, ..plan };
        assert_eq!(sampling.scan_us(), 5_115);
        assert_eq!((plan.scan_us(), plan.longest_us()), (5_573, 6_207));
        assert!(plan.longest_us() * 3 <= frame_period_us * 2);
    }

    #[test]
    fn own_converters_are_triggered_in_time_for_every_setting() {
        for clock_mhz in [158, 180] {
            for settling_us in [0, 1, 20, 363, 1_000, 10_000] {
                for samples in 1..=ONCHIP_SAMPLES {
                    let at = RowCounts::new(settling_us, samples, clock_mhz);
                    let ticks = |count: u16| u32::from(count) * u32::from(at.divider);
                    let trigger = u32::from(ONCHIP_TRIGGER_TICKS);
                    // Driven at count 1, and 0.15 µs for DMA to do so.
                    assert!(ticks(at.trigger - 1) >= settling_us * clock_mhz + 27, "{at:?}");
                    let last = ticks(at.trigger) + (u32::from(samples) - 1) * trigger;
                    let sampled = last + (3 + 2 * ONCHIP_COLUMN_CYCLES + ONCHIP_SAMPLE_CYCLES) * 8;
                    let next = last + trigger;
                    assert!(ticks(at.switch) >= sampled, "{at:?}: {samples}");
                    // 0.1 µs to switch, and as much for DMA.
                    assert!(ticks(at.switch) + 2 * clock_mhz / 10 <= next, "{at:?}: {samples}");
                    assert!(
                        ticks(at.period) >= ticks(at.trigger) + 2 * u32::from(samples) * trigger
                    );
                    assert!(at.divider == 1 || ticks(at.period) > u32::from(u16::MAX) - 8);
                }
            }
        }
    }

    #[test]
    fn a_scan_by_the_boards_own_converters_is_its_rows() {
        for (samples, passes) in [(1, 1), (12, 1), (16, 1), (17, 2), (256, 16)] {
            let plan = ScanPlan::of_nucleo_onchip(8, 18, samples);
            let counts = RowCounts::new(20, 1, NUCLEO_MHZ);
            let row_ticks = u64::from(counts.period) + 1; // the last row ends at count 0
            let more = u64::from(ONCHIP_TRIGGER_TICKS) * 2 * u64::from(samples - passes);
            let us = (8 * (row_ticks * u64::from(passes) + more)) as f32 / NUCLEO_MHZ as f32;
            // With an idle line, and sums that are added up between two passes.
            let between_us = u32::from(plan.passes() - 1) * ONCHIP_SUMS_US;
            let computed = ((plan.longest_us() - between_us) as f32) * 8.0 / 9.0;
            assert!((computed / us - 1.0).abs() < 0.01, "{samples}: {us} {computed}");
        }
        assert_eq!(ScanPlan::of_nucleo_onchip(8, 18, 1).longest_us(), 253);
        assert_eq!(ScanPlan::of_nucleo_onchip(8, 18, 12).longest_us(), 1019);
    }

    #[test]
    fn every_scan_that_can_be_configured_ends_before_the_time_limit() {
        let (settling_us, oversampling) =
            (ScanSettings::MOST_SETTLING_US, ScanSettings::MOST_OVERSAMPLING);
        let plan = ScanPlan::of_nucleo_onchip(ONCHIP_ROWS, ONCHIP_COLUMNS, oversampling);
        let longest_us = ScanPlan { settling_us, ..plan }.longest_us();
        assert!(u64::from(longest_us) < LONGEST_SCAN_US, "{longest_us}");
    }

    #[test]
    fn a_scan_is_its_waits_and_its_samples() {
        let [row_ns, sample_ns] = [12_000, 1_500];
        // Idle samples are a row more, once in 16 scans.
        let rows_us = 8 * row_ns / 1000 + 8 * 18 * sample_ns / 1000;
        assert_eq!(PLAN.longest_us(), rows_us + row_ns / 1000 + 18 * sample_ns / 1000);
        assert_eq!(PLAN.scan_us(), rows_us + (12_000_u32 + 18 * 1500).div_ceil(16_000));
        // A part of the columns, and the others of one row once in 16 scans.
        let part = ScanPlan { columns: 3, ..PLAN };
        assert_eq!(part.longest_us(), 9 * row_ns / 1000 + (8 * 3 + 18 + 15) * 3 / 2 + 1);
        let four = ScanPlan { oversampling: 4, ..PLAN };
        assert_eq!(four.longest_us(), 9 * 12 + 4 * 9 * 18 * 3 / 2);
    }

    #[test]
    fn a_scan_beyond_u32_takes_the_longest_time() {
        let (rows, settling_us, oversampling) = (u16::MAX, u32::MAX, u16::MAX);
        let endless = ScanPlan { rows, settling_us, oversampling, pass_samples: 1, ..PLAN };
        assert_eq!((endless.scan_us(), endless.longest_us()), (u32::MAX, u32::MAX));
    }
}
