//! The sensor: which wires are scanned, how, and its baseline.

use taxel_core::blob::{Columns, Floats, ModelShape};
use taxel_core::contact::Detector;
use taxel_core::health::Health;

use super::frame_clock::FrameClock;
use super::link::Link;
use super::wiring::Wiring;
use crate::capacity::Capacity;
use crate::circuit::{Constants, ConstantsFault};
use crate::link::message::{Configuration, HealthReport, Refusal, Report};
use crate::link::packet::UNASKED;
use crate::log::info;
use crate::platform::Platform;
use crate::readout::{
    Baseline, Diagnosis, FrameSource, LONGEST_SCAN_US, RowTimes, ScanReport, Scanning, Selection,
};

/// The sensor and the settings that belong to it.
pub struct Sensor<'m, F, const ROWS: usize> {
    pub source: F,
    /// The configuration in force.
    pub configuration: Configuration,
    /// The configuration in force where none is kept.
    default_configuration: Configuration,
    pub clock: FrameClock,
    /// The wires that are scanned: those of the model in force, else all.
    pub wiring: Wiring<'m, ROWS>,
    /// Room for the longest frame.
    frame: &'m mut [f32],
    /// Bits of the last frame's faulty readings, a word a row.
    faulty_columns: [u32; ROWS],
    pub baseline: Baseline<'m>,
    pub capture: Option<Capture>,
    contact: Detector,
    /// Whether the last scan gave at least one reading.
    pub answers: bool,
    /// Whether the configuration changed since the last frame was decoded.
    pub is_configured_anew: bool,
    /// The scan that goes on by itself.
    under_way: Option<Scan>,
}

/// A scan that was begun.
#[derive(Clone, Copy)]
pub struct Scan {
    /// Time in µs since the start at which it began.
    pub start_us: u64,
    /// Number of frames that were missed before it.
    pub missed: u32,
    /// When its rows were read.
    pub row_times: RowTimes,
}

/// A scan whose frame is still to be read.
struct Ended {
    scan: Scan,
    /// Time in µs at which it was seen to have ended; `None` if the source is still to be waited for.
    end_us: Option<u64>,
    /// Whether it was not given up.
    is_whole: bool,
}

/// A baseline that is being captured.
#[derive(Clone, Copy)]
pub struct Capture {
    /// Number of the request that waits for it.
    pub number: u16,
    /// Number of frames asked for.
    frames: u16,
    /// Number of frames still to be scanned.
    left: u16,
}

impl<'m, F: FrameSource, const ROWS: usize> Sensor<'m, F, ROWS> {
    /// Makes a sensor with this `wiring`. The memories have room for the longest frame each.
    pub fn new(
        source: F,
        configuration: Configuration,
        wiring: Wiring<'m, ROWS>,
        [frame, baseline]: [&'m mut [f32]; 2],
        now_us: u32,
    ) -> Self {
        Self {
            source,
            configuration,
            default_configuration: configuration,
            clock: FrameClock::starting_at(now_us),
            wiring,
            frame,
            faulty_columns: [0; ROWS],
            baseline: Baseline::new(baseline),
            capture: None,
            contact: Detector::default(),
            answers: true,
            is_configured_anew: false,
            under_way: None,
        }
    }

    /// The readings of the last frame, in Ω.
    pub fn frame(&self) -> &[f32] {
        self.frame.get(..self.wiring.readings).unwrap_or_default()
    }

    /// Replaces the frame with the `readings_ohm` of a request.
    pub fn set_frame(&mut self, readings_ohm: Floats<'_>) -> Result<(), Refusal> {
        self.check_length(readings_ohm)?;
        let frame = self.frame_mut();
        frame.iter_mut().zip(readings_ohm.iter()).for_each(|(place, reading)| *place = reading);
        Ok(())
    }

    /// Checks that there are as many readings as are scanned.
    fn check_length(&self, readings_ohm: Floats<'_>) -> Result<(), Refusal> {
        let expected = self.wiring.readings;
        if readings_ohm.0.len() == 4 * expected {
            Ok(())
        } else {
            Err(Refusal::FrameLength { expected: expected as u16 })
        }
    }

    /// The readings of the last frame, to be filled.
    pub fn frame_mut(&mut self) -> &mut [f32] {
        self.frame.get_mut(..self.wiring.readings).unwrap_or_default()
    }

    /// Looks for faulty readings, which are NaN then.
    pub fn judge_frame(&mut self) -> Health {
        let limits = self.configuration.limits();
        let frame = self.frame.get_mut(..self.wiring.readings).unwrap_or_default();
        Health::new(frame, self.wiring.line, limits, &mut self.faulty_columns)
    }

    /// Whether the last frame differs from the baseline as under a contact: by the largest relative change, because a
    /// device does not know its noise at rest. A frame that is not one of a series neither continues a contact nor ends
    /// it.
    pub fn is_touched(&mut self, is_of_series: bool) -> bool {
        let change = self.baseline.largest_relative_deviation(self.frame);
        let change = change.filter(|_| self.capture.is_none()).unwrap_or(0.0);
        let mut alone = Detector::default();
        let contact = if is_of_series { &mut self.contact } else { &mut alone };
        contact.update(change, self.configuration.contact_threshold)
    }
}

impl<F: FrameSource, const ROWS: usize> Sensor<'_, F, ROWS> {
    /// Scans the wires of a model with inputs of these `names` from now on. A baseline of other wires is discarded.
    pub fn scan_wires<P: Platform>(
        &mut self,
        capacity: Capacity,
        names: Columns<'_>,
        shape: ModelShape,
        link: &mut Link<'_, P>,
    ) {
        let of_wiring = |wiring: &Wiring<'_, ROWS>| (wiring.crc_32, wiring.line);
        let before = of_wiring(&self.wiring);
        self.wiring.take(capacity, names, shape);
        if of_wiring(&self.wiring) != before {
            self.stop_scan();
            self.restart_baseline(link);
        }
    }

