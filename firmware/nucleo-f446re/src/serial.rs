//! USART2, which the ST-LINK hands on to the computer.
//!
//! An interrupt takes every byte into a ring as it comes. While flash is erased or written, the
//! processor stands still and takes none: whoever sends a model waits for the answer to each piece.

use core::cell::RefCell;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::NVIC;
use heapless::spsc::{Consumer, Producer, Queue};
use stm32f4xx_hal::gpio::{PA2, PA3};
use stm32f4xx_hal::nb;
use stm32f4xx_hal::pac::{Interrupt, USART2, interrupt};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::serial::config::Config;
use stm32f4xx_hal::serial::{Rx, RxListen, Tx};

/// 8 data bits, no parity, 1 stop bit.
pub const BAUD: u32 = 921_600;

const RING: usize = 1024;

/// What the interrupt has to itself once it has taken it.
static RECEIVER: Mutex<RefCell<Option<Receiver>>> = Mutex::new(RefCell::new(None));
static LOST: AtomicU32 = AtomicU32::new(0);

struct Receiver {
    port: Rx<USART2>,
    ring: Producer<'static, u8>,
}

/// Both directions. Nothing here waits.
pub struct Serial {
    port: Tx<USART2>,
    received: Consumer<'static, u8>,
}

impl Serial {
    pub(crate) fn start(usart: USART2, tx: PA2, rx: PA3, rcc: &mut Rcc) -> Option<Self> {
        let config = Config::default().baudrate(BAUD.bps());
        let (port, mut receiver) = usart.serial((tx, rx), config, rcc).ok()?.split();
        let ring = cortex_m::singleton!(: Queue<u8, RING> = Queue::new())?;
        let (producer, received) = ring.split();
        receiver.listen();
        free(|section| {
            let receiver = Receiver { port: receiver, ring: producer };
            RECEIVER.borrow(section).replace(Some(receiver));
        });
        // SAFETY: what the interrupt uses is in place, and no critical section hangs on its mask.
        unsafe { NVIC::unmask(Interrupt::USART2) };
        Some(Self { port, received })
    }

    /// The next byte received, or `None` if there is none yet.
    pub fn try_read(&mut self) -> Option<u8> {
        self.received.dequeue()
    }

    /// Sends `byte`; `false`, and nothing sent, while the one before is still under way.
    #[must_use]
    pub fn try_write(&mut self, byte: u8) -> bool {
        self.port.write(byte).is_ok()
    }

    /// How often bytes were lost since the start: the ring was full, the interrupt came too late, or
    /// the line was disturbed.
    #[must_use]
    pub fn lost(&self) -> u32 {
        LOST.load(Ordering::Relaxed)
    }
}

#[interrupt]
fn USART2() {
    free(|section| {
        let mut receiver = RECEIVER.borrow(section).borrow_mut();
        let Some(Receiver { port, ring }) = receiver.as_mut() else { return };
        let kept = match port.read() {
            Ok(byte) => ring.enqueue(byte).is_ok(),
            Err(nb::Error::WouldBlock) => true,
            Err(nb::Error::Other(_)) => false,
        };
        if !kept {
            LOST.store(LOST.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
        }
    });
}
