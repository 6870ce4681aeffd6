//! A device on a serial line, listened to in the background.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, mpsc};
use std::thread;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use numpy::PyArray1;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use taxel_firmware::link::message::{ConfidenceSent, Configuration, Report};
use taxel_rig::Error;
use taxel_rig::device::{Device, serial};

use crate::call::wait;

/// Time that one look for reports takes, after which the listener sees whether it is to end.
const LOOK: Duration = Duration::from_millis(100);
/// Time between two looks for Ctrl-C of who waits for a reading.
const WAIT: Duration = Duration::from_millis(50);

/// What a device sent of one scan.
#[derive(Clone, Default)]
struct Reading {
    frame: u32,
    start_us: u64,
    readings: Vec<f32>,
    outputs: Vec<f32>,
    status: Vec<u8>,
    flags: u8,
    deviations: Vec<f32>,
    novelty: Option<f32>,
    heard: Option<Instant>,
}

/// Readings that were heard and not taken yet.
#[derive(Default)]
struct Heard {
    queue: VecDeque<Reading>,
    newest: Option<Reading>,
    /// Number of scans that never came, or were dropped because nobody took them.
    lost: u64,
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

/// Names of the serial ports of this computer; those of USB first.
#[pyfunction]
pub fn ports() -> Vec<String> {
    serial::names()
}

/// A line to a device, and what came over it.
#[pyclass(frozen, module = "taxel._native")]
pub struct Line {
    shared: Arc<Shared>,
    stop: Arc<AtomicBool>,
    listener: Mutex<Option<JoinHandle<()>>>,
    /// Board, version of its firmware, and CRC-32 of its model.
    #[pyo3(get)]
    identity: (String, String, Option<u32>),
    /// Rows, readings of a row, and outputs of a row.
    #[pyo3(get)]
    shape: (usize, usize, usize),
}

/// What is to be sent of each scan.
#[derive(Clone, Copy)]
struct Wanted {
    readings: bool,
    estimates: bool,
}

/// Board, version of its firmware and CRC-32 of its model; rows, readings of a row, and outputs of a row.
type Identity = ((String, String, Option<u32>), (usize, usize, usize));

fn refused(error: &Error) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}

/// Opens the line, and lets the device scan.
fn open(
    port: &str,
    baud: u32,
    configuration: Configuration,
    wanted: Option<Wanted>,
    stop: &Arc<AtomicBool>,
) -> Result<(Device, Identity, Wanted), Error> {
    let mut device = Device::new(serial::open(port, baud)?)?;
    device.stop = Some(Arc::clone(stop));
    let identity = device.identify()?;
    let model = identity.model.as_ref();
    let shape = model.map_or((identity.rows, identity.columns, 0), |model| {
        (model.rows.into(), model.inputs.into(), model.outputs.into())
    });
    let crc = model.map(|model| model.crc_32);
    let wanted = wanted.unwrap_or(Wanted { readings: crc.is_none(), estimates: crc.is_some() });
    device.pause()?;
    device.configure(Configuration {
        send_readings: wanted.readings,
        send_estimates: wanted.estimates,
        ..configuration
    })?;
    Ok((device, ((identity.board, identity.firmware, crc), shape), wanted))
}

/// Keeps what a device sends of its scans until `stop`.
fn listen(
    device: &mut Device,
    (shared, stop): (&Shared, &AtomicBool),
    wanted: Wanted,
    buffer: usize,
) -> Result<(), Error> {
    let mut readings: Option<(u32, Vec<f32>)> = None;
    let mut last = None;
    while !stop.load(Ordering::Relaxed) {
        device.hear(Instant::now() + LOOK, |_, report| {
            let reading = match report {
                Report::Readings { frame, start_us, readings_ohm } => {
                    let values: Vec<f32> = readings_ohm.iter().collect();
                    if wanted.estimates {
                        readings = Some((*frame, values));
                        return None::<()>;
                    }
                    Reading {
                        frame: *frame,
                        start_us: *start_us,
                        readings: values,
                        ..Reading::default()
                    }
                }
                Report::Estimate(estimate) => {
                    let of_scan = readings.take().filter(|(frame, _)| *frame == estimate.frame);
                    Reading {
                        frame: estimate.frame,
                        start_us: estimate.start_us,
                        readings: of_scan.map_or_else(Vec::new, |(_, values)| values),
                        outputs: estimate.outputs.iter().collect(),
                        status: estimate.row_status.to_vec(),
                        flags: estimate.flags,
                        deviations: estimate.deviation.iter().collect(),
                        novelty: estimate.novelty,
                        heard: None,
                    }
                }
                _ => return None,
            };
            let missed = last.map_or(0, |last| reading.frame.wrapping_sub(last).saturating_sub(1));
            last = Some(reading.frame);
            let reading = Reading { heard: Some(Instant::now()), ..reading };
            let mut heard = shared.heard();
            heard.lost += u64::from(missed);
            if heard.queue.len() >= buffer {
                heard.queue.pop_front();
                heard.lost += 1;
            }
            heard.newest = Some(reading.clone());
            heard.queue.push_back(reading);
            drop(heard);
            shared.came.notify_all();
            None
        })?;
    }
    Ok(())
}

/// A reading as Python takes it: frame, time, age in ms, and arrays.
type Taken<'py> = (
    (u32, u64, f64, u64),
    (Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<u8>>, u8),
    (Bound<'py, PyArray1<f32>>, Option<f32>),
);