    /// Ends a scan, and starts the next one if it is due: that goes on by itself while the frame is decoded, if the source
    /// can do so. Counts the frame that was scanned, and sends its readings if they are wanted. Returns its number.
    pub fn scan_if_due<P: Platform>(
        &mut self,
        scratch: &mut [f32],
        link: &mut Link<'_, P>,
    ) -> Option<(u32, Scan)> {
        let mut ended = self.poll(link);
        let period_us = self.configuration.frame_period_us;
        if self.under_way.is_none()
            && let Some(missed) = self.clock.due(link.platform().now_us(), period_us)
        {
            let missed_frames = &mut link.statistics.frames_missed;
            *missed_frames = missed_frames.saturating_add(missed);
            let scan = Scan { start_us: link.now_us(), missed, row_times: RowTimes::default() };
            match self.source.scanning() {
                Scanning::Runs(source) => {
                    source.start(self.configuration.scan, self.wiring.selection());
                    self.under_way = Some(scan);
                }
                Scanning::Waits(_) => ended = Some(Ended { scan, end_us: None, is_whole: true }),
            }
        }
        let Ended { mut scan, end_us, is_whole } = ended?;
        let settings = self.configuration.scan;
        let frame = self.frame.get_mut(..self.wiring.readings).unwrap_or_default();
        let read = |wires: Selection<'_>, frame: &mut [f32]| match self.source.scanning() {
            Scanning::Waits(source) => source.scan(settings, wires, frame),
            Scanning::Runs(source) if is_whole => source.take(frame),
            Scanning::Runs(_) => ScanReport::of_failed(frame),
        };
        let report = self.wiring.fill(frame, scratch, read);
        let end_us = end_us.unwrap_or_else(|| link.now_us());
        self.answers = self.frame().iter().any(|reading| !reading.is_nan());
        let scan_us = end_us.wrapping_sub(scan.start_us) as u32;
        scan.row_times = report.row_times;
        if scan.row_times == RowTimes::default() {
            // One after the other, as far as anybody knows.
            let step_us = scan_us as f32 / self.wiring.selection().rows.len().max(1) as f32;
            scan.row_times = RowTimes { first_us: 0.5 * step_us, step_us };
        }
        let s = &mut link.statistics;
        let frame = s.number_frame();
        s.failed_samples = s.failed_samples.saturating_add(u32::from(report.failed_samples));
        s.longest_scan_us = s.longest_scan_us.max(scan_us);
        if self.configuration.send_readings {
            let (start_us, readings_ohm) = (scan.start_us, Floats::new(self.frame()));
            link.send(UNASKED, &Report::Readings { frame, start_us, readings_ohm });
        }
        Some((frame, scan))
    }

    /// Ends the scan that goes on by itself, if there is one and it has ended. One that takes too long is given up, and the
    /// source tells what it finds of itself.
    fn poll<P: Platform>(&mut self, link: &mut Link<'_, P>) -> Option<Ended> {
        let scan = self.under_way?;
        let Scanning::Runs(source) = self.source.scanning() else { return None };
        let is_whole = source.poll();
        let now_us = link.now_us();
        if !is_whole && now_us.wrapping_sub(scan.start_us) < LONGEST_SCAN_US {
            return None;
        }
        if is_whole {
            self.under_way = None;
        } else if let Some(diagnosis) = self.diagnose() {
            link.send(UNASKED, &Report::Diagnosis(diagnosis));
        }
        Some(Ended { scan, end_us: Some(now_us), is_whole })
    }

    /// Lets the source test itself.
    pub fn diagnose(&mut self) -> Option<Diagnosis> {
        self.stop_scan();
        self.source.diagnose()
    }

    /// Gives up the scan that goes on by itself: what it is of changes. It counts as no frame.
    fn stop_scan(&mut self) {
        if self.under_way.take().is_some()
            && let Scanning::Runs(source) = self.source.scanning()
        {
            source.stop();
        }
    }

    /// Reports the last frame's faulty readings.
    pub fn send_health<P: Platform>(
        &self,
        frame: u32,
        start_us: u64,
        health: Health,
        link: &mut Link<'_, P>,
    ) {
        let faulty = self.faulty_columns.map(u32::to_le_bytes);
        let report = HealthReport {
            frame,
            start_us,
            missing: health.missing,
            shorted: health.shorted,
            open: health.open,
            faulty_columns: faulty.get(..self.wiring.lines()).unwrap_or_default().as_flattened(),
        };
        link.send(UNASKED, &Report::Health(report));
    }

    /// Puts `configuration` in force.
    pub fn configure<P: Platform>(
        &mut self,
        configuration: Configuration,
        link: &mut Link<'_, P>,
    ) -> Result<(), Refusal> {
        configuration.check().map_err(Refusal::Configuration)?;
        self.put_in_force(configuration, link);
        Ok(())
    }

    /// Puts the configuration in force that is kept, else the default.
    pub fn resume<P: Platform>(&mut self, link: &mut Link<'_, P>) {
        let kept = link.kept_configuration();
        self.put_in_force(kept.unwrap_or(self.default_configuration), link);
    }

    /// Scans by `configuration` from now on. Nothing changes if it is in force already.
    fn put_in_force<P: Platform>(&mut self, configuration: Configuration, link: &mut Link<'_, P>) {
        if configuration == self.configuration {
            return;
        }
        self.stop_scan();
        link.platform().signal([false; 3]);
        (self.configuration, self.is_configured_anew) = (configuration, true);
        self.give_up_capture(link);
        self.answers |= configuration.frame_period_us == 0; // it is not scanned any more
        self.clock.restart(link.platform().now_us());
        info!("configured: a frame every {=u32} us", configuration.frame_period_us);
    }

    /// Puts constants in force. A baseline that was read with other constants is no longer valid. Returns whether they
    /// changed.
    pub fn set_constants<P: Platform>(
        &mut self,
        constants: Constants<'_>,
        link: &mut Link<'_, P>,
    ) -> Result<bool, ConstantsFault> {
        let before = self.origin_crc();
        self.stop_scan();
        self.source.set_constants(constants)?;
        let changed = self.origin_crc() != before;
        if changed {
            self.restart_baseline(link);
            self.load_baseline(link);
        }
        Ok(changed)
    }

    /// Begins to capture a baseline of so many `frames`, for request `number`.
    pub fn begin_capture<P: Platform>(
        &mut self,
        number: u16,
        frames: u16,
        link: &mut Link<'_, P>,
    ) -> Result<(), Refusal> {
        if frames == 0 || self.configuration.frame_period_us == 0 {
            return Err(Refusal::Baseline);
        }
        let is_repeated = |capture: Capture| (capture.number, capture.frames) == (number, frames);
        if self.capture.is_some_and(is_repeated) {
            return Ok(()); // the answer takes a while
        }
        self.stop_scan(); // it began before the request
        self.restart_baseline(link);
        self.capture = Some(Capture { number, frames, left: frames });
        Ok(())
    }

    /// Adds the last frame to the baseline that is being captured. Returns the number of the request that waits for it
    /// once it is complete.
    pub fn feed_baseline(&mut self) -> Option<u16> {
        let capture = self.capture.as_mut()?;
        self.baseline.add(self.frame);
        capture.left = capture.left.saturating_sub(1);
        let (number, left) = (capture.number, capture.left);
        if left > 0 {
            return None;
        }
        self.capture = None;
        Some(number)
    }

    /// Takes the last frame for the baseline.
    pub fn take_baseline<P: Platform>(&mut self, link: &mut Link<'_, P>) {
        self.restart_baseline(link);
        self.baseline.add(self.frame);
    }

    /// Forgets the baseline, and refuses the request that waits for one.
    fn restart_baseline<P: Platform>(&mut self, link: &mut Link<'_, P>) {
        self.give_up_capture(link);
        self.baseline.restart(self.wiring.readings);
    }

    /// Refuses the request that waits for a baseline, if there is one: no baseline will come.
    fn give_up_capture<P: Platform>(&mut self, link: &mut Link<'_, P>) {
        if let Some(Capture { number, .. }) = self.capture.take() {
            self.baseline.restart(self.wiring.readings);
            link.send(number, &Report::Refused(Refusal::Baseline));
        }
    }
}
