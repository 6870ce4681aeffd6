//! Streams of DMA between memory and registers (RM0390, chapter 9).

use core::sync::atomic::{Ordering, fence};

use stm32f4xx_hal::pac::dma2::ST;

/// Fields of a stream's control register: enabled; from memory; memory address counts up; and the highest priority.
const ENABLED: u32 = 1 << 0;
pub const FROM_MEMORY: u32 = 1 << 6;
pub const COUNT_UP: u32 = 1 << 10;
const FIRST: u32 = 3 << 16;

/// Starts a stream of so many `items` between memory and a register, with these fields.
///
/// # Safety
///
/// The addresses are of memory with room for the items, which nobody else uses until the stream has ended, and of a
/// register.
pub unsafe fn start<M>(stream: &ST, memory: *const M, register: usize, items: usize, fields: u32) {
    fence(Ordering::SeqCst); // what was written is there before DMA reads
    // SAFETY: as above.
    unsafe {
        stream.par().write(|w| w.bits(register as u32));
        stream.m0ar().write(|w| w.bits(memory.expose_provenance() as u32));
        stream.ndtr().write(|w| w.bits(items as u32));
        stream.cr().write(|w| w.bits(fields | FIRST));
        stream.cr().write(|w| w.bits(fields | FIRST | ENABLED));
    }
}
