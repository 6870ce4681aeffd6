//! The program on the board: the application with the board's parts.

use board_common::region::take_weights;
use board_common::{BoardApp, CAPACITY, buffers};
use cortex_m_rt::entry;
use defmt::{info, warn};
use defmt_rtt as _;
use firmware::circuit::ZeroPotential;
use firmware::link::message::{Configuration, Memory};
use firmware::platform::{Platform, Port};
use firmware::readout::{Mcp3208s, Scanner, ShiftRegister595};
use firmware::store::Journal;
use nucleo_f446re::{Board, Clock, Oscillator, Serial, Slot, memory, restart};
use stm32f4xx_hal::gpio::{ErasedPin, Output};
use stm32f4xx_hal::signature::Uid;
use stm32f4xx_hal::watchdog::IndependentWatchdog;

/// Constants of the circuit, until others are kept: `host-sim link PORT calibrate` measures your own.
const CIRCUIT: ZeroPotential<{ CAPACITY.rows }, { CAPACITY.columns }> = ZeroPotential::TYPICAL;

type BoardScanner<D, S, T, C> = Scanner<D, S, T, C, { CAPACITY.rows }, { CAPACITY.columns }>;

struct Nucleo {
    serial: Serial,
    clock: Clock,
    watchdog: IndependentWatchdog,
    led: ErasedPin<Output>,
    journal: Journal<Slot>,
    is_button_held: bool,
}

impl Port for Nucleo {
    fn now_us(&mut self) -> u32 {
        self.clock.now_us()
    }

    fn receive(&mut self) -> Option<u8> {
        self.serial.try_read()
    }

    fn send(&mut self, byte: u8) -> bool {
        self.serial.try_write(byte)
    }
}

impl Platform for Nucleo {
    type Page = Slot;

    const BOARD: &'static str = "nucleo-f446re";

    /// Feeds the watchdog, and blinks the light about once a second.
    fn feed_watchdog(&mut self) {
        self.watchdog.feed();
        let on = self.clock.now_us() >> 19 & 1 == 0;
        self.led.set_state(on.into());
    }

    fn memory(&self) -> Memory {
        memory::taken()
    }

    fn cycles(&self) -> u32 {
        self.clock.cycles()
    }

    fn journal(&mut self) -> &mut Journal<Slot> {
        &mut self.journal
    }

    fn unique_id(&self) -> [u8; 12] {
        let id = Uid::get();
        let [x, y] = [id.x(), id.y()].map(u16::to_le_bytes);
        let parts: [&[u8]; 4] = [&x, &y, &[id.waf_num()], id.lot_num().as_bytes()];
        let mut bytes = [0; 12];
        bytes
            .iter_mut()
            .zip(parts.iter().copied().flatten())
            .for_each(|(place, byte)| *place = *byte);
        bytes
    }

    fn may_provision(&self) -> bool {
        self.is_button_held
    }
}

#[entry]
fn main() -> ! {
    let Some(board) = Board::take() else { restart() };
    info!(
        "taxel {=str} on a NUCLEO-F446RE, started by: {}",
        env!("CARGO_PKG_VERSION"),
        board.reset_cause
    );
    if board.oscillator == Oscillator::Internal {
        warn!(
            "no 8 MHz from the ST-LINK: running from the internal oscillator, 1 % off at 25 °C, up to 4 % elsewhere"
        );
    }
    let drive = ShiftRegister595::<_, { CAPACITY.rows }> {
        data: board.row_data,
        clock: board.row_clock,
        latch: board.row_latch,
    };
    let sampler = Mcp3208s { chips: board.converters };
    let scanner = BoardScanner::new(drive, sampler, board.delay, CIRCUIT);
    let nucleo = Nucleo {
        serial: board.serial,
        clock: board.clock,
        watchdog: board.watchdog,
        led: board.led,
        journal: Journal::new(board.pages),
        is_button_held: board.is_button_held,
    };
    let Some(buffers) = buffers() else { restart() };
    let mut app = BoardApp::<_, _>::new(nucleo, scanner, Configuration::DEFAULT, buffers);
    let mut slots = board.slots;
    // SAFETY: the memory is taken here only.
    app.run(&mut slots, unsafe { take_weights() });
    info!("restarting");
    while !app.platform().serial.has_sent_all() {}
    restart()
}
