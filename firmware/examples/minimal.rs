//! Reads one row-wire by pins and SPI, and estimates how far its six electrodes are pressed in. Nothing here fails or panics,
//! and all of it takes less than 8 kB of flash without weights: `cargo xtask size`.
//!
//! The model, of `taxel synth press -n 20000 -o press.csv`:
//! `taxel train press.csv --inputs 'r4c*_ohm' --outputs 'r4e*_dz_mm' --centres 16 --format f32 -o row4.bin`

use embedded_hal::{delay::DelayNs, digital::OutputPin, spi::SpiDevice};
use taxel_core::{ColumnWires, RowWire};
use taxel_firmware::circuit::ZeroPotential;
use taxel_firmware::readout::{
    Mcp3208s, ScanSettings, Scanner, Selection, ShiftRegister595, WaitingSource,
};

/// What `taxel export row4.bin --rust row4.rs` writes.
#[path = "../../testdata/row4.rs"]
mod row4;

/// Resistors and voltages of the circuit. `docs/board.md` says how to measure them.
const CIRCUIT: ZeroPotential<8, 18> = ZeroPotential::TYPICAL;
/// A row settles for 20 µs. Each column is sampled once.
const SETTINGS: ScanSettings = ScanSettings { settling_us: 20, oversampling: 1 };
/// Row-wire 4 and its 18 column-wires.
const WIRES: Selection<'static> =
    Selection { rows: &[RowWire(3)], columns: ColumnWires::first(18) };

type Rows<P> = ShiftRegister595<P, 8>;
type Columns<S> = Mcp3208s<S, 3>;

/// Sensor behind a 74HC595, which drives its row-wires, and three MCP3208, which sample its column-wires.
pub struct Sensor<P, S, T> {
    scanner: Scanner<Rows<P>, Columns<S>, T, 8, 18>,
}

impl<P: OutputPin, S: SpiDevice, T: DelayNs> Sensor<P, S, T> {
    /// Makes a sensor of the register's pins, a SPI device for each converter, and a delay.
    pub fn new([data, clock, latch]: [P; 3], chips: [S; 3], delay: T) -> Self {
        let (rows, columns) = (ShiftRegister595 { data, clock, latch }, Mcp3208s { chips });
        Self { scanner: Scanner::new(rows, columns, delay, CIRCUIT) }
    }

    /// Scans the row and estimates how far each electrode is pressed in, in mm; NaN if a reading could not be taken.
    pub fn estimate_dz_mm(&mut self) -> [f32; 6] {
        let mut readings_ohm = [[f32::NAN; 18]];
        self.scanner.scan(SETTINGS, WIRES, readings_ohm.as_flattened_mut());
        let [dz_mm] = row4::decode(&readings_ohm).outputs;
        dz_mm
    }
}
