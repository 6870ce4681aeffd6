//! One frame of a sensor that is watched.

use std::time::Instant;

use taxel_firmware::link::message::EstimateReport;
use taxel_recording::Frame;
use taxel_rig::scans::Scan;

/// A frame, what was decoded of it, and when it came.
#[derive(Debug, Clone)]
pub struct Moment {
    /// The frame, as it is recorded.
    pub frame: Frame,
    /// Flags of docs/link.md.
    pub flags: u8,
    /// How the decoding of each row ended, as numbers of docs/link.md; none if the source does not tell.
    pub row_status: Vec<u8>,
    /// Novelty in nats: above 0 the frame is unlike those of training. `None` without a confidence.
    pub novelty: Option<f32>,
    /// Time at which it came.
    pub heard: Instant,
}

impl Moment {
    /// A frame of which nothing more is known.
    pub fn new(frame: Frame) -> Self {
        Self { frame, flags: 0, row_status: vec![], novelty: None, heard: Instant::now() }
    }

    /// Whether the frame has this flag.
    pub fn has(&self, flag: u8) -> bool {
        self.flags & flag != 0
    }

    /// The frame of a scan of so many `readings`; those that were lost on the line are missing.
    pub fn of_scan(scan: Scan, readings: usize) -> Self {
        let mut moment = Self::of_heard(scan);
        if moment.frame.readings.is_empty() {
            moment.frame.readings = vec![f32::NAN; readings];
        }
        moment
    }

    fn of_heard(scan: Scan) -> Self {
        let Scan { number, start_us, heard, readings, estimate, events } = scan;
        let frame = Frame { time_us: start_us, number, readings, events, ..Frame::default() };
        let mut moment = Self { heard, ..Self::new(frame) };
        let Some(estimate) = estimate.filter(|it| it.flags & EstimateReport::NO_MODEL == 0) else {
            return moment;
        };
        moment.frame.outputs = Some(estimate.outputs);
        moment.frame.deviations = Some(estimate.deviations).filter(|it| !it.is_empty());
        Self {
            flags: estimate.flags,
            row_status: estimate.row_status,
            novelty: estimate.novelty,
            ..moment
        }
    }
}
