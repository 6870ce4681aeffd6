//! Where the frames come from that are watched.

use std::time::Duration;

use taxel_core::health::Limits;
use taxel_recording::Layout;
use taxel_view::Action;
use taxel_view::message::{Can, Kind};

use super::moment::Moment;
use crate::Result;

/// What a feed brings.
#[derive(Debug)]
pub enum Next {
    /// A frame.
    Frame(Box<Moment>),
    /// No frame within the time.
    Nothing,
    /// No frame, and why, with the fix, in words.
    Trouble(String),
    /// There are other frames from now on: the layout has changed.
    Anew,
    /// There are no more frames.
    Ended,
}

/// Where frames come from: a device, a simulation, a recording.
pub trait Feed {
    /// What its frames hold.
    fn layout(&self) -> &Layout;

    /// Its kind, where it is in words, and what it can do.
    fn about(&self) -> About;

    /// What it brings within so long.
    ///
    /// # Errors
    /// What no waiting mends.
    fn next(&mut self, within: Duration) -> Result<Next>;

    /// Readings of the untouched sensor, as far as it knows them.
    fn baseline(&self) -> Option<Vec<f32>> {
        None
    }

    /// Limits of its readings in Ω that are believed.
    fn limits(&self) -> Limits {
        Limits::USUAL
    }

    /// Frames of the untouched sensor, if it can have some.
    fn at_rest(&self) -> &[Vec<f32>] {
        &[]
    }

    /// Takes the readings of the untouched sensor. The error says why not.
    fn zero(&mut self, _readings: &[f32]) -> std::result::Result<(), String> {
        Ok(())
    }

    /// Does what a button asks for that is the feed's own matter; the answer is in words.
    fn act(&mut self, _action: Action) -> std::result::Result<String, String> {
        Err("not here".into())
    }

    /// Whether it stands still because it was told to, or has come to its end.
    fn is_paused(&self) -> bool {
        false
    }

    /// What is to be said of its frames while they come, such as that something must be done first; with the fix.
    fn note(&self) -> Option<String> {
        None
    }

    /// Number of frames that were lost so far.
    fn lost(&self) -> u64 {
        0
    }

    /// Place in a recording and speed, where there is one.
    fn position(&self) -> Option<(f64, f64)> {
        None
    }

    /// Square of the least possible error of the frames that were judged, in mm², and that of what was decoded of them.
    fn judged(&self) -> Option<[f64; 2]> {
        None
    }
}

/// What a feed is.
#[derive(Debug, Clone, PartialEq)]
pub struct About {
    /// Its kind.
    pub kind: Kind,
    /// Where its frames come from, in words.
    pub source: String,
    /// What it can do.
    pub can: Can,
    /// Length in seconds of a recording.
    pub duration_s: Option<f64>,
}
