//! Default and ranges of a configuration.

use core::ops::RangeInclusive;

use taxel_core::filter::Settings;
use taxel_core::health::Limits;

use crate::link::message::{ConfidenceSent, Configuration, ConfigurationField};
use crate::readout::ScanSettings;

impl Configuration {
    /// Range of frame periods in µs, besides 0.
    pub const FRAME_PERIOD_US: RangeInclusive<u32> = 100..=1_000_000_000;

    /// The default configuration: 100 frames a second, estimates are sent without confidence, limits for rubber of about
    /// 60 Ω, and nothing is filtered.
    pub const DEFAULT: Self = Self {
        frame_period_us: 10_000,
        scan: ScanSettings { settling_us: 20, oversampling: 1 },
        send_readings: false,
        send_estimates: true,
        confidence: ConfidenceSent::Nothing,
        shorted_below_ohm: Limits::USUAL.shorted_below_ohm,
        open_above_ohm: Limits::USUAL.open_above_ohm,
        contact_threshold: 0.02,
        filter_time_constant_us: 0,
        filter_lead_us: 0,
        report_every: 1,
    };

    /// Settings of the filter in time.
    pub fn filter(&self) -> Settings {
        Settings { time_constant_us: self.filter_time_constant_us, lead_us: self.filter_lead_us }
    }

    /// Checks that every field is in its range.
    ///
    /// # Errors
    /// The first field that is not in its range.
    pub fn check(&self) -> Result<(), ConfigurationField> {
        let positive = |value: f32| value.is_finite() && value > 0.0;
        let limits = [self.shorted_below_ohm, self.open_above_ohm];
        let checks = [
            (
                self.frame_period_us == 0 || Self::FRAME_PERIOD_US.contains(&self.frame_period_us),
                ConfigurationField::FramePeriod,
            ),
            (self.scan.settling_us <= ScanSettings::MOST_SETTLING_US, ConfigurationField::Settling),
            (
                (1..=ScanSettings::MOST_OVERSAMPLING).contains(&self.scan.oversampling),
                ConfigurationField::Oversampling,
            ),
            // False for NaN. An infinite limit is none.
            (limits[0] < limits[1], ConfigurationField::Limits),
            (positive(self.contact_threshold), ConfigurationField::ContactThreshold),
            (
                self.filter_time_constant_us <= Settings::MOST_US,
                ConfigurationField::FilterTimeConstant,
            ),
            (self.filter_lead_us <= Settings::MOST_US, ConfigurationField::FilterLead),
            (self.report_every > 0, ConfigurationField::ReportEvery),
        ];
        checks.into_iter().find(|(good, _)| !good).map_or(Ok(()), |(_, field)| Err(field))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_field_is_checked() {
        let good = Configuration::DEFAULT;
        assert_eq!(good.check(), Ok(()));
        assert_eq!(Configuration { frame_period_us: 0, ..good }.check(), Ok(()));
        let scan = |settling_us, oversampling| ScanSettings { settling_us, oversampling };
        for (bad, field) in [
            (Configuration { frame_period_us: 99, ..good }, ConfigurationField::FramePeriod),
            (Configuration { frame_period_us: u32::MAX, ..good }, ConfigurationField::FramePeriod),
            (Configuration { scan: scan(5_001, 1), ..good }, ConfigurationField::Settling),
            (Configuration { scan: scan(0, 0), ..good }, ConfigurationField::Oversampling),
            (Configuration { scan: scan(0, 257), ..good }, ConfigurationField::Oversampling),
            (Configuration { open_above_ohm: 5.0, ..good }, ConfigurationField::Limits),
            (Configuration { open_above_ohm: f32::NAN, ..good }, ConfigurationField::Limits),
            (Configuration { shorted_below_ohm: f32::NAN, ..good }, ConfigurationField::Limits),
            (
                Configuration { contact_threshold: 0.0, ..good },
                ConfigurationField::ContactThreshold,
            ),
            (
                Configuration { filter_time_constant_us: 1_000_001, ..good },
                ConfigurationField::FilterTimeConstant,
            ),
            (Configuration { filter_lead_us: 1_000_001, ..good }, ConfigurationField::FilterLead),
            (Configuration { report_every: 0, ..good }, ConfigurationField::ReportEvery),
        ] {
            assert_eq!(bad.check(), Err(field), "{bad:?}");
        }
    }
}
