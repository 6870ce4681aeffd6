//! What feeder, printer and viewers share: one slot of each kind, in which the newest wins.
//!
//! The feeder stores. One thread, the printer, makes text of what was stored, once for all viewers. Each viewer's thread writes the
//! newest text; no thread waits for a viewer.

use std::mem;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use serde::Serialize;

use crate::message::{Frame, Layout, Status};

/// Shortest time between two events of a kind.
pub const LEAST_INTERVAL: Duration = Duration::from_micros(16_667);
/// Longest time between two events `status`.
const STATUS_INTERVAL: Duration = Duration::from_secs(1);

/// Kinds of events, in the order in which they are sent. Without those before it, an event cannot be understood.
const KINDS: [&str; 4] = ["layout", "baseline", "status", "frame"];
const STATUS: usize = 2;
const FRAME: usize = 3;

/// What the feeder stored and nobody has printed yet.
#[derive(Default)]
struct Given {
    layout: Option<Layout>,
    baseline: Option<Vec<f32>>,
    status: Option<Status>,
    frame: Option<(Frame, Instant)>,
}

impl Given {
    fn is_some(&self) -> bool {
        let Self { layout, baseline, status, frame } = self;
        layout.is_some() || baseline.is_some() || status.is_some() || frame.is_some()
    }
}

/// An event `frame`.
#[derive(Serialize)]
struct Sent {
    #[serde(flatten)]
    frame: Frame,
    /// Time of sending in ms on the server's clock: the page sees by it whether events are held up on their way.
    sent_ms: f64,
}

/// Newest event of a kind: its number, 0 if there is none, and its text.
#[derive(Clone, Default)]
struct Event {
    number: u64,
    text: Option<Arc<str>>,
}

#[derive(Default)]
struct State {
    given: Given,
    events: [Event; KINDS.len()],
    /// Number of layouts so far: what was made for the one before is dropped.
    layouts: u64,
    viewers: usize,
    is_closed: bool,
}

/// See the module.
pub struct Shared {
    state: Mutex<State>,
    given: Condvar,
    printed: Condvar,
    start: Instant,
}

/// Place of a viewer, free again when it is dropped.
pub struct Place<'shared>(&'shared Shared);

impl Drop for Place<'_> {
    fn drop(&mut self) {
        self.0.lock().viewers -= 1;
    }
}

/// What a viewer has seen.
pub struct Seen {
    numbers: [u64; KINDS.len()],
    status: Instant,
    /// When the next frame may be sent.
    next_frame: Instant,
    interval: Duration,
}

impl Seen {
    /// Nothing yet; frames shall come at intervals of `interval` at least.
    pub fn nothing(interval: Duration) -> Self {
        let now = Instant::now();
        Self { numbers: [0; KINDS.len()], status: now, next_frame: now, interval }
    }
}

impl Shared {
    pub fn new() -> Self {
        let mut state = State::default();
        // Pages see by the status that the server lives, whether or not the feeder sets one.
        state.given.status = Some(Status::default());
        let (given, printed) = (Condvar::new(), Condvar::new());
        Self { state: Mutex::new(state), given, printed, start: Instant::now() }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn give(&self, store: impl FnOnce(&mut State)) {
        store(&mut self.lock());
        self.given.notify_one();
    }

    /// Stores a layout. What belongs to the one before is forgotten.
    pub fn set_layout(&self, layout: Layout) {
        self.give(|state| {
            state.layouts += 1;
            state.given = Given {
                layout: Some(layout),
                status: state.given.status.take(),
                ..Given::default()
            };
            for kind in (0..KINDS.len()).filter(|&kind| kind != STATUS) {
                state.events[kind].text = None;
            }
        });
    }

    pub fn set_baseline(&self, baseline: Vec<f32>) {
        self.give(|state| state.given.baseline = Some(baseline));
    }

    pub fn set_status(&self, status: Status) {
        self.give(|state| state.given.status = Some(status));
    }

    pub fn show(&self, frame: Frame) {
        self.give(|state| state.given.frame = Some((frame, Instant::now())));
    }

    /// Ends the threads of printer and viewers.
    pub fn close(&self) {
        self.lock().is_closed = true;
        self.given.notify_all();
        self.printed.notify_all();
    }

    pub fn is_closed(&self) -> bool {
        self.lock().is_closed
    }

    /// A place for one more viewer, unless `most` are taken.
    pub fn place(&self, most: usize) -> Option<Place<'_>> {
        let mut state = self.lock();
        if state.viewers >= most {
            return None;
        }
        state.viewers += 1;
        drop(state);
        self.given.notify_one();
        Some(Place(self))
    }

