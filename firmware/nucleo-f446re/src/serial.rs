//! USART2, which the ST-LINK passes on to the computer.
//!
//! DMA puts each received byte into a ring, also while flash is erased or written and the processor stands still. It sends a
//! piece at a time: an interrupt at the end takes the next one from a queue. So a report is sent while the next frame is
//! decoded, which may take milliseconds.

use core::sync::atomic::{AtomicU8, AtomicUsize, Ordering, fence};

use cortex_m::peripheral::NVIC;
use stm32f4xx_hal::gpio::{PA2, PA3};
use stm32f4xx_hal::pac::{DMA1, Interrupt, USART2, interrupt};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{Enable, Rcc};
use stm32f4xx_hal::serial::config::{Config, DmaConfig};

use crate::dma::{self, COUNT_UP, FROM_MEMORY};

/// Baud rate; 8 data bits, no parity, 1 stop bit. `TAXEL_BAUD=115200` in the environment of the build sets another.
pub const BAUD: u32 = match option_env!("TAXEL_BAUD") {
    None => taxel_firmware::timing::NUCLEO_BAUD,
    Some(text) => match u32::from_str_radix(text, 10) {
        Ok(baud) => baud,
        Err(_) => panic!("TAXEL_BAUD must be a number of bits a second, such as 115200"),
    },
};

/// Places of the rings of bytes that are received and to be sent, a power of two; one stays free. DMA does not wait while the ring is
/// full: what a host sends beyond, without an answer, takes the place of older bytes. The link's checksum detects that.
const ROOM: usize = 1024;

/// Streams of DMA1 for what is received and sent, and the field that chooses USART2's requests.
const RECEIVED: usize = 5;
const SENT: usize = 6;
const OF_USART_2: u32 = 4 << 25;

/// Fields of a stream's control register: an interrupt at the end; and from the end to the start again.
const INTERRUPT: u32 = 1 << 4;
const CIRCULAR: u32 = 1 << 8;

/// The ring of received bytes, which DMA writes.
static RING: [AtomicU8; ROOM] = [const { AtomicU8::new(0) }; ROOM];

/// The ring of bytes to send, which DMA reads; the place behind the last byte, which [`Serial`] moves on; and that of the first
/// one that DMA has not sent yet, which the interrupt moves on.
static TO_SEND: [AtomicU8; ROOM] = [const { AtomicU8::new(0) }; ROOM];
static QUEUED: AtomicUsize = AtomicUsize::new(0);
static SENT_UP_TO: AtomicUsize = AtomicUsize::new(0);

/// Most bytes that DMA sends at once: the room of a piece is free at its end.
const PIECE: usize = 128;

/// The registers of the port and of DMA.
fn registers() -> (USART2, DMA1) {
    // SAFETY: `Serial::start` took both. Afterwards only the interrupt writes them.
    unsafe { (USART2::steal(), DMA1::steal()) }
}

/// The serial line, in both directions. No function waits.
pub struct Serial {
    dma: DMA1,
    /// Place of the next byte to read.
    next: usize,
}

impl Serial {
    pub(crate) fn start(usart: USART2, dma: DMA1, pins: (PA2, PA3), rcc: &mut Rcc) -> Option<Self> {
        let config = Config::default().baudrate(BAUD.bps()).dma(DmaConfig::TxRx);
        usart.serial::<u8>(pins, config, rcc).ok()?;
        DMA1::enable(rcc);
        let fields = OF_USART_2 | COUNT_UP | CIRCULAR;
        // SAFETY: the ring is atomic, as others write it. No critical section depends on the interrupt's mask.
        unsafe {
            dma::start(dma.st(RECEIVED), &raw const RING, data(), ROOM, fields);
            NVIC::unmask(Interrupt::DMA1_STREAM6);
        }
        Some(Self { dma, next: 0 })
    }

    /// The next byte received, or `None` if there is none yet.
    pub fn try_read(&mut self) -> Option<u8> {
        let left = usize::from(self.dma.st(RECEIVED).ndtr().read().ndt().bits());
        if self.next == ROOM.wrapping_sub(left) % ROOM {
            return None;
        }
        fence(Ordering::SeqCst); // nothing is read before that
        let byte = RING.get(self.next)?.load(Ordering::Relaxed);
        self.next = (self.next + 1) % ROOM;
        Some(byte)
    }

    /// Queues bytes for sending, from the first on; returns how many there was room for.
    pub fn try_write(&mut self, bytes: &[u8]) -> usize {
        let mut queued = QUEUED.load(Ordering::Relaxed);
        let waiting = queued.wrapping_sub(SENT_UP_TO.load(Ordering::Acquire)) % ROOM;
        let bytes = bytes.get(..ROOM - 1 - waiting).unwrap_or(bytes);
        for byte in bytes {
            if let Some(place) = TO_SEND.get(queued) {
                place.store(*byte, Ordering::Relaxed);
            }
            queued = (queued + 1) % ROOM;
        }
        QUEUED.store(queued, Ordering::Release);
        if !is_sending() {
            NVIC::pend(Interrupt::DMA1_STREAM6);
        }
        bytes.len()
    }

    /// Whether all queued bytes have been sent, to the last bit.
    pub fn has_sent_all(&self) -> bool {
        let is_empty = SENT_UP_TO.load(Ordering::Relaxed) == QUEUED.load(Ordering::Relaxed);
        is_empty && !is_sending() && registers().0.sr().read().tc().bit()
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
    // Number of bytes of the piece that DMA sends, or has sent.
    static mut SENDING: usize = 0;
    if is_sending() {
        return;
    }
    let first = (SENT_UP_TO.load(Ordering::Relaxed) + *SENDING) % ROOM;
    SENT_UP_TO.store(first, Ordering::Release);
    let waiting = QUEUED.load(Ordering::Acquire).wrapping_sub(first) % ROOM;
    *SENDING = waiting.min(ROOM - first).min(PIECE);
    let (usart, dma) = registers();
    // SAFETY: writing ones clears the flags of DMA, and leaves those of the port: only "all sent" is cleared, which DMA does
    // not. Nobody writes to the piece before it counts as sent.
    unsafe {
        dma.hifcr().write(|w| w.bits(0x3D << 16));
        if let Some(place) = TO_SEND.get(first).filter(|_| *SENDING > 0) {
            usart.sr().write(|w| w.bits(!(1 << 6)));
            let fields = OF_USART_2 | FROM_MEMORY | COUNT_UP | INTERRUPT;
            dma::start(dma.st(SENT), place, data(), *SENDING, fields);
        }
    }
}
