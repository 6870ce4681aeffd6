//! A board as a program: the firmware's readout against the sensor's wires as a network of resistors. Its op-amps are
//! ideal up to their supply, and its converters have 12 bits.

use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{self, OutputPin};
use embedded_hal::spi::{self, Operation, SpiDevice};
use taxel_core::{ColumnWires, RowWire};
use taxel_data::{Stream, Table};
use taxel_firmware::circuit::ZeroPotential;
use taxel_firmware::readout::{Mcp3208s, Scanner, Selection, ShiftRegister595};
use taxel_simulate::{Synthesis, World};

mod network;

use network::{Tie, potentials_v};

/// Row-wires that the board drives.
const ROWS: usize = 8;
/// Column-wires that the board samples.
const COLUMNS: usize = 18;

/// All wires of the board.
pub const WIRES: Selection<'static> = Selection {
    rows: &[
        RowWire(0),
        RowWire(1),
        RowWire(2),
        RowWire(3),
        RowWire(4),
        RowWire(5),
        RowWire(6),
        RowWire(7),
    ],
    columns: ColumnWires::first(COLUMNS),
};

/// Largest output in V of an op-amp.
const LARGEST_V: f64 = 3.2;

const TYPICAL: ZeroPotential<ROWS, COLUMNS> = ZeroPotential::TYPICAL;

/// Resistances in Ω in series with the wires.
#[derive(Debug, Clone, Copy)]
pub struct Series {
    /// Of a row's switch.
    pub row_switch: f32,
    /// Of each wire's lead.
    pub lead: f32,
}

impl Series {
    /// None.
    pub const NONE: Self = Self { row_switch: 0.0, lead: 0.0 };
}

/// The firmware's scanner on a virtual board.
pub type VirtualScanner =
    Scanner<ShiftRegister595<VirtualPin, ROWS>, Mcp3208s<VirtualSpi, 3>, NoDelay, ROWS, COLUMNS>;

/// A board with a sensor on it. Clones are handles to the same board.
#[derive(Clone)]
pub struct VirtualBoard(Rc<RefCell<State>>);

struct State {
    series: Series,
    /// Conductance in S between each row-wire and column-wire, row after row.
    conductance_s: Vec<f64>,
    register: Register,
    /// Outputs in V by active row, then for none active; computed when first asked for.
    outputs_v: [Option<[f64; COLUMNS]>; ROWS + 1],
}

/// The 74HC595 that selects a row.
#[derive(Default)]
struct Register {
    /// Levels of data, clock and latch.
    levels: [bool; 3],
    /// The eight stages, QA first, and what the outputs show.
    stages: [bool; ROWS],
    shown: [bool; ROWS],
}

impl VirtualBoard {
    /// A board with nothing connected.
    pub fn new(series: Series) -> Self {
        Self(Rc::new(RefCell::new(State {
            series,
            conductance_s: vec![0.0; ROWS * COLUMNS],
            register: Register::default(),
            outputs_v: [None; ROWS + 1],
        })))
    }

    /// Connects these resistances in Ω, row after row; infinite is open.
    pub fn set_readings(&self, ohm: &[f64]) {
        assert_eq!(ohm.len(), ROWS * COLUMNS, "a reading of every row-wire and column-wire");
        let mut state = self.0.borrow_mut();
        state.conductance_s = ohm.iter().map(|ohm| 1.0 / ohm).collect();
        state.outputs_v = [None; ROWS + 1];
    }

    /// Pins of the shift register: data, clock and latch.
    pub fn pins(&self) -> [VirtualPin; 3] {
        [0, 1, 2].map(|pin| VirtualPin { board: self.clone(), pin })
    }

    /// The converters.
    pub fn chips(&self) -> [VirtualSpi; 3] {
        [0, 1, 2].map(|chip| VirtualSpi { board: self.clone(), chip })
    }

    /// The firmware's scanner, with the board's own series resistances.
    pub fn scanner(&self) -> VirtualScanner {
        let [data, clock, latch] = self.pins();
        let Series { row_switch, lead } = self.0.borrow().series;
        let circuit = ZeroPotential {
            row_source_ohm: [row_switch + lead; ROWS],
            series_ohm: [lead; COLUMNS],
            ..TYPICAL
        };
        let drive = ShiftRegister595 { data, clock, latch };
        Scanner::new(drive, Mcp3208s { chips: self.chips() }, NoDelay, circuit)
    }
}

