//! Virtual board: its parts, its clock, and a record of their use.

use std::cell::RefCell;
use std::rc::Rc;

use taxel_core::{ColumnWires, RowWire};
use taxel_data::{BadValue, Error, Purpose, Random, Stream};
use taxel_firmware::readout::{ScanSettings, Selection};
use taxel_firmware::timing;

use super::analogue::{Analogue, Parts, reference_v};
use super::converters::{ColumnSelector, mcp3208_answer, mcp3208_column};
use super::fault::BoardFault;
use super::pin::Pin;
use super::rows::RowSelector;
use super::violation::Violation;
use super::{COLUMNS, ROWS};
use taxel_simulate::readout::{Readout, Sampler};
use taxel_simulate::world::World;

/// Resolution of every converter on the board, in bits.
const CONVERTER_BITS: u8 = 12;
/// Clock of the SPI bus: the highest that an MCP3208 accepts at 3.3 V.
const SPI_CLOCK_HZ: u32 = 1_000_000;
/// Number of looks for which the microcontroller's converter is not ready, and duration of one look.
const POLLS: u32 = 2;
const POLL_NS: u64 = 500;

/// Number of uses of each kind of part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Transactions {
    /// Pins that were set, to either level.
    pub pins_set: usize,
    pub transfers: usize,
    pub conversions: usize,
    pub waits: usize,
}

/// Board with a sensor on it. Clones are handles to the same board.
#[derive(Debug, Clone)]
pub struct VirtualBoard {
    board: Rc<RefCell<Board>>,
    readout: Rc<Readout>,
    /// Row-wires that the world reads, and column-wires of its sensor.
    rows: Rc<[RowWire]>,
    columns: usize,
    /// Number of the sensor's row-wires.
    sensor_rows: usize,
}

#[derive(Debug)]
struct Board {
    analogue: Analogue,
    rows: RowSelector,
    /// Column multiplexers; `None` if MCP3208s sample the columns.
    columns: Option<ColumnSelector>,
    adc_bits: u8,
    adc_noise_counts: f64,
    noise: Random,
    seed: u64,
    frame: u64,
    time_constant_us: f64,
    now_ns: u64,
    /// Time of the rows' last change, if there was one, and the outputs at that time.
    changed_ns: Option<u64>,
    before_v: [f64; COLUMNS],
    violations: Vec<Violation>,
    transactions: Transactions,
}

impl VirtualBoard {
    /// Board for `world`'s sensor, seed and readout, with nothing connected: all nodes open.
    pub fn new(world: &World) -> Result<Self, BadValue> {
        Self::with_readout(world, &world.readout)
    }

    /// Board like [`new`](Self::new)'s, with another `readout` than the world's.
    pub fn with_readout(world: &World, readout: &Readout) -> Result<Self, BadValue> {
        let sensor = &world.sensor;
        if sensor.row_wires > ROWS || sensor.column_wires > COLUMNS {
            let wires =
                format!("{} row-wires and {} column-wires", sensor.row_wires, sensor.column_wires);
            let rule = format!(
                "the virtual board has parts for {ROWS} and {COLUMNS}; set sensor.row_wires and \
                 sensor.column_wires to at most these"
            );
            return Err(BadValue::new("sensor", wires, rule));
        }
        if !sensor.column_numbers().eq(0..sensor.column_wires) {
            // The columns that are not read load the rows too.
            let columns = format!("{} of the sensor's", sensor.column_wires);
            let rule = "the virtual board holds the whole sensor; leave this out";
            return Err(BadValue::new("readout.column_wires", columns, rule));
        }
        let columns = match readout.sampler.unwrap_or_default() {
            Sampler::Mcp3208 => None,
            Sampler::OnChip => Some(ColumnSelector::new()),
        };
        let board = Board {
            analogue: Analogue::new(readout, world.seed),
            rows: RowSelector::new(readout.row_drive.unwrap_or_default()),
            columns,
            adc_bits: readout.adc_bits.unwrap_or(CONVERTER_BITS),
            adc_noise_counts: readout.adc_noise_counts.unwrap_or(0.0),
            noise: noise_of_frame(world.seed, 0),
            seed: world.seed,
            frame: 0,
            time_constant_us: readout.time_constant_us.unwrap_or(0.0),
            now_ns: 0,
            changed_ns: None,
            before_v: [0.0; COLUMNS],
            violations: Vec::new(),
            transactions: Transactions::default(),
        };
        Ok(Self {
            board: Rc::new(RefCell::new(board)),
            readout: Rc::new(readout.clone()),
            rows: world.read_rows.iter().copied().map(RowWire).collect(),
            columns: sensor.column_wires,
            sensor_rows: sensor.row_wires,
        })
    }

