//! Decoders and scans that `trade` and `compare` try, and what they choose by.

use crate::Error;
use crate::device::Readout;
use clap::{Args, ValueEnum, value_parser};
use taxel_data::BadValue;

use super::arguments::of_option;

/// Decoders and scans to try, and the choice among them.
#[derive(Args)]
pub struct DecoderArguments {
    /// Numbers of samples to average for each reading, to try: more samples lower the noise and make the scan longer
    /// [default: 1].
    #[arg(long, value_name = "N,…", value_delimiter = ',')]
    pub average: Vec<usize>,
    /// Readout: the board's own converters, which scan while the previous frame is decoded (docs/board.md), or converters
    /// on the SPI of your own board.
    #[arg(long, value_enum, default_value_t = ReadoutOption::Onchip)]
    pub readout: ReadoutOption,
    /// Choose among decoders that take at most so many ms, from the start of a scan to its estimate.
    #[arg(long, value_name = "MS")]
    pub max_latency_ms: Option<f64>,
    /// Outputs that determine the choice, such as dz_mm; in trade also all, which uses the mean of RMSE/standard
    /// deviation [default: the last of a scene, all of a data file].
    #[arg(long, value_name = "GROUP")]
    pub group: Option<String>,
    #[command(flatten)]
    pub limit: LimitArgument,
}

/// Frames of a scene on which the least possible error is computed.
#[derive(Args, Default)]
pub struct LimitArgument {
    /// Number of test frames on which the least possible error is computed. For contacts that move, it is a number of
    /// trajectories, which take a second or more each [default: as many as needed; none for contacts that move].
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(2..))]
    pub limit_frames: Option<u16>,
}

impl LimitArgument {
    /// Number of frames, if it is given.
    pub fn frames(&self) -> Option<usize> {
        self.limit_frames.map(usize::from)
    }
}

/// Time of a scan, of which the board's own is known.
#[derive(Args)]
pub struct ScanTimeArgument {
    /// Time in ms of a scan with one sample per reading, which reads rows one after another [default: that of the board].
    #[arg(long, value_name = "MS")]
    pub scan_ms: Option<f64>,
}

/// Error for a `bad` field of a plan, which names the option that gave it.
pub fn of_field(bad: BadValue) -> Error {
    of_option(match bad.field.strip_prefix("device.") {
        Some("samples") => bad.named("--average"),
        Some(field) => {
            let option = format!("--{}", field.replace('_', "-"));
            bad.named(&option)
        }
        None if bad.field == "limit_frames" => bad.named("--limit-frames"),
        None => bad,
    })
}

/// Value of `--readout`.
#[derive(Clone, Copy, ValueEnum)]
pub enum ReadoutOption {
    Spi,
    Onchip,
}

impl From<ReadoutOption> for Readout {
    fn from(option: ReadoutOption) -> Self {
        match option {
            ReadoutOption::Spi => Self::Spi,
            ReadoutOption::Onchip => Self::OnChip,
        }
    }
}
