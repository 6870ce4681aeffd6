//! Scans taken in by a thread of their own.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, mpsc};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::{Scan, Source};
use crate::error::{Error, Result};

/// Time that one look for scans takes, after which the listener sees whether it is to end.
const LOOK: Duration = Duration::from_millis(50);

/// Scans that were heard and not taken yet.
#[derive(Default)]
struct Heard {
    queue: VecDeque<Scan>,
    newest: Option<Scan>,
    /// Number of scans that never came, or were dropped because nobody took them.
    lost: u64,
    /// Number of bytes that came since the last scan and are none.
    refused: u64,
    /// Readings at rest that the sensor is to be told, and to whom it is told how that ended.
    baseline: Option<(Vec<f32>, mpsc::Sender<Result<()>>)>,
    /// Why the listener ended.
    ended: Option<String>,
}

#[derive(Default)]
struct Shared {
    heard: Mutex<Heard>,
    came: Condvar,
}

impl Shared {
    fn heard(&self) -> MutexGuard<'_, Heard> {
        self.heard.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A source of scans, heard in the background. It ends when this is dropped.
pub struct Listener {
    shared: Arc<Shared>,
    stop: Arc<AtomicBool>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

impl Listener {
    /// Opens a source by `open`, which is given the flag that ends its work, and listens to it. The receiver gets what `open`
    /// returns beside the source. `buffer` scans wait to be taken; older ones are dropped and count as lost.
    ///
    /// # Errors
    /// If the system has no thread left. Errors of `open` come by the receiver.
    pub fn start<T: Send + 'static>(
        buffer: usize,
        open: impl FnOnce(&Arc<AtomicBool>) -> Result<(Box<dyn Source>, T)> + Send + 'static,
    ) -> Result<(Self, mpsc::Receiver<Result<T>>)> {
        let (stop, shared) = (Arc::<AtomicBool>::default(), Arc::<Shared>::default());
        let (sender, receiver) = mpsc::channel();
        let (of_thread, flag) = (Arc::clone(&shared), Arc::clone(&stop));
        let thread = thread::Builder::new().name("taxel listener".into()).spawn(move || {
            let mut source = match open(&flag) {
                Ok((source, told)) => {
                    let _ = sender.send(Ok(told));
                    source
                }
                Err(error) => {
                    of_thread.heard().ended = Some(error.to_string());
                    let _ = sender.send(Err(error));
                    return;
                }
            };
            let outcome = listen(&mut *source, &of_thread, &flag, buffer.max(1));
            let cause = match outcome {
                Err(error) if !flag.load(Ordering::Relaxed) => error.to_string(),
                _ => "the link is closed".into(),
            };
            source.close();
            let mut heard = of_thread.heard();
            // Whoever waits for an answer gets none.
            (heard.ended, heard.baseline) = (Some(cause), None);
            drop(heard);
            of_thread.came.notify_all();
        })?;
        Ok((Self { shared, stop, thread: Mutex::new(Some(thread)) }, receiver))
    }

    /// Flag that ends the listener when it is set.
    pub fn stop(&self) -> &Arc<AtomicBool> {
        &self.stop
    }

    /// The oldest scan that was not taken yet; `None` if none comes within so long.
    ///
    /// # Errors
    /// Once the listener has ended and all is taken: why.
    pub fn next(&self, within: Duration) -> Result<Option<Scan>> {
        let waits = |heard: &mut Heard| heard.queue.is_empty() && heard.ended.is_none();
        let waited = self.shared.came.wait_timeout_while(self.shared.heard(), within, waits);
        let (mut heard, _) = waited.unwrap_or_else(PoisonError::into_inner);
        match (heard.queue.pop_front(), &heard.ended) {
            (None, Some(cause)) => Err(Error::failed(cause.clone())),
            (scan, _) => Ok(scan),
        }
    }

    /// The newest scan, if it is no older than this; those before it are not taken any more.
    ///
    /// # Errors
    /// Once the listener has ended: why.
    pub fn newest(&self, most_age: Duration) -> Result<Option<Scan>> {
        let mut heard = self.shared.heard();
        heard.queue.clear();
        let newest = heard.newest.as_ref().filter(|scan| scan.heard.elapsed() <= most_age).cloned();
        match (&newest, &heard.ended) {
            (None, Some(cause)) => Err(Error::failed(cause.clone())),
            _ => Ok(newest),
        }
    }

    /// Number of scans that never came, or were dropped because nobody took them.
    pub fn lost(&self) -> u64 {
        self.shared.heard().lost
    }

    /// Number of bytes that came since the last scan and are none.
    pub fn refused(&self) -> u64 {
        self.shared.heard().refused
    }

    /// Tells the sensor its readings at rest. Scans that come meanwhile may be lost.
    ///
    /// # Errors
    /// If it refuses them, or the listener has ended.
    pub fn set_baseline(&self, readings: Vec<f32>) -> Result<()> {
        let (sender, receiver) = mpsc::channel();
        let mut heard = self.shared.heard();
        if let Some(cause) = &heard.ended {
            return Err(Error::failed(cause.clone()));
        }
        heard.baseline = Some((readings, sender));
        drop(heard);
        receiver.recv().unwrap_or(Err(Error::Closed))
    }

    /// Stops listening: a device returns to its own configuration, and the port is free.
    pub fn close(&self) {
        self.stop.store(true, Ordering::Relaxed);
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(thread) = thread {
            // A listener that panicked has ended too.
            let _ = thread.join();
        }
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        self.close();
    }
}

/// Keeps what comes until `stop`.
fn listen(
    source: &mut dyn Source,
    shared: &Shared,
    stop: &AtomicBool,
    buffer: usize,
) -> Result<()> {
    let mut last = None;
    while !stop.load(Ordering::Relaxed) {
        let asked = shared.heard().baseline.take();
        if let Some((readings, sender)) = asked {
            let _ = sender.send(source.set_baseline(&readings));
        }
        source.hear(Instant::now() + LOOK, &mut |scan: Scan| {
            let missed = last.map_or(0, |last| scan.lost_since(last));
            last = Some(scan.number);
            let mut heard = shared.heard();
            heard.lost += u64::from(missed);
            if heard.queue.len() >= buffer {
                heard.queue.pop_front();
                heard.lost += 1;
            }
            heard.newest = Some(scan.clone());
            heard.queue.push_back(scan);
            drop(heard);
            shared.came.notify_all();
        })?;
        shared.heard().refused = source.refused();
    }
    Ok(())
}
