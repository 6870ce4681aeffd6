//! What runs on the board.

use cortex_m_rt::entry;
use defmt::{info, unwrap};
use defmt_rtt as _;
use nucleo_f446re::{Board, Clock, memory};
use panic_probe as _;

const BLINK_US: u64 = 500_000;

#[entry]
fn main() -> ! {
    let mut board = unwrap!(Board::take());
    info!("started, cause {}; {}", board.reset_cause, memory::Sections::linked());

    let mut toggle_at_us = board.clock.now_us();
    loop {
        board.watchdog.feed();
        if is_due(&mut board.clock, &mut toggle_at_us) {
            board.led.toggle();
        }
        if let Some(byte) = board.serial.try_read() {
            info!("received {=u8:#04x}", byte);
        }
    }
}

/// Whether the time has come; if so, sets the next.
fn is_due(clock: &mut Clock, at_us: &mut u64) -> bool {
    let due = clock.now_us() >= *at_us;
    if due {
        *at_us += BLINK_US;
    }
    due
}
