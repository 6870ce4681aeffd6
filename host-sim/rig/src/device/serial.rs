//! Serial ports of this computer.

use std::time::Duration;

use serialport::SerialPort;

use super::Wire;
use crate::error::{Error, Result};

impl Wire for Box<dyn SerialPort> {
    fn set_read_timeout(&mut self, timeout: Duration) -> std::io::Result<()> {
        Ok(self.as_mut().set_timeout(timeout)?)
    }
}

/// Opens `port` with 8 data bits, no parity, 1 stop bit.
pub fn open(port: &str, baud: u32) -> Result<Box<dyn SerialPort>> {
    serialport::new(port, baud).open().map_err(|cause| {
        let ports = serialport::available_ports().unwrap_or_default();
        let names: Vec<String> = ports.into_iter().map(|port| port.port_name).collect();
        let known = if names.is_empty() {
            "no serial port is to be seen".to_owned()
        } else {
            format!("there are {}", names.join(", "))
        };
        let join = "on Linux you may have to join the group dialout";
        Error::unfit_for("port", format!("{port}: {cause}; {known} ({join})"))
    })
}