fn taken(py: Python<'_>, reading: Reading, lost: u64) -> Taken<'_> {
    let age_ms = reading.heard.map_or(f64::NAN, |heard| heard.elapsed().as_secs_f64() * 1e3);
    (
        (reading.frame, reading.start_us, age_ms, lost),
        (
            PyArray1::from_vec(py, reading.readings),
            PyArray1::from_vec(py, reading.outputs),
            PyArray1::from_vec(py, reading.status),
            reading.flags,
        ),
        (PyArray1::from_vec(py, reading.deviations), reading.novelty),
    )
}

#[pymethods]
impl Line {
    /// Opens a port and listens. `send` is "readings", "estimates" or "both"; None takes estimates from a device with a model,
    /// and readings from another.
    #[new]
    #[pyo3(signature = (port, baud, period_us, send, confidence, buffer))]
    fn new(
        py: Python<'_>,
        port: String,
        baud: u32,
        period_us: Option<u32>,
        send: Option<&str>,
        confidence: bool,
        buffer: usize,
    ) -> PyResult<Self> {
        let wanted = match send {
            None => None,
            Some("readings") => Some(Wanted { readings: true, estimates: false }),
            Some("estimates") => Some(Wanted { readings: false, estimates: true }),
            Some("both") => Some(Wanted { readings: true, estimates: true }),
            Some(other) => {
                let message =
                    format!("send = {other:?}: give \"readings\", \"estimates\" or \"both\"");
                return Err(PyValueError::new_err(message));
            }
        };
        let usual = Configuration::DEFAULT;
        let configuration = Configuration {
            frame_period_us: period_us.unwrap_or(usual.frame_period_us),
            confidence: if confidence { ConfidenceSent::Deviations } else { usual.confidence },
            ..usual
        };
        let stop: Arc<AtomicBool> = Arc::default();
        let flag = Arc::clone(&stop);
        let shared: Arc<Shared> = Arc::default();
        let (of_listener, (sender, receiver)) = (Arc::clone(&shared), mpsc::channel());
        let listener = thread::Builder::new().name("taxel link".into()).spawn(move || {
            let opened = open(&port, baud, configuration, wanted, &flag);
            let (mut device, wanted) = match opened {
                Ok((device, identity, wanted)) => {
                    let _ = sender.send(Ok(identity));
                    (device, wanted)
                }
                Err(error) => {
                    let _ = sender.send(Err(error));
                    return;
                }
            };
            let ended = listen(&mut device, (&of_listener, &flag), wanted, buffer.max(1));
            let cause = match ended {
                Ok(()) => "the link is closed".into(),
                Err(_) if flag.load(Ordering::Relaxed) => "the link is closed".into(),
                Err(error) => error.to_string(),
            };
            device.stop = None;
            let _ = device.resume();
            of_listener.heard().ended = Some(cause);
            of_listener.came.notify_all();
        })?;
        let Some(opened) = wait(py, &stop, receiver)? else {
            return Err(PyRuntimeError::new_err("a defect of taxel: the listener ended"));
        };
        let (identity, shape) = opened.map_err(|error| refused(&error))?;
        Ok(Self { shared, stop, listener: Mutex::new(Some(listener)), identity, shape })
    }

    /// The oldest reading that was not taken yet; None if none comes within so many seconds.
    fn next<'py>(&self, py: Python<'py>, within_s: f64) -> PyResult<Option<Taken<'py>>> {
        let deadline = Instant::now() + Duration::from_secs_f64(within_s.clamp(0.0, 1e6));
        loop {
            let (reading, ended, lost) = py.detach(|| {
                let heard = self.shared.heard();
                let waits = |heard: &mut Heard| heard.queue.is_empty() && heard.ended.is_none();
                let left = deadline.saturating_duration_since(Instant::now()).min(WAIT);
                let (mut heard, _) = (self.shared.came)
                    .wait_timeout_while(heard, left, waits)
                    .unwrap_or_else(PoisonError::into_inner);
                (heard.queue.pop_front(), heard.ended.clone(), heard.lost)
            });
            if let Some(reading) = reading {
                return Ok(Some(taken(py, reading, lost)));
            }
            if let Some(cause) = ended {
                return Err(PyRuntimeError::new_err(cause));
            }
            py.check_signals()?;
            if Instant::now() >= deadline {
                return Ok(None);
            }
        }
    }

    /// The newest reading; those before it are not taken any more. None if it is older than this, or none has come.
    fn newest<'py>(&self, py: Python<'py>, most_age_ms: f64) -> PyResult<Option<Taken<'py>>> {
        let mut heard = self.shared.heard();
        heard.queue.clear();
        let is_fresh = |reading: &&Reading| {
            reading.heard.is_some_and(|at| at.elapsed().as_secs_f64() * 1e3 <= most_age_ms)
        };
        let newest = heard.newest.as_ref().filter(is_fresh).cloned();
        let (ended, lost) = (heard.ended.clone(), heard.lost);
        drop(heard);
        match (newest, ended) {
            (Some(reading), _) => Ok(Some(taken(py, reading, lost))),
            (None, Some(cause)) => Err(PyRuntimeError::new_err(cause)),
            (None, None) => Ok(None),
        }
    }

    /// Stops listening: the device returns to its own configuration, and the port is free.
    fn close(&self, py: Python<'_>) {
        self.stop.store(true, Ordering::Relaxed);
        let listener = self.listener.lock().unwrap_or_else(PoisonError::into_inner).take();
        py.detach(|| listener.map(JoinHandle::join));
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}
