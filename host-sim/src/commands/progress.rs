//! Progress on stderr: a bar on a terminal, now and then a line elsewhere.

use std::collections::BTreeSet;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use taxel_data::Progress;

use super::Common;

/// Least time between two lines of the same stage.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Display of the stage that runs, how far it is, and how long it may take.
pub enum Terminal {
    /// Bar that is drawn in place.
    Bar(ProgressBar),
    /// Lines in a log, where stderr is no terminal.
    Log(Mutex<Log>),
    /// Nothing, for a caller in this process, who may want it to stop, or for who wants to hear nothing.
    Called(Arc<AtomicBool>),
}

/// Stage that runs, for lines in a log.
pub struct Log {
    /// Whether it says how long each stage took.
    is_verbose: bool,
    stage: String,
    steps: usize,
    done: usize,
    started: Instant,
    written: Instant,
    /// Stages that were named in a line. Those that come again and again are named once.
    known: BTreeSet<String>,
}

impl Terminal {
    /// Display of progress for a command: on stderr, or for its caller.
    pub fn new(common: &Common) -> Self {
        if let Some(caller) = &common.caller {
            return Self::Called(Arc::clone(&caller.stop));
        }
        if common.quiet {
            return Self::Called(Arc::default());
        }
        if common.verbose || ProgressDrawTarget::stderr().is_hidden() {
            return Self::Log(Mutex::new(Log::new(common.verbose, Instant::now())));
        }
        let bar = ProgressBar::new(0);
        let template = "{msg:<28} {bar:32} {percent:>3} %  {elapsed}, {eta} left";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(100));
        Self::Bar(bar)
    }
}

/// What long work unwinds with when its caller wants it to stop.
pub struct Stopped;

/// Says a line of a log.
fn say(line: impl std::fmt::Display) {
    eprintln!("{line}");
}

/// The log, also after a panic of another thread that held it.
fn locked(log: &Mutex<Log>) -> MutexGuard<'_, Log> {
    log.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Unwinds with [`Stopped`] if the flag is set: work has no other way out, and files that it began go with it.
fn unwind_if(stop: &AtomicBool) {
    if stop.load(Ordering::Relaxed) {
        resume_unwind(Box::new(Stopped));
    }
}

impl Progress for Terminal {
    fn stage(&self, name: &str, steps: usize) {
        match self {
            Self::Bar(bar) => {
                bar.reset();
                bar.set_length(steps as u64);
                bar.set_message(name.to_owned());
                bar.tick();
            }
            Self::Log(log) => {
                let mut log = locked(log);
                log.end(Instant::now());
                log.stage(name, steps, Instant::now()).into_iter().for_each(say);
            }
            Self::Called(stop) => unwind_if(stop),
        }
    }

    fn step(&self) {
        match self {
            Self::Bar(bar) => bar.inc(1),
            Self::Log(log) => {
                locked(log).step(Instant::now()).into_iter().for_each(say);
            }
            Self::Called(stop) => unwind_if(stop),
        }
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        match self {
            Self::Bar(bar) => bar.finish_and_clear(),
            Self::Log(log) => locked(log).end(Instant::now()),
            Self::Called(_) => {}
        }
    }
}

impl Log {
    fn new(is_verbose: bool, now: Instant) -> Self {
        let (stage, known) = (String::new(), BTreeSet::new());
        Self { is_verbose, stage, steps: 0, done: 0, started: now, written: now, known }
    }

    /// Says how long the stage took that ends, if that is wanted.
    fn end(&self, now: Instant) {
        if self.is_verbose && !self.stage.is_empty() {
            let elapsed_s = now.duration_since(self.started).as_secs_f64();
            say(format!("{}: took {elapsed_s:.2} s", self.stage));
        }
    }

    /// Begins a stage; the line to write, if it is the first of that name.
    fn stage(&mut self, name: &str, steps: usize, now: Instant) -> Option<String> {
        (self.stage, self.steps, self.done, self.started) = (name.into(), steps, 0, now);
        if !self.known.insert(name.into()) {
            return None;
        }
        self.written = now;
        Some(format!("{name} …"))
    }

    /// Counts a step; the line to write, if the last one was long ago.
    fn step(&mut self, now: Instant) -> Option<String> {
        self.done += 1;
        if now.duration_since(self.written) < LINE_EVERY || self.done > self.steps {
            return None;
        }
        self.written = now;
        let done = self.done as f64 / self.steps as f64;
        let elapsed_s = now.duration_since(self.started).as_secs_f64();
        Some(format!(
            "{}: {:.0} %, {elapsed_s:.0} s, about {:.0} s left",
            self.stage,
            100.0 * done,
            elapsed_s / done - elapsed_s
        ))
    }
}
