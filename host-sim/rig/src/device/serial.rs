//! Serial ports of this computer.

use std::io;
use std::path::Path;
use std::time::Duration;

use serial2::SerialPort;

use super::Wire;
use crate::error::{Error, Result};

impl Wire for SerialPort {
    fn set_read_timeout(&mut self, timeout: Duration) -> io::Result<()> {
        self.set_read_timeout(timeout)
    }
}

/// Opens `port` with 8 data bits, no parity, 1 stop bit. What came before anybody listened is dropped: the system's buffer
/// was full at some time, and the reports in it are cut.
pub fn open(port: &str, baud: u32) -> Result<SerialPort> {
    let opened = SerialPort::open(port, baud).and_then(|port| {
        claim(&port)?;
        port.discard_input_buffer()?;
        Ok(port)
    });
    opened.map_err(|cause| {
        let names = names();
        let known = if names.is_empty() {
            "no serial port was found".to_owned()
        } else {
            format!("there are {}", names.join(", "))
        };
        let join = match cause.kind() {
            io::ErrorKind::PermissionDenied => " (on Linux you may have to join the group dialout)",
            _ => "",
        };
        Error::unfit_for("port", format!("{port}: {cause}; {known}{join}"))
    })
}

/// Names of the serial ports of this computer, those of USB first.
pub fn names() -> Vec<String> {
    let mut ports = SerialPort::available_ports().unwrap_or_default();
    ports.sort_by_key(|port| !is_usb(port));
    ports.into_iter().map(|port| port.to_string_lossy().into_owned()).collect()
}

/// Name of the port of USB that there is; `None` if there is none.
///
/// # Errors
/// If there are several: it names them.
pub fn only_usb() -> Result<Option<String>> {
    let mut ports = names();
    ports.retain(|port| is_usb(Path::new(port)));
    match ports.len() {
        0 | 1 => Ok(ports.pop()),
        _ => Err(Error::unfit_for("port", format!("there are {}: name one", ports.join(", ")))),
    }
}

/// Whether a port may be one of USB, by the names of Linux (ttyACM0, ttyUSB0), macOS (cu.usbmodem1, cu.usbserial1) and
/// Windows (COM3), which do not tell.
fn is_usb(port: &Path) -> bool {
    let name = port.to_string_lossy();
    ["ttyACM", "ttyUSB", "usbmodem", "usbserial", "COM"].iter().any(|part| name.contains(part))
}

/// Takes a port for this program alone: two would read half of the bytes each. Windows does so by itself.
#[cfg(unix)]
fn claim(port: &SerialPort) -> io::Result<()> {
    use std::fs::{File, TryLockError};
    use std::os::fd::AsFd;
    // The lock is the open port's, and ends with it.
    let same_port = File::from(port.as_fd().try_clone_to_owned()?);
    same_port.try_lock().map_err(|cause| match cause {
        TryLockError::WouldBlock => {
            io::Error::new(io::ErrorKind::ResourceBusy, "another program uses it")
        }
        TryLockError::Error(cause) => cause,
    })
}

#[cfg(not(unix))]
fn claim(_: &SerialPort) -> io::Result<()> {
    Ok(())
}
