//! Default and ranges of a configuration.

use core::ops::RangeInclusive;

use taxel_core::events;
use taxel_core::filter::Settings;
use taxel_core::health::Limits;

use crate::link::message::{ConfidenceSent, Configuration, ConfigurationField};
use crate::readout::ScanSettings;

impl Configuration {
    /// Range of frame periods in µs, besides 0.
    pub const FRAME_PERIOD_US: RangeInclusive<u32> = 100..=1_000_000_000;

    /// The default configuration: 100 frames a second, estimates are sent without confidence, limits for rubber of about
    /// 60 Ω, nothing is filtered, and models with a tracker track.
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
        track: true,
        load_threshold: 0.0,
        slip_mm_per_s: 2.0,
    };

    /// Settings of the filter in time.
    pub fn filter(&self) -> Settings {
        Settings { time_constant_us: self.filter_time_constant_us, lead_us: self.filter_lead_us }
    }

    /// Limits in Ω of sound readings.
    pub fn limits(&self) -> Limits {
        Limits { shorted_below_ohm: self.shorted_below_ohm, open_above_ohm: self.open_above_ohm }
    }

    /// Thresholds of events.
    pub fn events(&self) -> events::Settings {
        events::Settings { load: self.load_threshold, slip_mm_per_s: self.slip_mm_per_s }
    }

    /// Checks that every field is in its range.
    ///
    /// # Errors
    /// The first field that is not in its range.
    pub fn check(&self) -> Result<(), ConfigurationField> {
        let positive = |value: f32| value.is_finite() && value > 0.0;
        let not_negative = |value: f32| value.is_finite() && value >= 0.0;
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
            (not_negative(self.load_threshold), ConfigurationField::LoadThreshold),
            (not_negative(self.slip_mm_per_s), ConfigurationField::Slip),
        ];
        checks.into_iter().find(|(good, _)| !good).map_or(Ok(()), |(_, field)| Err(field))
    }
}

#[cfg(test)]
mod tests {
    use super::ConfigurationField as Field;
    use super::*;

    type Change = fn(&mut Configuration);

    #[test]
    fn each_field_is_checked() {
        let cases: [(Change, Result<(), Field>); 25] = [
            (|_| (), Ok(())),
            (|it| it.frame_period_us = 0, Ok(())),
            (|it| it.frame_period_us = 99, Err(Field::FramePeriod)),
            (|it| it.frame_period_us = 100, Ok(())),
            (|it| it.frame_period_us = 1_000_000_001, Err(Field::FramePeriod)),
            (|it| it.scan.settling_us = 5_000, Ok(())),
            (|it| it.scan.settling_us = 5_001, Err(Field::Settling)),
            (|it| it.scan.oversampling = 0, Err(Field::Oversampling)),
            (|it| it.scan.oversampling = 256, Ok(())),
            (|it| it.scan.oversampling = 257, Err(Field::Oversampling)),
            (|it| it.open_above_ohm = it.shorted_below_ohm, Err(Field::Limits)),
            (|it| it.open_above_ohm = f32::INFINITY, Ok(())),
            (|it| it.open_above_ohm = f32::NAN, Err(Field::Limits)),
            (|it| it.shorted_below_ohm = f32::NAN, Err(Field::Limits)),
            (|it| it.contact_threshold = 0.0, Err(Field::ContactThreshold)),
            (|it| it.contact_threshold = f32::INFINITY, Err(Field::ContactThreshold)),
            (|it| it.filter_time_constant_us = 1_000_000, Ok(())),
            (|it| it.filter_time_constant_us = 1_000_001, Err(Field::FilterTimeConstant)),
            (|it| it.filter_lead_us = 1_000_000, Ok(())),
            (|it| it.filter_lead_us = 1_000_001, Err(Field::FilterLead)),
            (|it| it.report_every = 0, Err(Field::ReportEvery)),
            (|it| (it.load_threshold, it.slip_mm_per_s) = (3.5, 0.0), Ok(())),
            (|it| it.load_threshold = -0.1, Err(Field::LoadThreshold)),
            (|it| it.load_threshold = f32::INFINITY, Err(Field::LoadThreshold)),
            (|it| it.slip_mm_per_s = f32::NAN, Err(Field::Slip)),
        ];
        for (change, expected) in cases {
            let mut configuration = Configuration::DEFAULT;
            change(&mut configuration);
            assert_eq!(configuration.check(), expected, "{configuration:?}");
        }
    }
}
