//! Scans of a Taxel device.

use std::mem;
use std::time::Instant;

use taxel_firmware::link::message::{Configuration, EventReport, Report};

use super::{Scan, ScanEstimate, Source};
use crate::device::{Device, DeviceIdentity};
use crate::error::{Error, Result};

/// What a device sends of each scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sent {
    pub readings: bool,
    pub estimates: bool,
}

/// Puts a scan together from the reports that a device sends of it.
#[derive(Debug)]
pub struct Assembler {
    sent: Sent,
    /// Readings of a scan whose estimate is still to come.
    readings: Option<(u32, Vec<f32>)>,
    events: Vec<String>,
}

impl Assembler {
    /// Assembler of scans of which this is sent.
    pub fn new(sent: Sent) -> Self {
        Self { sent, readings: None, events: vec![] }
    }

    /// The scan that is whole with this `report`.
    ///
    /// # Errors
    /// [`Error::GivenUp`] if the device says that a scan did not end.
    pub fn take(&mut self, report: &Report<'_>) -> Result<Option<Scan>> {
        let scan = match report {
            Report::Diagnosis(found) => {
                return Err(Error::GivenUp { stalled: found.stalled_part().unwrap_or("none") });
            }
            Report::Event(event) => {
                self.events.push(event_words(event));
                return Ok(None);
            }
            Report::Readings { frame, start_us, readings_ohm } if self.sent.readings => {
                let readings = readings_ohm.iter().collect();
                if self.sent.estimates {
                    self.readings = Some((*frame, readings));
                    return Ok(None);
                }
                Scan {
                    number: *frame,
                    start_us: *start_us,
                    heard: Instant::now(),
                    readings,
                    estimate: None,
                    events: mem::take(&mut self.events),
                }
            }
            Report::Estimate(estimate) if self.sent.estimates => {
                let of_scan = self.readings.take().filter(|(frame, _)| *frame == estimate.frame);
                Scan {
                    number: estimate.frame,
                    start_us: estimate.start_us,
                    heard: Instant::now(),
                    readings: of_scan.map_or_else(Vec::new, |(_, values)| values),
                    estimate: Some(ScanEstimate {
                        outputs: estimate.outputs.iter().collect(),
                        row_status: estimate.row_status.to_vec(),
                        flags: estimate.flags,
                        deviations: estimate.deviation.iter().collect(),
                        novelty: estimate.novelty,
                    }),
                    events: mem::take(&mut self.events),
                }
            }
            _ => return Ok(None),
        };
        Ok(Some(scan))
    }
}

/// An event in words: `touch begins, slip ends (frame 7, 1.2 ms after its start)`.
fn event_words(event: &EventReport) -> String {
    let EventReport { frame, after_us, changed, going_on, .. } = event;
    let kinds = [(1, "touch"), (2, "load"), (4, "slip")];
    let words = kinds.iter().filter(|(bit, _)| changed & bit != 0).map(|(bit, kind)| {
        format!("{kind} {}", if going_on & bit == 0 { "ends" } else { "begins" })
    });
    let (words, after_ms) = (words.collect::<Vec<_>>().join(", "), f64::from(*after_us) / 1e3);
    format!("{words} (frame {frame}, {after_ms:.1} ms after its start)")
}

/// Scans of a device, which it sends as long as somebody listens.
pub struct DeviceScans {
    device: Device,
    assembler: Assembler,
}

impl DeviceScans {
    /// Lets the device scan by `configuration` and send what is to be `sent`: by default estimates if it has a model, and else
    /// readings.
    ///
    /// # Errors
    /// If it does not answer, or refuses the configuration.
    pub fn new(
        mut device: Device,
        configuration: Configuration,
        sent: Option<Sent>,
    ) -> Result<(Self, DeviceIdentity)> {
        let identity = device.identify()?;
        let has_model = identity.model.is_some();
        let sent = sent.unwrap_or(Sent { readings: !has_model, estimates: has_model });
        device.pause()?;
        device.configure(Configuration {
            send_readings: sent.readings,
            send_estimates: sent.estimates,
            ..configuration
        })?;
        Ok((Self { device, assembler: Assembler::new(sent) }, identity))
    }
}

impl Source for DeviceScans {
    fn hear(&mut self, deadline: Instant, take: &mut dyn FnMut(Scan)) -> Result<()> {
        let Self { device, assembler } = self;
        let failure = device.hear(deadline, |_, report| match assembler.take(report) {
            Ok(scan) => {
                scan.into_iter().for_each(&mut *take);
                None
            }
            Err(failure) => Some(failure),
        })?;
        failure.map_or(Ok(()), Err)
    }

    fn set_baseline(&mut self, readings: &[f32]) -> Result<()> {
        self.device.set_baseline(readings)
    }

    fn close(&mut self) {
        self.device.stop = None;
        // If it does not answer, it can be told nothing.
        let _ = self.device.resume();
    }
}
