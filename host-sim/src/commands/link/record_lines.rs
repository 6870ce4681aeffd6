//! `record --protocol`: frames of a sensor that is no Taxel device, saved.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use taxel_data::Progress;
use taxel_firmware::link::message::EstimateReport;
use taxel_learn::ModelBlob;

use super::super::progress::Terminal;
use super::super::recordings::is_recording;
use super::super::{Common, interruption, print};
use super::record::{RecordArguments, Saved};
use crate::live::device::{DeviceFeed, Line};
use crate::live::feed::{Feed, Next};
use crate::live::recorder::{Beside, Recorder};
use crate::live::sheet;
use crate::{Error, Result};

/// Time that one look for a frame takes.
const LOOK: Duration = Duration::from_millis(50);
/// Longest time without a frame: some boards start anew when their port is opened.
const PATIENCE: Duration = Duration::from_secs(10);

pub fn record(line: Line, action: &RecordArguments, common: &Common) -> Result<print::Outcome> {
    let blob = action.model.as_ref().map(|path| ModelBlob::read(path)).transpose()?;
    let mut feed = DeviceFeed::open(line, blob.as_ref().filter(|_| !action.readings))?;
    if feed.note().is_some() {
        let message = "MODEL needs a baseline of the untouched sensor, which only `view` captures: record there, or give --readings";
        return Err(Error::Usage(message.into()));
    }
    let count = usize::from(action.scan.frames);
    let progress = Terminal::new(common);
    progress.stage("recording", count);
    let (stop, mut last) = (interruption::flag(), Instant::now());
    let mut recorder: Option<Recorder> = None;
    let (mut starts_us, mut lines, mut frames_novel) = (vec![], vec![], 0);
    while lines.len() < count {
        if stop.load(Ordering::Relaxed) {
            return Err(taxel_rig::Error::Interrupted.into());
        }
        let frame = match feed.next(LOOK)? {
            Next::Frame(moment) => {
                frames_novel += usize::from(moment.has(EstimateReport::NOVEL));
                moment.frame
            }
            Next::Trouble(cause) if last.elapsed() > PATIENCE => {
                return Err(Error::failed(format!(
                    "{} of {count} frames arrived: {cause}",
                    lines.len()
                )));
            }
            Next::Anew if !lines.is_empty() => {
                return Err(Error::failed("lines now have another number of values"));
            }
            _ => continue,
        };
        if starts_us.last().is_some_and(|last| frame.time_us < *last) {
            return Err(Error::failed("the connection was lost meanwhile"));
        }
        if recorder.is_none() && is_recording(&action.to.output) {
            let blob = blob.as_ref().map(|blob| blob.bytes().to_vec());
            let beside = Beside { blob, source: feed.about().source, ..Beside::default() };
            recorder = Some(Recorder::start(&action.to.output, feed.layout(), beside)?);
        }
        if let Some(recorder) = &mut recorder {
            recorder.write(&frame)?;
        }
        starts_us.push(frame.time_us);
        let values = frame.outputs.unwrap_or(frame.readings);
        lines.push(values.into_iter().map(f64::from).collect::<Vec<f64>>());
        last = Instant::now();
        progress.step();
    }
    let missing = lines.iter().flatten().filter(|value| value.is_nan()).count();
    let span_us = starts_us[count - 1].saturating_sub(starts_us[0]);
    if let Some(recorder) = recorder {
        recorder.finish()?;
    } else {
        let of = feed.layout();
        let columns = if of.outputs.is_empty() { &of.readings } else { &of.outputs };
        let names: Vec<String> = sheet::names(columns).map(String::from).collect();
        action.save(&names, starts_us, lines)?;
    }
    let frames_per_s = (span_us > 0).then(|| (count - 1) as f64 / (span_us as f64 * 1e-6));
    let saved = Saved {
        frames: count,
        frames_per_s,
        frames_lost: feed.lost(),
        missing,
        frames_novel,
        events: vec![],
    };
    Ok(saved.outcome(&action.to.output, None, common))
}
