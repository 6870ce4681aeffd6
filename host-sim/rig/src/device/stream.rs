//! Stream of frames through a device.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use taxel_core::blob::Floats;
use taxel_firmware::link::message::{EstimateReport, Report, Request};
use taxel_firmware::link::packet::UNASKED;

use super::{ATTEMPTS, Device};
use crate::error::{Error, Result};

/// Request on its way.
struct Outstanding {
    frame: u32,
    /// Number of the request that was sent last for this frame.
    number: u16,
    sent: Instant,
    attempts: u32,
}

/// Lets the device decode a frame for each of `start_us`, at which it began, of `readings_ohm` (frame after frame, in Ω).
/// Passes each estimate to `take` once. Returns the time it took.
///
/// Up to `window` frames are on their way at a time. A window above 1 is for lines that hold bytes back
/// while the device is busy, such as an emulator's; a real board may lose them. With a window of 1 the device decodes the
/// frames in their order, even if some are sent again: a filter in time needs that.
pub fn decode_frames(
    device: &mut Device,
    readings_ohm: &[f32],
    start_us: &[u64],
    window: usize,
    mut take: impl FnMut(u32, &EstimateReport<'_>),
) -> Result<Duration> {
    let frames = start_us.len() as u32;
    let per_frame = readings_ohm.len() / start_us.len().max(1);
    let request = |frame: u32| {
        let (start, start_us) = (frame as usize * per_frame, start_us[frame as usize]);
        let readings_ohm = Floats::new(&readings_ohm[start..start + per_frame]);
        Request::Decode { frame, start_us, readings_ohm }
    };
    let mut on_their_way: VecDeque<Outstanding> = VecDeque::new();
    let (start, mut next) = (Instant::now(), 0);
    while next < frames || !on_their_way.is_empty() {
        while next < frames && on_their_way.len() < window.max(1) {
            let number = device.send(&request(next))?;
            let sent = Instant::now();
            on_their_way.push_back(Outstanding { frame: next, number, sent, attempts: 1 });
            next += 1;
        }
        let Some(oldest) = on_their_way.front() else { break };
        let deadline = oldest.sent + device.patience;
        let heard = device.hear(deadline, |number, report| match report {
            // An estimate without a request belongs to a scan.
            Report::Estimate(estimate) if number != UNASKED => {
                // The answer to a repeated request may come twice.
                let place = on_their_way.iter().position(|o| o.frame == estimate.frame)?;
                on_their_way.remove(place);
                take(estimate.frame, estimate);
                Some(Ok(()))
            }
            Report::Refused(refusal) if on_their_way.iter().any(|o| o.number == number) => {
                Some(Err(Error::Refused(*refusal)))
            }
            _ => None,
        })?;
        match heard {
            Some(outcome) => outcome?,
            None => repeat_oldest(device, &mut on_their_way, &request)?,
        }
    }
    Ok(start.elapsed())
}

fn repeat_oldest<'r>(
    device: &mut Device,
    on_their_way: &mut VecDeque<Outstanding>,
    request: &impl Fn(u32) -> Request<'r>,
) -> Result<()> {
    let Some(mut oldest) = on_their_way.pop_front() else { return Ok(()) };
    if oldest.attempts == ATTEMPTS {
        let frame = oldest.frame;
        let message = format!("frame {frame} is not answered, after {ATTEMPTS} attempts");
        return Err(Error::failed(message));
    }
    oldest.attempts += 1;
    oldest.sent = Instant::now();
    device.repeated += 1;
    oldest.number = device.send(&request(oldest.frame))?;
    on_their_way.push_back(oldest);
    Ok(())
}
