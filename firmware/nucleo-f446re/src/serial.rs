//! USART2, which the ST-LINK passes on to the computer.
//!
//! An interrupt puts every received byte into a ring, and sends bytes from another ring: a report is sent while
//! the next frame is scanned. The processor stops while flash is erased or written. A byte that arrives then is
//! lost, so a host that uploads a model waits for the answer to each chunk.

use core::cell::UnsafeCell;

use cortex_m::interrupt::free;
use cortex_m::peripheral::NVIC;
use heapless::spsc::{Consumer, Producer, Queue};
use stm32f4xx_hal::gpio::{PA2, PA3};
use stm32f4xx_hal::pac::{Interrupt, USART2, interrupt};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::serial::config::Config;

/// Baud rate; 8 data bits, no parity, 1 stop bit. `TAXEL_BAUD=115200` in the environment of the build sets another.
pub const BAUD: u32 = match option_env!("TAXEL_BAUD") {
    None => taxel_firmware::timing::NUCLEO_BAUD,
    Some(text) => match u32::from_str_radix(text, 10) {
        Ok(baud) => baud,
        Err(_) => panic!("TAXEL_BAUD must be a number of bits a second, such as 115200"),
    },
};

/// Ring for 1 KiB: it holds one byte less than it has places.
type Ring = Queue<u8, 1025>;

/// The rings' other ends, which only the interrupt uses.
struct Ends {
    received: Producer<'static, u8>,
    to_send: Consumer<'static, u8>,
}

/// A place that is filled before the interrupt is enabled, and then belongs to it.
struct OfInterrupt(UnsafeCell<Option<Ends>>);

// SAFETY: `Serial::start` fills the place once, and from then on only the interrupt uses it, which does not interrupt
// itself.
unsafe impl Sync for OfInterrupt {}

static ENDS: OfInterrupt = OfInterrupt(UnsafeCell::new(None));

/// The port's registers.
fn registers() -> USART2 {
    // SAFETY: `Serial::start` took the port. Of what is written afterwards, the data belongs to the interrupt, and the
    // control register is written in the interrupt or while interrupts are off.
    unsafe { USART2::steal() }
}

/// The serial line, in both directions. No function waits.
pub struct Serial {
    received: Consumer<'static, u8>,
    to_send: Producer<'static, u8>,
}

impl Serial {
    pub(crate) fn start(usart: USART2, tx: PA2, rx: PA3, rcc: &mut Rcc) -> Option<Self> {
        let (received, to_read) = cortex_m::singleton!(: Ring = Ring::new())?.split();
        let (to_send, sending) = cortex_m::singleton!(: Ring = Ring::new())?.split();
        let config = Config::default().baudrate(BAUD.bps());
        usart.serial::<u8>((tx, rx), config, rcc).ok()?;
        // SAFETY: the singletons above exist once, so this is reached once, and the interrupt is still disabled.
        unsafe { *ENDS.0.get() = Some(Ends { received, to_send: sending }) };
        registers().cr1().modify(|_, w| w.rxneie().set_bit());
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
        free(|_| registers().cr1().modify(|_, w| w.txeie().set_bit()));
        taken
    }

    /// Whether all queued bytes have been sent, to the last bit.
    pub fn has_sent_all(&self) -> bool {
        self.to_send.is_empty() && registers().sr().read().tc().bit()
    }
}

/// Takes a received byte, and sends one if the one before has left. A byte without room is dropped: the link's checksum
/// detects that.
#[interrupt]
fn USART2() {
    // SAFETY: only this interrupt uses the place.
    let Some(ends) = (unsafe { &mut *ENDS.0.get() }) else { return };
    let usart = registers();
    let status = usart.sr().read();
    // An overrun may come without a byte. Reading the data ends it, else the interrupt would never rest.
    if status.rxne().bit() || status.ore().bit() {
        let byte = usart.dr().read().dr().bits() as u8;
        if status.rxne().bit() {
            let _ = ends.received.enqueue(byte);
        }
    }
    if status.txe().bit() {
        match ends.to_send.dequeue() {
            Some(byte) => _ = usart.dr().write(|w| w.dr().set(byte.into())),
            None => _ = usart.cr1().modify(|_, w| w.txeie().clear_bit()),
        }
    }
}
