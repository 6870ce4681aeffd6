//! The number formats that users choose among.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// How numbers and distances of a network are represented.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NumberFormat {
    /// f32, with expanded distances where rounding is proved harmless, else direct ones: the default.
    #[default]
    F32,
    /// f32, with direct distances.
    F32Direct,
    /// 16-bit fixed point: half the flash and less than half the time.
    Fixed16,
}