impl State {
    /// Outputs in V of all op-amps.
    fn outputs_v(&mut self) -> [f64; COLUMNS] {
        let active = self.register.shown.iter().position(|high| *high);
        let place = active.unwrap_or(ROWS);
        if let Some(known) = self.outputs_v[place] {
            return known;
        }
        let drive_v = f64::from(TYPICAL.drive_v);
        let lead = f64::from(self.series.lead);
        let through_ohm = f64::from(self.series.row_switch) + lead;
        // The active row is pulled to ground; all else is at V_b.
        let rows: [Tie; ROWS] = std::array::from_fn(|row| {
            let volt = if Some(row) == active { 0.0 } else { drive_v };
            Tie { volt, through_ohm }
        });
        let mut columns = [Tie { volt: drive_v, through_ohm: lead }; COLUMNS];
        let mut outputs = [LARGEST_V; COLUMNS];
        // An op-amp that is at its end holds its column no longer: the column hangs from it by the feedback resistor.
        loop {
            let potentials = potentials_v(&self.conductance_s, &rows, &columns);
            let mut has_changed = false;
            for k in 0..COLUMNS {
                if columns[k].volt == LARGEST_V {
                    continue;
                }
                let current_a = |m: usize| {
                    (potentials[ROWS + k] - potentials[m]) * self.conductance_s[m * COLUMNS + k]
                };
                let sum_a: f64 = (0..ROWS).map(current_a).sum();
                let feedback_ohm = f64::from(TYPICAL.feedback_ohm[k]);
                outputs[k] = drive_v + feedback_ohm * sum_a;
                if outputs[k] > LARGEST_V {
                    outputs[k] = LARGEST_V;
                    columns[k] = Tie { volt: LARGEST_V, through_ohm: lead + feedback_ohm };
                    has_changed = true;
                }
            }
            if !has_changed {
                break;
            }
        }
        self.outputs_v[place] = Some(outputs);
        outputs
    }
}

impl Register {
    fn set(&mut self, pin: usize, high: bool) {
        let [data, ..] = self.levels;
        let was_high = std::mem::replace(&mut self.levels[pin], high);
        let rises = high && !was_high;
        match pin {
            1 if rises => {
                self.stages.rotate_right(1);
                self.stages[0] = data;
            }
            2 if rises => {
                self.shown = self.stages;
                let driven = self.shown.iter().filter(|high| **high).count();
                assert!(driven <= 1, "{driven} rows were driven at once");
            }
            _ => {}
        }
    }
}

/// A pin of a virtual board's shift register.
pub struct VirtualPin {
    board: VirtualBoard,
    pin: usize,
}

impl digital::ErrorType for VirtualPin {
    type Error = Infallible;
}

impl OutputPin for VirtualPin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.board.0.borrow_mut().register.set(self.pin, false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.board.0.borrow_mut().register.set(self.pin, true);
        Ok(())
    }
}

/// An MCP3208 of a virtual board.
pub struct VirtualSpi {
    board: VirtualBoard,
    chip: usize,
}

impl spi::ErrorType for VirtualSpi {
    type Error = Infallible;
}

impl SpiDevice for VirtualSpi {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        let [Operation::TransferInPlace(bytes)] = operations else { panic!("one exchange") };
        let [first, second, _] = **bytes else { panic!("{} bytes", bytes.len()) };
        assert_eq!(first & 0b1111_1110, 0b0000_0110, "a start bit, and one input against ground");
        let column = 8 * self.chip + usize::from((first & 1) << 2 | second >> 6);
        let volt = self.board.0.borrow_mut().outputs_v()[column];
        let counts = (volt / f64::from(TYPICAL.reference_v) * 4096.0).round().min(4095.0) as u16;
        let [high, low] = counts.to_be_bytes();
        bytes.copy_from_slice(&[0, high, low]);
        Ok(())
    }
}

/// A delay on a board whose voltages settle at once.
pub struct NoDelay;

impl DelayNs for NoDelay {
    fn delay_ns(&mut self, _: u32) {}
}

/// Ideal readings in Ω of all wires of the sensor, without noise and drift.
pub fn all_readings(world: &World, frames: usize) -> Table {
    let world = World { read_rows: (0..world.sensor.row_wires).collect(), ..world.clone() };
    Synthesis::new(&world).ideal().drift(None).frames(Stream::Test, frames).inputs
}
