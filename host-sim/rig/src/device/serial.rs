//! Serial ports of this computer.

use std::time::Duration;

use serialport::{ClearBuffer, SerialPort, SerialPortType};

use super::Wire;
use crate::error::{Error, Result};

impl Wire for Box<dyn SerialPort> {
    fn set_read_timeout(&mut self, timeout: Duration) -> std::io::Result<()> {
        Ok(self.as_mut().set_timeout(timeout)?)
    }
}

/// Opens `port` with 8 data bits, no parity, 1 stop bit. What came before anybody listened is dropped: the system's buffer
/// was full at some time, and the reports in it are cut.
pub fn open(port: &str, baud: u32) -> Result<Box<dyn SerialPort>> {
    let opened = serialport::new(port, baud).open();
    let cleared = opened.and_then(|port| port.clear(ClearBuffer::Input).map(|()| port));
    cleared.map_err(|cause| {
        let names = names();
        let known = if names.is_empty() {
            "no serial port is to be seen".to_owned()
        } else {
            format!("there are {}", names.join(", "))
        };
        let join = "on Linux you may have to join the group dialout";
        Error::unfit_for("port", format!("{port}: {cause}; {known} ({join})"))
    })
}

/// Names of the serial ports of this computer, those of USB first.
pub fn names() -> Vec<String> {
    let mut ports = serialport::available_ports().unwrap_or_default();
    ports.sort_by_key(|port| !matches!(port.port_type, SerialPortType::UsbPort(_)));
    ports.into_iter().map(|port| port.port_name).collect()
}