    /// Wires that a scan reads: the world's rows, and all columns of its sensor.
    pub fn wires(&self) -> Selection<'_> {
        Selection { rows: &self.rows, columns: ColumnWires::first(self.columns) }
    }

    /// Connects a sensor with the given row–column resistances in Ω, row after row; infinite is open.
    /// All voltages settle at once.
    ///
    /// # Panics
    /// If there is not one resistance for each of the sensor's row-wires and column-wires, or one is negative or NaN.
    pub fn set_readings(&self, ohm: &[f64]) {
        assert_eq!(ohm.len(), self.sensor_rows * self.columns, "a reading of each two wires");
        let board = &mut *self.board.borrow_mut();
        let mut all = vec![f64::INFINITY; ROWS * COLUMNS];
        for (to, from) in all.chunks_mut(COLUMNS).zip(ohm.chunks(self.columns)) {
            to[..self.columns].copy_from_slice(from);
        }
        board.analogue.set_readings(&all);
        board.before_v = board.analogue.outputs_v(board.rows.active());
        board.frame += 1;
        board.noise = noise_of_frame(board.seed, board.frame);
    }

    /// Replaces the parts of the zero-potential circuit, which are typical and alike otherwise.
    pub fn set_parts(&self, parts: Parts) {
        self.board.borrow_mut().analogue.set_parts(parts);
    }

    /// Gives the board these faults, and no others.
    pub fn set_faults(&self, faults: &[BoardFault]) {
        self.board.borrow_mut().analogue.set_faults(faults);
    }

    /// Scan settings of the readout, with its own wait or the one that its time constant needs.
    pub fn scan_settings(&self) -> ScanSettings {
        let board = self.board.borrow();
        let settling_us = self.readout.settling_us.unwrap_or(board.needed_settling_us());
        ScanSettings { settling_us, oversampling: self.readout.oversampling.unwrap_or(1) }.clamped()
    }

    pub(super) fn sensor_rows(&self) -> usize {
        self.sensor_rows
    }

    pub(super) fn readout(&self) -> &Readout {
        &self.readout
    }

    /// Sets a pin.
    ///
    /// # Errors
    /// [`Violation`], which is recorded as well; the pin is set nevertheless.
    pub fn set_pin(&self, pin: Pin, high: bool) -> Result<(), Violation> {
        self.board.borrow_mut().set_pin(pin, high)
    }

    /// Makes one SPI transfer with MCP3208 number `chip`: `bytes` go out and are replaced by the answer.
    ///
    /// # Errors
    /// [`Violation`], which is recorded as well; `bytes` then hold no answer.
    pub fn transfer(&self, chip: usize, bytes: &mut [u8]) -> Result<(), Violation> {
        self.board.borrow_mut().transfer(chip, bytes)
    }

    /// Lets time pass on the board's clock.
    pub fn wait_ns(&self, ns: u32) {
        let board = &mut *self.board.borrow_mut();
        board.transactions.waits += 1;
        board.now_ns += u64::from(ns);
    }

    /// Starts a conversion of the column that the multiplexers select.
    pub fn start_conversion(&self) -> Result<(), Violation> {
        self.board.borrow_mut().start_conversion()
    }

    /// Counts of the conversion, or `None` while it is not ready.
    pub fn poll_conversion(&self) -> Result<Option<u16>, Violation> {
        self.board.borrow_mut().poll_conversion()
    }

    /// Requests that the real parts would not have accepted, in order.
    pub fn violations(&self) -> Vec<Violation> {
        self.board.borrow().violations.clone()
    }

    /// Checks that there were no violations.
    pub fn check(&self) -> Result<(), Error> {
        let board = self.board.borrow();
        board.violations.first().map_or(Ok(()), |first| {
            let times = board.violations.len();
            Err(Error::failed(format!("the virtual board refused {times} times, first: {first}")))
        })
    }

    /// Number of uses of each kind of part so far.
    pub fn transactions(&self) -> Transactions {
        self.board.borrow().transactions
    }

    /// Time on the board's clock.
    pub fn elapsed_ns(&self) -> u64 {
        self.board.borrow().now_ns
    }

    /// Row (from 0) that is active, if any.
    pub fn active_row(&self) -> Option<usize> {
        self.board.borrow().rows.active()
    }
}

fn noise_of_frame(seed: u64, frame: u64) -> Random {
    Random::new(seed, Stream::Test, Purpose::AdcNoise, frame, 0)
}

impl Board {
    fn refuse<T>(&mut self, message: String) -> Result<T, Violation> {
        self.violations.push(Violation(message.clone()));
        Err(Violation(message))
    }

