//! USART2, which the ST-LINK passes on to the computer.
//!
//! DMA puts each received byte into a ring, also while flash is erased or written and the processor stands still. It sends a
//! piece at a time: an interrupt at the end takes the next one from a queue. So a report is sent while the next frame is
//! decoded, which may take milliseconds.

use core::cell::UnsafeCell;
use core::iter;
use core::sync::atomic::{AtomicU8, Ordering, fence};

use cortex_m::asm;
use cortex_m::peripheral::NVIC;
use heapless::Vec;
use heapless::spsc::{Consumer, Producer, Queue};
use stm32f4xx_hal::gpio::{PA2, PA3};
use stm32f4xx_hal::pac::{DMA1, Interrupt, USART2, interrupt};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::serial::config::{Config, DmaConfig};

use crate::dma::{COUNT_UP, FROM_MEMORY, start_stream};

/// Baud rate; 8 data bits, no parity, 1 stop bit. `TAXEL_BAUD=115200` in the environment of the build sets another.
pub const BAUD: u32 = match option_env!("TAXEL_BAUD") {
    None => taxel_firmware::timing::NUCLEO_BAUD,
    Some(text) => match u32::from_str_radix(text, 10) {
        Ok(baud) => baud,
        Err(_) => panic!("TAXEL_BAUD must be a number of bits a second, such as 115200"),
    },
};

/// Places of the ring of received bytes, and of the queue of those to send; one stays free. DMA does not wait while the ring is
/// full: what a host sends beyond, without an answer, takes the place of older bytes. The link's checksum detects that.
const ROOM: usize = 1024;

/// Most bytes that DMA sends between two interrupts.
const PIECE: usize = 128;

/// Streams of DMA1 for what is received and sent, and the field that chooses USART2's requests.
const RECEIVED: usize = 5;
const SENT: usize = 6;
const OF_USART_2: u32 = 4 << 25;

/// Fields of a stream's control register: an interrupt at the end; and from the end to the start again.
const INTERRUPT: u32 = 1 << 4;
const RING: u32 = 1 << 8;

/// The flags of the stream that sends.
const SENT_FLAGS: u32 = 0x3D << 16;

/// All of the port's status but "all sent", which DMA does not clear.
const BUT_COMPLETE: u16 = !(1 << 6);

/// Bytes to send: those that wait, and those that DMA sends.
struct Sending {
    waiting: Consumer<'static, u8>,
    piece: Vec<u8, PIECE>,
}

/// A place that is filled before the interrupt is enabled, and then belongs to it.
struct OfInterrupt(UnsafeCell<Option<Sending>>);

// SAFETY: `Serial::start` fills the place once, and from then on only the interrupt uses it, which does not interrupt
// itself.
unsafe impl Sync for OfInterrupt {}

static SENDING: OfInterrupt = OfInterrupt(UnsafeCell::new(None));

/// The registers of the port and of DMA.
fn registers() -> (USART2, DMA1) {
    // SAFETY: `Serial::start` took both. Afterwards only the interrupt writes them.
    unsafe { (USART2::steal(), DMA1::steal()) }
}

/// The serial line, in both directions. No function waits.
pub struct Serial {
    dma: DMA1,
    received: &'static [AtomicU8; ROOM],
    /// Place of the next byte to read.
    next: usize,
    to_send: Producer<'static, u8>,
}

impl Serial {
    pub(crate) fn start(usart: USART2, dma: DMA1, pins: (PA2, PA3), rcc: &mut Rcc) -> Option<Self> {
        let received =
            cortex_m::singleton!(: [AtomicU8; ROOM] = [const { AtomicU8::new(0) }; ROOM])?;
        let queue = cortex_m::singleton!(: Queue<u8, ROOM> = Queue::new())?;
        let (to_send, waiting) = queue.split();
        let config = Config::default().baudrate(BAUD.bps()).dma(DmaConfig::TxRx);
        usart.serial::<u8>(pins, config, rcc).ok()?;
        rcc.ahb1enr().modify(|_, w| w.dma1en().set_bit());
        asm::dsb(); // a write that follows at once may be lost (ES0298)
        let ring = received.as_ptr().expose_provenance();
        let fields = OF_USART_2 | COUNT_UP | RING;
        // SAFETY: the ring is static, and atomic as others write it. The singletons above exist once, so this is reached
        // once, and the interrupt is still disabled. No critical section depends on its mask.
        unsafe {
            start_stream(dma.st(RECEIVED), ring, data(), ROOM, fields);
            *SENDING.0.get() = Some(Sending { waiting, piece: Vec::new() });
            NVIC::unmask(Interrupt::DMA1_STREAM6);
        }
        Some(Self { dma, received, next: 0, to_send })
    }

    /// The next byte received, or `None` if there is none yet.
    pub fn try_read(&mut self) -> Option<u8> {
        let left = usize::from(self.dma.st(RECEIVED).ndtr().read().ndt().bits());
        if self.next == ROOM.wrapping_sub(left) % ROOM {
            return None;
        }
        fence(Ordering::SeqCst); // nothing is read before that
        let byte = self.received.get(self.next)?.load(Ordering::Relaxed);
        self.next = (self.next + 1) % ROOM;
        Some(byte)
    }

    /// Queues `byte` for sending; returns `false`, and does nothing, while the queue is full.
    #[must_use]
    pub fn try_write(&mut self, byte: u8) -> bool {
        let taken = self.to_send.enqueue(byte).is_ok();
        if !is_sending() {
            NVIC::pend(Interrupt::DMA1_STREAM6);
        }
        taken
    }

    /// Whether all queued bytes have been sent, to the last bit.
    pub fn has_sent_all(&self) -> bool {
        self.to_send.is_empty() && !is_sending() && registers().0.sr().read().tc().bit()
    }
}

/// Address of the port's register of data.
fn data() -> usize {
    registers().0.dr().as_ptr().expose_provenance()
}

/// Whether DMA is sending a piece.
fn is_sending() -> bool {
    registers().1.st(SENT).cr().read().en().bit()
}

/// Begins the next piece of what waits, if DMA has sent the one before.
#[interrupt]
fn DMA1_STREAM6() {
    // SAFETY: only this interrupt uses the place.
    let Some(Sending { waiting, piece }) = (unsafe { &mut *SENDING.0.get() }) else { return };
    if is_sending() {
        return;
    }
    piece.clear();
    for byte in iter::from_fn(|| waiting.dequeue()).take(PIECE) {
        let _ = piece.push(byte);
    }
    let (usart, dma) = registers();
    // SAFETY: writing ones clears DMA's flags and leaves the port's, and DMA has ended. The piece stays as it is until it has
    // ended again.
    unsafe {
        dma.hifcr().write(|w| w.bits(SENT_FLAGS));
        if !piece.is_empty() {
            usart.sr().write(|w| w.bits(BUT_COMPLETE));
            let from = piece.as_ptr().expose_provenance();
            let fields = OF_USART_2 | FROM_MEMORY | COUNT_UP | INTERRUPT;
            start_stream(dma.st(SENT), from, data(), piece.len(), fields);
        }
    }
}
