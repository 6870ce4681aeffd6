//! How a sensor is read out: the circuit, its parts, and which of their faults are simulated.

use serde::{Deserialize, Serialize};

/// A readout. What it leaves out is not simulated.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Readout {
    /// Only in a scene's file, from 1: a world has [`read_rows`](crate::world::World::read_rows).
    pub row_wires: Option<Vec<usize>>,
    /// The circuit that turns resistances into voltages.
    pub circuit: Option<Circuit>,
    /// How rows are selected.
    pub row_drive: Option<Drive>,
    /// How columns are sampled.
    pub sampler: Option<Sampler>,
    /// How many of the converter's 12 bits are worth anything.
    pub adc_bits: Option<u8>,
    /// Samples averaged for a reading.
    pub oversampling: Option<u16>,
    /// Wait after every change of the rows.
    pub settling_us: Option<u32>,
    /// Whether all wires are one network; else each reading is a circuit of its own.
    pub cross_talk: Option<bool>,
    /// Resistance of a row's switch.
    pub row_switch_ohm: Option<f64>,
    /// Resistance of each wire's lead.
    pub line_ohm: Option<f64>,
    /// Largest offset of an op-amp; each column's is drawn between this and its negative.
    pub op_amp_offset_v: Option<f64>,
    /// Standard deviation of a sample.
    pub adc_noise_counts: Option<f64>,
    /// Time constant with which a column's voltage follows the rows.
    pub time_constant_us: Option<f64>,
}

/// How a resistance becomes a voltage; `docs/readout.md` draws both.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Circuit {
    /// Idle rows float, every column has a resistor to ground.
    Divider,
    /// Idle rows and all columns are held at one potential.
    #[default]
    ZeroPotential,
}

impl Circuit {
    /// Both, the simpler one first.
    pub const ALL: [Self; 2] = [Self::Divider, Self::ZeroPotential];

    /// Name in scenes and tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Divider => "divider",
            Self::ZeroPotential => "zero-potential",
        }
    }
}

/// How rows are selected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Drive {
    /// One pin a row.
    #[default]
    Pins,
    /// A 74HC4051.
    Multiplexer,
    /// A 74HC595.
    ShiftRegister,
}

/// How columns are sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sampler {
    /// Three MCP3208.
    #[default]
    Mcp3208,
    /// A converter on the microcontroller behind three 74HC4051.
    OnChip,
}
