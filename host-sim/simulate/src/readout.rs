//! Readout of a sensor: the circuit, its parts, and the faults of these that are simulated.

use serde::{Deserialize, Serialize};

/// Settings of a readout. Faults that are left out are not simulated.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Readout {
    /// Row-wires that are read, from 1; only in a scene's file, since a world has
    /// [`read_rows`](crate::world::World::read_rows).
    pub row_wires: Option<Vec<usize>>,
    /// Column-wires that are read, from 1; only in a scene's file, since a world's sensor has
    /// [`read_columns`](crate::sensor::Sensor::read_columns).
    pub column_wires: Option<Vec<usize>>,
    /// Circuit that turns resistances into voltages.
    pub circuit: Option<Circuit>,
    /// Parts that select rows.
    pub row_drive: Option<Drive>,
    /// Parts that sample columns.
    pub sampler: Option<Sampler>,
    /// Effective resolution of the converter, of 12 bits.
    pub adc_bits: Option<u8>,
    /// Number of samples averaged for a reading.
    pub oversampling: Option<u16>,
    /// Wait after every change of the rows.
    pub settling_us: Option<u32>,
    /// Whether all wires form one network; otherwise each reading is a circuit of its own.
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

/// Circuit that turns a resistance into a voltage; `docs/readout.md` draws both.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Circuit {
    /// Voltage divider: idle rows float, and every column has a resistor to ground.
    Divider,
    /// Zero-potential circuit: idle rows and all columns are held at one potential.
    #[default]
    ZeroPotential,
}

impl Circuit {
    /// Both circuits, the simpler one first.
    pub const ALL: [Self; 2] = [Self::Divider, Self::ZeroPotential];

    /// Name of the circuit in scenes and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Divider => "divider",
            Self::ZeroPotential => "zero-potential",
        }
    }
}

/// Parts that select rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Drive {
    /// One pin of the microcontroller for each row.
    #[default]
    Pins,
    /// A 74HC4051 multiplexer.
    Multiplexer,
    /// A 74HC595 shift register.
    ShiftRegister,
}

/// Parts that sample columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sampler {
    /// Three MCP3208 converters.
    #[default]
    Mcp3208,
    /// Converter on the microcontroller behind three 74HC4051 multiplexers.
    OnChip,
}