    fn set_pin(&mut self, pin: Pin, high: bool) -> Result<(), Violation> {
        self.transactions.pins_set += 1;
        let active = self.rows.active();
        let now_v = self.voltages();
        let of_columns = |columns: &mut ColumnSelector| columns.set(pin, high);
        let outcome =
            self.rows.set(pin, high).or_else(|| self.columns.as_mut().and_then(of_columns));
        if self.rows.active() != active {
            (self.before_v, self.changed_ns) = (now_v, Some(self.now_ns));
        }
        match outcome {
            None => self.refuse(format!("{pin:?} was set; this board has no such pin")),
            Some(Err(message)) => self.refuse(message),
            Some(Ok(())) => Ok(()),
        }
    }

    fn transfer(&mut self, chip: usize, bytes: &mut [u8]) -> Result<(), Violation> {
        self.transactions.transfers += 1;
        if self.columns.is_some() {
            return self.refuse("an MCP3208 was asked; this board has none".into());
        }
        let column = match mcp3208_column(chip, bytes) {
            Ok(column) => column,
            Err(message) => return self.refuse(message),
        };
        // The input is sampled as the second byte begins, when the channel is known.
        let byte_ns = u64::from(timing::spi_transfer_ns(1, SPI_CLOCK_HZ));
        self.now_ns += byte_ns;
        let counts = self.sample(column);
        self.now_ns += 2 * byte_ns;
        bytes.copy_from_slice(&mcp3208_answer(counts?));
        Ok(())
    }

    fn start_conversion(&mut self) -> Result<(), Violation> {
        self.transactions.conversions += 1;
        let column = match &self.columns {
            Some(columns) => columns.column(),
            None => Err("the converter on the microcontroller was asked; none is wired".into()),
        };
        match column {
            Ok(column) => {
                let counts = self.sample(column)?;
                if let Some(columns) = &mut self.columns {
                    columns.conversion = Some((counts, POLLS));
                }
                Ok(())
            }
            Err(message) => self.refuse(message),
        }
    }

    fn poll_conversion(&mut self) -> Result<Option<u16>, Violation> {
        self.now_ns += POLL_NS;
        let Some((counts, polls)) = self.columns.as_ref().and_then(|columns| columns.conversion)
        else {
            return self.refuse("a conversion was asked for that nobody had started".into());
        };
        if let Some(columns) = &mut self.columns {
            columns.conversion = polls.checked_sub(1).map(|polls| (counts, polls));
        }
        Ok((polls == 0).then_some(counts))
    }

    fn needed_settling_us(&self) -> u32 {
        timing::settling_us((self.time_constant_us * 1e3) as f32, self.adc_bits)
    }

    /// Voltages in V of all outputs now.
    fn voltages(&mut self) -> [f64; COLUMNS] {
        let mut voltages = self.analogue.outputs_v(self.rows.active());
        if let Some(changed_ns) = self.changed_ns.filter(|_| self.time_constant_us > 0.0) {
            let elapsed_us = (self.now_ns - changed_ns) as f64 * 1e-3;
            let left = libm::exp(-elapsed_us / self.time_constant_us);
            let pairs = voltages.iter_mut().zip(&self.before_v);
            pairs.for_each(|(volt, before)| *volt += (before - *volt) * left);
        }
        voltages
    }

    /// Counts of one column now.
    fn sample(&mut self, column: usize) -> Result<u16, Violation> {
        let needed_us = self.needed_settling_us();
        if let Some(elapsed_ns) = self.changed_ns.map(|changed_ns| self.now_ns - changed_ns)
            && elapsed_ns < u64::from(needed_us) * 1000
        {
            return self.refuse(format!(
                "column {column} (from 0) was sampled {elapsed_ns} ns after the rows changed; \
                 settling takes {needed_us} µs"
            ));
        }
        let full = f64::from(1_u32 << CONVERTER_BITS);
        if let Some(is_high) = self.analogue.faults().iter().find_map(|it| it.stuck_high(column)) {
            return Ok(if is_high { (full - 1.0) as u16 } else { 0 });
        }
        let volt = self.voltages()[column];
        let mut counts = volt / reference_v() * full;
        if self.adc_noise_counts > 0.0 {
            counts += self.adc_noise_counts * self.noise.normal();
        }
        // Transitions lie half a step off the steps; at full scale a converter gives all ones.
        let step = f64::from(1_u32 << (CONVERTER_BITS - self.adc_bits));
        let counts = (counts / step).round() * step;
        Ok(if counts > full - step { full - 1.0 } else { counts.max(0.0) } as u16)
    }
}
