//! The program on the board: the application with the board's parts.

use board_common::region::take_weights;
use board_common::{BoardApp, buffers, memory};
use defmt::{info, warn};
use defmt_rtt as _;
use stm32f4xx_hal::gpio::{ErasedPin, Output};
use stm32f4xx_hal::signature::Uid;
use stm32f4xx_hal::watchdog::IndependentWatchdog;
use taxel_firmware::link::message::{Configuration, Memory};
use taxel_firmware::platform::{Line, Platform, Storage, Watchdog};
use taxel_firmware::readout::FrameSource;
use taxel_firmware::store::Journal;

use crate::board::Board;
use crate::clock::Clock;
use crate::flash::set_brown_out_level;
use crate::oscillator::Oscillator;
use crate::own_converters::OwnConverters;
use crate::reset::restart;
use crate::serial::Serial;
use crate::slot::Slot;

struct Nucleo {
    serial: Serial,
    clock: Clock,
    watchdog: IndependentWatchdog,
    led: ErasedPin<Output>,
    events: [ErasedPin<Output>; 3],
    journal: Journal<Slot>,
}

impl taxel_firmware::platform::Clock for Nucleo {
    fn now_us(&mut self) -> u32 {
        self.clock.now_us()
    }

    fn cycles(&self) -> u32 {
        self.clock.cycles()
    }
}

impl Line for Nucleo {
    fn receive(&mut self) -> Option<u8> {
        self.serial.try_read()
    }

    fn send(&mut self, bytes: &[u8]) -> usize {
        self.serial.try_write(bytes)
    }
}

impl Storage for Nucleo {
    type Page = Slot;

    fn journal(&mut self) -> &mut Journal<Slot> {
        &mut self.journal
    }
}

impl Watchdog for Nucleo {
    /// Feeds the watchdog, and blinks the light about once a second.
    fn feed_watchdog(&mut self) {
        self.watchdog.feed();
        let on = self.clock.now_us() >> 19 & 1 == 0;
        self.led.set_state(on.into());
    }
}

impl Platform for Nucleo {
    const BOARD: &'static str = "nucleo-f446re";

    fn memory(&self) -> Memory {
        memory::taken()
    }

    fn set_brown_out(&mut self) -> bool {
        set_brown_out_level()
    }

    fn signal(&mut self, going_on: [bool; 3]) {
        self.events.iter_mut().zip(going_on).for_each(|(pin, on)| pin.set_state(on.into()));
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
}

/// Runs the application with the frames that `source` makes of the readout.
pub fn run<F: FrameSource>(source: impl FnOnce(OwnConverters) -> F) -> ! {
    let Some(board) = Board::take() else { restart() };
    info!(
        "taxel {=str} on a {=str}, started by: {}",
        env!("CARGO_PKG_VERSION"),
        Nucleo::BOARD,
        board.reset_cause
    );
    if board.oscillator == Oscillator::Internal {
        warn!(
            "no 8 MHz from the ST-LINK: running from the internal oscillator, 1 % off at 25 °C, up to 4 % elsewhere"
        );
    }
    let nucleo = Nucleo {
        serial: board.serial,
        clock: board.clock,
        watchdog: board.watchdog,
        led: board.led,
        events: board.events,
        journal: Journal::new(board.pages),
    };
    let Some(buffers) = buffers() else { restart() };
    let mut app =
        BoardApp::<_, _>::new(nucleo, source(board.readout), Configuration::DEFAULT, buffers);
    let mut slots = board.slots;
    // SAFETY: the memory is taken here only.
    app.run(&mut slots, unsafe { take_weights() });
    info!("restarting");
    while !app.platform().serial.has_sent_all() {}
    restart()
}
