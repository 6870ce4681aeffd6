//! Options of sensors on a serial port.

use clap::{Args, value_parser};
use serde::Serialize;
use taxel_firmware::timing::NUCLEO_BAUD;

use crate::live::device::{Line, Protocol};
use crate::{Error, Result};

/// Speed of FlexiTac's line in bits a second.
const FLEXITAC_BAUD: u32 = 2_000_000;
/// Rows and columns of FlexiTac's larger pad.
const FLEXITAC_SHAPE: [usize; 2] = [16, 32];

/// Speed of a serial line.
#[derive(Args, Serialize)]
pub struct BaudArgument {
    /// Speed of the line in bits a second [default: the board's; 2000000 for flexitac].
    #[arg(long, value_name = "BAUD", value_parser = value_parser!(u32).range(1..))]
    pub baud: Option<u32>,
}

/// How a sensor on a serial port is read.
#[derive(Args, Serialize)]
pub struct SensorArguments {
    /// How a sensor on a serial port sends its readings [default: taxel].
    #[arg(long, value_enum, value_name = "NAME")]
    protocol: Option<Protocol>,
    /// Rows and columns of a sensor that does not report them, such as 16x32 [default for flexitac: 16x32].
    #[arg(long, value_name = "ROWSxCOLUMNS", value_parser = shape)]
    shape: Option<[usize; 2]>,
}

fn shape(text: &str) -> std::result::Result<[usize; 2], String> {
    let counts = text.split_once('x').map(|(rows, columns)| [rows.parse(), columns.parse()]);
    match counts {
        Some([Ok(rows @ 1..=255), Ok(columns @ 1..=255)]) => Ok([rows, columns]),
        _ => Err("give rows x columns, from 1 to 255 each, such as 16x32".into()),
    }
}

impl SensorArguments {
    /// The line of a sensor at `port`.
    ///
    /// # Errors
    /// If a sensor that tells its shape is given one.
    pub fn line(&self, port: String, line: &BaudArgument) -> Result<Line> {
        let protocol = self.protocol.unwrap_or(Protocol::Taxel);
        let (usual_baud, usual_shape) = match protocol {
            Protocol::Taxel | Protocol::Csv => (NUCLEO_BAUD, None),
            Protocol::Flexitac => (FLEXITAC_BAUD, Some(FLEXITAC_SHAPE)),
        };
        let (baud, shape) = (line.baud.unwrap_or(usual_baud), self.shape.or(usual_shape));
        if protocol == Protocol::Taxel && shape.is_some() {
            let message =
                "--shape is for --protocol csv or flexitac: a Taxel device reports its own";
            return Err(Error::Usage(message.into()));
        }
        Ok(Line { port, baud, protocol, shape, period_us: None })
    }
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
