//! What the page's buttons ask for.

use std::sync::mpsc::{self, Receiver, SyncSender};

use serde::Deserialize;

/// Slowest and fastest speed of a recording.
const SPEEDS: [f64; 2] = [0.1, 10.0];
/// Largest number of frames of a step.
const MOST_FRAMES: i32 = 10_000;

/// What a source is asked to do.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(tag = "action", rename_all = "snake_case")]
pub enum Action {
    /// Take the sensor as it is for the unloaded one.
    Zero,
    /// Wait.
    Pause,
    /// Go on.
    Resume,
    /// Begin a recording.
    Record,
    /// End the recording.
    StopRecording,
    /// Go to a place in a recording.
    Seek {
        /// Place in seconds, at least 0.
        to_s: f64,
    },
    /// Play a recording at another speed.
    Speed {
        /// Speed, 0.1 to 10; 1 for that of the clock.
        factor: f64,
    },
    /// Go forward in a recording, and wait.
    Step {
        /// Number of frames; negative to go back.
        frames: i32,
    },
}

impl Action {
    /// Action in the body of a request.
    ///
    /// # Errors
    /// Words for whoever sent it, if there is no such action or a number is out of range.
    pub(crate) fn parse(body: &[u8]) -> Result<Self, String> {
        let action = serde_json::from_slice(body).map_err(|cause| format!("no action: {cause}"))?;
        let is_possible = match action {
            Self::Seek { to_s } => to_s >= 0.0,
            Self::Speed { factor } => (SPEEDS[0]..=SPEEDS[1]).contains(&factor),
            Self::Step { frames } => (-MOST_FRAMES..=MOST_FRAMES).contains(&frames),
            _ => true,
        };
        if is_possible { Ok(action) } else { Err(format!("out of range: {action:?}")) }
    }
}

/// An action that waits for its answer.
#[derive(Debug)]
pub struct Command {
    /// What is asked for.
    pub action: Action,
    reply: SyncSender<Result<String, String>>,
}

impl Command {
    /// A command, and where its answer arrives: nowhere if it is dropped without one.
    pub(crate) fn new(action: Action) -> (Self, Receiver<Result<String, String>>) {
        let (reply, answer) = mpsc::sync_channel(1);
        (Self { action, reply }, answer)
    }

    /// Answers with what was done, or with the reason why it was not, in words that the page shows.
    ///
    /// It never waits, even if nobody listens any more.
    pub fn answer(self, result: Result<String, String>) {
        let _ = self.reply.try_send(result);
    }
}
