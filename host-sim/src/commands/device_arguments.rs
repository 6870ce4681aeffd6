//! Options of sensors on a serial port.

use clap::{Args, value_parser};
use serde::Serialize;

use crate::{Error, Result};

/// Speed of a serial line.
#[derive(Args, Serialize)]
pub struct BaudArgument {
    /// Speed of the line in bits a second [default: the board's; 2000000 of flexitac].
    #[arg(long, value_name = "BAUD", value_parser = value_parser!(u32).range(1..))]
    pub baud: Option<u32>,
}

/// Period of scans.
#[derive(Args, Serialize)]
pub struct ScanPeriodArgument {
    /// Time from one scan of a device to the next [default: the device's own].
    #[arg(long, value_name = "US", value_parser = value_parser!(u32).range(..=1_000_000_000))]
    pub period_us: Option<u32>,
}

impl ScanPeriodArgument {
    /// Error for a period with which no frames come.
    pub fn check(&self) -> Result<()> {
        match self.period_us {
            Some(period_us @ ..100) => {
                Err(Error::Usage(format!("--period-us {period_us}: give at least 100")))
            }
            _ => Ok(()),
        }
    }
}
