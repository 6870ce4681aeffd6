//! USART2, which the ST-LINK passes on to the computer.
//!
//! An interrupt puts every received byte into a ring, and sends bytes from another ring: a report is sent while
//! the next frame is scanned. The processor stops while flash is erased or written. A byte that arrives then is
//! lost, so a host that uploads a model waits for the answer to each chunk.

use core::cell::RefCell;

use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::NVIC;
use heapless::spsc::{Consumer, Producer, Queue};
use stm32f4xx_hal::gpio::{PA2, PA3};
use stm32f4xx_hal::pac::{Interrupt, USART2, interrupt};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::serial::config::Config;
use stm32f4xx_hal::serial::{Rx, RxListen, Tx, TxISR, TxListen};

/// Baud rate; 8 data bits, no parity, 1 stop bit. `TAXEL_BAUD=115200` in the environment of the build sets another.
pub const BAUD: u32 = match option_env!("TAXEL_BAUD") {
    None => 921_600,
    Some(text) => match u32::from_str_radix(text, 10) {
        Ok(baud) => baud,
        Err(_) => panic!("TAXEL_BAUD must be a number of bits a second, such as 115200"),
    },
};

/// Ring for 1 KiB: it holds one byte less than it has places.
type Ring = Queue<u8, 1025>;

/// The parts that only the interrupt uses.
static WIRES: Mutex<RefCell<Option<Wires>>> = Mutex::new(RefCell::new(None));

struct Wires {
    rx: Rx<USART2>,
    received: Producer<'static, u8>,
    tx: Tx<USART2>,
    to_send: Consumer<'static, u8>,
}

impl Wires {
    /// Takes a received byte, if there is one. A damaged byte, or one without room, is dropped: the link's
    /// checksum detects that.
    fn receive(&mut self) {
        if let Ok(byte) = self.rx.read() {
            let _ = self.received.enqueue(byte);
        }
    }

    /// Sends a byte if the previous one has left; disables its interrupt when there are no more bytes.
    fn send(&mut self) {
        if !self.tx.is_tx_empty() {
            return;
        }
        match self.to_send.dequeue() {
            Some(byte) => {
                let _ = self.tx.write(byte);
            }
            None => self.tx.unlisten(),
        }
    }
}

/// The serial line, in both directions. No function waits.
pub struct Serial {
    received: Consumer<'static, u8>,
    to_send: Producer<'static, u8>,
}

impl Serial {
    pub(crate) fn start(usart: USART2, tx: PA2, rx: PA3, rcc: &mut Rcc) -> Option<Self> {
        let config = Config::default().baudrate(BAUD.bps());
        let (tx, mut rx) = usart.serial((tx, rx), config, rcc).ok()?.split();
        let (received, to_read) = cortex_m::singleton!(: Ring = Ring::new())?.split();
        let (to_send, sending) = cortex_m::singleton!(: Ring = Ring::new())?.split();
        rx.listen();
        let wires = Wires { rx, received, tx, to_send: sending };
        free(|section| WIRES.borrow(section).replace(Some(wires)));
        // SAFETY: the interrupt's parts are in place, and no critical section depends on its mask.
        unsafe { NVIC::unmask(Interrupt::USART2) };
        Some(Self { received: to_read, to_send })
    }

    /// The next byte received, or `None` if there is none yet.
    pub fn try_read(&mut self) -> Option<u8> {
        self.received.dequeue()
    }

    /// Queues `byte` for sending; returns `false`, and does nothing, while 1 KiB is waiting.
    #[must_use]
    pub fn try_write(&mut self, byte: u8) -> bool {
        let taken = self.to_send.enqueue(byte).is_ok();
        with_wires(|wires| wires.tx.listen());
        taken
    }

    /// Whether all queued bytes have been sent, to the last bit.
    pub fn has_sent_all(&self) -> bool {
        let mut all = self.to_send.is_empty();
        with_wires(|wires| all &= wires.tx.flush().is_ok());
        all
    }
}

fn with_wires(action: impl FnOnce(&mut Wires)) {
    free(|section| WIRES.borrow(section).borrow_mut().as_mut().map_or((), action));
}

#[interrupt]
fn USART2() {
    with_wires(|wires| {
        wires.receive();
        wires.send();
    });
}