    /// Prints what is stored while somebody views, until it is closed.
    pub fn print(&self) {
        loop {
            let mut state = self.lock();
            while !state.is_closed && (state.viewers == 0 || !state.given.is_some()) {
                state = self.given.wait(state).unwrap_or_else(PoisonError::into_inner);
            }
            if state.is_closed {
                return;
            }
            let (given, layouts) = (mem::take(&mut state.given), state.layouts);
            drop(state);
            let start = Instant::now();
            let texts = self.texts(given);
            let mut state = self.lock();
            for (kind, text) in texts.into_iter().enumerate() {
                if text.is_some() && (layouts == state.layouts || kind == STATUS) {
                    let event = &mut state.events[kind];
                    *event = Event { number: event.number + 1, text };
                }
            }
            drop(state);
            self.printed.notify_all();
            thread::sleep(LEAST_INTERVAL.saturating_sub(start.elapsed()));
        }
    }

    fn texts(&self, given: Given) -> [Option<Arc<str>>; KINDS.len()] {
        let Given { layout, baseline, status, frame } = given;
        let sent = frame.map(|(mut frame, moment)| {
            frame.age_ms += moment.elapsed().as_secs_f32() * 1e3;
            Sent { frame, sent_ms: self.start.elapsed().as_secs_f64() * 1e3 }
        });
        [
            layout.and_then(|layout| text(0, &layout)),
            baseline.and_then(|baseline| text(1, &baseline)),
            status.and_then(|status| text(STATUS, &status)),
            sent.and_then(|sent| text(FRAME, &sent)),
        ]
    }

    /// Waits for events that a viewer has not seen, and returns their texts; `None` once it is closed.
    ///
    /// The status comes again if it has not for a second: the page sees by it that the server lives, and the server by it
    /// that the page is gone.
    pub fn news(&self, seen: &mut Seen) -> Option<Vec<Arc<str>>> {
        let mut state = self.lock();
        loop {
            if state.is_closed {
                return None;
            }
            let now = Instant::now();
            let mut wait = STATUS_INTERVAL.saturating_sub(now - seen.status);
            let mut texts = Vec::new();
            for (kind, event) in state.events.iter().enumerate() {
                let Some(text) = &event.text else { continue };
                let is_due = kind == STATUS && wait.is_zero();
                if event.number == seen.numbers[kind] && !is_due {
                    continue;
                }
                if kind == FRAME && now < seen.next_frame {
                    wait = wait.min(seen.next_frame - now);
                    continue;
                }
                seen.numbers[kind] = event.number;
                texts.push(text.clone());
                match kind {
                    STATUS => seen.status = now,
                    FRAME => seen.next_frame = now + seen.interval,
                    _ => {}
                }
            }
            if !texts.is_empty() {
                return Some(texts);
            }
            // No status has been printed yet: it will be, since there is one from the start.
            let wait = if wait.is_zero() { STATUS_INTERVAL } else { wait };
            state =
                self.printed.wait_timeout(state, wait).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

/// Event as text; `None` if it cannot be written as JSON, which the messages' types exclude.
fn text(kind: usize, value: &impl Serialize) -> Option<Arc<str>> {
    let json = serde_json::to_string(value).ok()?;
    Some(format!("event: {}\ndata: {json}\n\n", KINDS[kind]).into())
}

#[cfg(test)]
mod tests;
