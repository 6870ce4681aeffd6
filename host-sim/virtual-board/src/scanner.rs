//! Scanner of the firmware, on the parts of a virtual board.

use std::array;

use taxel_firmware::circuit::{Circuit, Divider, ZeroPotential};
use taxel_firmware::readout::{
    ColumnSampler, DirectPins, FrameSource, Mcp3208s, MultiplexedAdc, Multiplexer4051, RowDrive,
    Scanner, ShiftRegister595,
};

use super::board::VirtualBoard;
use super::pin::Pin;
use super::{COLUMNS, ROWS};
use taxel_simulate::readout::{self, Drive, Sampler};

/// Scanner for whatever parts a board has.
pub type FrameScanner = Box<dyn FrameSource>;

/// Resistances in series with each wire for which the firmware corrects readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeriesResistance {
    /// Resistance in series with each row: switch and lead.
    pub row_source_ohm: f32,
    /// Resistance in series with each column: lead.
    pub column_ohm: f32,
}

impl SeriesResistance {
    /// No series resistance: readings stay uncorrected.
    pub const NONE: Self = Self { row_source_ohm: 0.0, column_ohm: 0.0 };

    /// These resistances times `factor`.
    #[must_use]
    pub fn scaled(self, factor: f32) -> Self {
        Self { row_source_ohm: factor * self.row_source_ohm, column_ohm: factor * self.column_ohm }
    }
}

impl VirtualBoard {
    /// Actual series resistances of this board: a perfect calibration.
    pub fn series_resistance(&self) -> SeriesResistance {
        let line_ohm = self.readout().line_ohm.unwrap_or(0.0);
        let row_source_ohm = self.readout().row_switch_ohm.unwrap_or(0.0) + line_ohm;
        SeriesResistance { row_source_ohm: row_source_ohm as f32, column_ohm: line_ohm as f32 }
    }

    /// Scanner of the firmware for this board's parts, calibrated with `series`.
    pub fn scanner(&self, series: SeriesResistance) -> FrameScanner {
        let row_source_ohm: [f32; ROWS] = [series.row_source_ohm; ROWS];
        let series_ohm: [f32; COLUMNS] = [series.column_ohm; COLUMNS];
        match self.readout().circuit.unwrap_or_default() {
            readout::Circuit::Divider => {
                self.with_circuit(Divider { row_source_ohm, series_ohm, ..Divider::TYPICAL })
            }
            readout::Circuit::ZeroPotential => {
                let typical = ZeroPotential::TYPICAL;
                let sensor_rows = self.sensor_rows() as u16;
                self.with_circuit(ZeroPotential {
                    sensor_rows,
                    row_source_ohm,
                    series_ohm,
                    ..typical
                })
            }
        }
    }

    fn with_circuit(&self, circuit: impl Circuit + 'static) -> FrameScanner {
        match self.readout().sampler.unwrap_or_default() {
            Sampler::Mcp3208 => {
                let chips: [_; 3] = array::from_fn(|chip| self.spi(chip));
                self.with_sampler(circuit, Mcp3208s { chips })
            }
            Sampler::OnChip => {
                let address: [_; 3] = self.pins(Pin::ColumnAddress);
                let enable: [_; 3] = self.pins(Pin::ColumnEnable);
                self.with_sampler(circuit, MultiplexedAdc { adc: self.adc(), address, enable })
            }
        }
    }

    fn with_sampler(
        &self,
        circuit: impl Circuit + 'static,
        sampler: impl ColumnSampler + 'static,
    ) -> FrameScanner {
        match self.readout().row_drive.unwrap_or_default() {
            Drive::Pins => {
                let rows: [_; ROWS] = self.pins(Pin::Row);
                self.with_drive(circuit, sampler, DirectPins { rows })
            }
            Drive::Multiplexer => {
                let (address, enable) = (self.pins(Pin::RowAddress), self.pin(Pin::RowEnable));
                self.with_drive(circuit, sampler, Multiplexer4051 { address, enable })
            }
            Drive::ShiftRegister => {
                let [data, clock, latch] =
                    [Pin::RowData, Pin::RowClock, Pin::RowLatch].map(|pin| self.pin(pin));
                let drive = ShiftRegister595::<_, ROWS> { data, clock, latch };
                self.with_drive(circuit, sampler, drive)
            }
        }
    }

    fn with_drive(
        &self,
        circuit: impl Circuit + 'static,
        sampler: impl ColumnSampler + 'static,
        drive: impl RowDrive + 'static,
    ) -> FrameScanner {
        Box::new(Scanner::<_, _, _, _, ROWS, COLUMNS>::new(drive, sampler, self.delay(), circuit))
    }

    fn pins<const N: usize>(&self, pin: fn(u8) -> Pin) -> [super::VirtualPin; N] {
        array::from_fn(|number| self.pin(pin(number as u8)))
    }
}
