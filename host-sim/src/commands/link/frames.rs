//! Frames that a device sends of its scans.

use std::time::{Duration, Instant};

use crate::{Error, Result};
use taxel_data::Progress;
use taxel_firmware::link::message::{EstimateReport, Report};
use taxel_rig::device::Device;

use super::super::progress::Terminal;
use super::scan::{Wanted, check_length};

/// Frame that the device scanned.
pub struct Frame {
    /// Number, which wraps around to 0.
    pub number: u32,
    /// Time at which its scan began.
    pub start_us: u64,
    /// Readings; or outputs, their deviations and the frame's novelty, as far as they are sent.
    pub values: Vec<f64>,
    /// Whether it is unlike those of training, as far as the device has computed it.
    pub novel: bool,
}

impl Frame {
    fn new(estimate: &EstimateReport<'_>) -> Self {
        let values = estimate.outputs.iter().chain(estimate.deviation.iter());
        Self {
            number: estimate.frame,
            start_us: estimate.start_us,
            values: values.chain(estimate.novelty).map(f64::from).collect(),
            novel: estimate.flags & EstimateReport::NOVEL != 0,
        }
    }

    /// Whether the device has started anew between this frame and `next`.
    fn is_from_before(&self, next: &Self) -> bool {
        let frames = next.number.wrapping_sub(self.number).cast_signed();
        frames <= 0 || next.start_us <= self.start_us
    }
}

/// Receives the frames that the device sends, of `width` values each, and counts the untouched rows in all of them.
pub fn hear_frames(
    device: &mut Device,
    count: usize,
    patience: Duration,
    wanted: Wanted,
    width: usize,
) -> Result<(Vec<Frame>, usize)> {
    let progress = Terminal::new();
    progress.stage("recording", count);
    let mut frames: Vec<Frame> = Vec::new();
    let mut rows_at_rest = 0;
    let enough = device.hear(Instant::now() + patience, |_, report| {
        let mut status: &[u8] = &[];
        let frame = match report {
            Report::Readings { frame, start_us, readings_ohm } if wanted == Wanted::Readings => {
                let values = readings_ohm.iter().map(f64::from).collect();
                Frame { number: *frame, start_us: *start_us, values, novel: false }
            }
            Report::Estimate(estimate) if wanted == Wanted::Estimates => {
                status = estimate.row_status;
                Frame::new(estimate)
            }
            _ => return None,
        };
        if let Err(error) = check_length(frame.number, &frame.values, width) {
            return Some(Err(error));
        }
        if frames.last().is_some_and(|last| last.is_from_before(&frame)) {
            return Some(Err(Error::failed("the device has restarted meanwhile")));
        }
        frames.push(frame);
        let at_rest = status.iter().filter(|status| **status == EstimateReport::ROW_AT_REST);
        rows_at_rest += at_rest.count();
        progress.step();
        (frames.len() == count).then_some(Ok(()))
    })?;
    match enough {
        Some(outcome) => outcome.map(|()| (frames, rows_at_rest)),
        None => Err(Error::failed(format!("only {} of {count} frames came in time", frames.len()))),
    }
}

/// Number of missing values; if all are missing, that is a failure.
pub fn missing<'v>(values: impl Iterator<Item = &'v f64> + Clone, wanted: Wanted) -> Result<usize> {
    let missing = values.clone().filter(|value| value.is_nan()).count();
    if missing < values.count() {
        return Ok(missing);
    }
    let what = if wanted == Wanted::Estimates { "estimate" } else { "reading" };
    Err(Error::failed(format!(
        "the device sent not a single {what}; `identify` shows failed samples: check the wiring of \
         converters and rows (docs/board.md)"
    )))
}
