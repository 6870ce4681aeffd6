//! A device on a serial line, listened to in the background.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use numpy::PyArray1;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use taxel_firmware::link::message::{ConfidenceSent, Configuration};
use taxel_rig::Error;
use taxel_rig::device::{Device, DeviceIdentity, serial};
use taxel_rig::scans::{DeviceScans, Listener, MarkedBytes, NumberLines, Scan, Sent, Source};

use crate::call::wait;

/// Time between two looks for Ctrl-C of who waits for a reading.
const WAIT: Duration = Duration::from_millis(50);

/// Names of the serial ports of this computer; those of USB first.
#[pyfunction]
pub fn ports() -> Vec<String> {
    serial::names()
}

/// Name of the port of USB that there is; None without one.
#[pyfunction]
pub fn only_usb_port() -> PyResult<Option<String>> {
    serial::only_usb().map_err(|error| PyValueError::new_err(error.to_string()))
}

/// A line to a device, and what came over it.
#[pyclass(frozen, module = "taxel._native")]
pub struct Line {
    listener: Listener,
    /// Board, version of its firmware, and CRC-32 of its model.
    #[pyo3(get)]
    identity: (String, String, Option<u32>),
    /// Rows, readings of a row, and outputs of a row.
    #[pyo3(get)]
    shape: (usize, usize, usize),
}

/// Board, version of its firmware and CRC-32 of its model; rows, readings of a row, and outputs of a row.
type Identity = ((String, String, Option<u32>), (usize, usize, usize));

fn refused(error: &Error) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}

/// What Python is told of a device.
fn identity(identity: DeviceIdentity) -> Identity {
    let model = identity.model.as_ref();
    let shape = model.map_or((identity.rows, identity.columns, 0), |model| {
        (model.rows.into(), model.inputs.into(), model.outputs.into())
    });
    let crc = model.map(|model| model.crc_32);
    ((identity.board, identity.firmware, crc), shape)
}

/// A time that somebody waits; none for what is no time.
fn seconds(time_s: f64) -> Duration {
    Duration::try_from_secs_f64(time_s.min(1e6)).unwrap_or_default()
}

/// A reading as Python takes it: frame, time, age in ms, and arrays.
type Taken<'py> = (
    (u32, u64, f64, u64),
    (Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<u8>>, u8),
    (Bound<'py, PyArray1<f32>>, Option<f32>),
);

fn taken(py: Python<'_>, scan: Scan, lost: u64) -> Taken<'_> {
    let age_ms = scan.heard.elapsed().as_secs_f64() * 1e3;
    let estimate = scan.estimate.unwrap_or_default();
    (
        (scan.number, scan.start_us, age_ms, lost),
        (
            PyArray1::from_vec(py, scan.readings),
            PyArray1::from_vec(py, estimate.outputs),
            PyArray1::from_vec(py, estimate.row_status),
            estimate.flags,
        ),
        (PyArray1::from_vec(py, estimate.deviations), estimate.novelty),
    )
}

#[pymethods]
impl Line {
    /// Opens a port and listens. `send` is "readings", "estimates" or "both"; None takes estimates from a device with a model,
    /// and readings from another.
    #[new]
    #[pyo3(signature = (port, protocol, baud, shape, period_us, send, confidence, buffer))]
    #[expect(clippy::too_many_arguments, reason = "they are those of taxel.Link")]
    fn new(
        py: Python<'_>,
        port: String,
        protocol: &str,
        baud: u32,
        shape: (usize, usize),
        period_us: Option<u32>,
        send: Option<&str>,
        confidence: bool,
        buffer: usize,
    ) -> PyResult<Self> {
        let sent = match send {
            None => None,
            Some("readings") => Some(Sent { readings: true, estimates: false }),
            Some("estimates") => Some(Sent { readings: false, estimates: true }),
            Some("both") => Some(Sent { readings: true, estimates: true }),
            Some(other) => {
                let message =
                    format!("send = {other:?}: give \"readings\", \"estimates\" or \"both\"");
                return Err(PyValueError::new_err(message));
            }
        };
        let other = match protocol {
            "taxel" => None,
            "flexitac" => Some(true),
            "csv" => Some(false),
            other => {
                let message =
                    format!("protocol = {other:?}: give \"taxel\", \"flexitac\" or \"csv\"");
                return Err(PyValueError::new_err(message));
            }
        };
        let open = move |stop: &Arc<AtomicBool>| -> Result<(Box<dyn Source>, _), Error> {
            let wire = serial::open(&port, baud)?;
            if let Some(is_marked) = other {
                let count = shape.0 * shape.1;
                let source: Box<dyn Source> = if is_marked {
                    Box::new(MarkedBytes::new(wire, count)?)
                } else {
                    Box::new(NumberLines::new(wire, count)?)
                };
                return Ok((source, ((port, String::new(), None), (shape.0, shape.1, 0))));
            }
            let mut device = Device::new(wire)?;
            device.stop = Some(Arc::clone(stop));
            let own = device.resume_to_scan()?;
            let configuration = Configuration {
                frame_period_us: period_us.unwrap_or(own.frame_period_us),
                confidence: if confidence { ConfidenceSent::Deviations } else { own.confidence },
                ..own
            };
            let (scans, found) = DeviceScans::new(device, configuration, sent)?;
            Ok((Box::new(scans), identity(found)))
        };
        let (listener, opened) = Listener::start(buffer, open).map_err(|error| refused(&error))?;
        let Some(opened) = wait(py, listener.stop(), opened)? else {
            return Err(PyRuntimeError::new_err("an error in taxel: the listener ended"));
        };
        let (identity, shape) = opened.map_err(|error| refused(&error))?;
        Ok(Self { listener, identity, shape })
    }

    /// The oldest reading that was not taken yet; None if none comes within so many seconds.
    fn next<'py>(&self, py: Python<'py>, within_s: f64) -> PyResult<Option<Taken<'py>>> {
        let deadline = Instant::now() + seconds(within_s);
        loop {
            let left = deadline.saturating_duration_since(Instant::now()).min(WAIT);
            let scan = py.detach(|| self.listener.next(left)).map_err(|error| refused(&error))?;
            if let Some(scan) = scan {
                return Ok(Some(taken(py, scan, self.listener.lost())));
            }
            py.check_signals()?;
            if Instant::now() >= deadline {
                return Ok(None);
            }
        }
    }

    /// The newest reading; those before it are not taken any more. None if it is older than this, or none has come.
    fn newest<'py>(&self, py: Python<'py>, most_age_ms: f64) -> PyResult<Option<Taken<'py>>> {
        let most_age = seconds(most_age_ms / 1e3);
        let newest = self.listener.newest(most_age).map_err(|error| refused(&error))?;
        Ok(newest.map(|scan| taken(py, scan, self.listener.lost())))
    }

    /// Stops listening: the device returns to its own configuration, and the port is free.
    fn close(&self, py: Python<'_>) {
        py.detach(|| self.listener.close());
    }
}
