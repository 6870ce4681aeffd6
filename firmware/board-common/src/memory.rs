//! How much memory is taken: by the program, as linked, and by its stack, as it ran.

use core::ptr::addr_of;

use cortex_m_rt::STACK_PAINT_VALUE;
use firmware::link::message::Memory;

unsafe extern "C" {
    static __vector_table: u32;
    static __stext: u32;
    static __etext: u32;
    static __srodata: u32;
    static __erodata: u32;
    static __sdata: u32;
    static __edata: u32;
    static __sbss: u32;
    static __ebss: u32;
    static __suninit: u32;
    static __euninit: u32;
    static _stack_start: u32;
    static _stack_end: u32;
}

/// Bytes from the first of two symbols of the linker to the second.
macro_rules! bytes {
    ($start:ident .. $end:ident) => {
        addr_of!($end).addr() - addr_of!($start).addr()
    };
}

/// The program's sections, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, defmt::Format)]
pub struct Sections {
    /// Exceptions and interrupts.
    pub vector_table: usize,
    /// Code.
    pub text: usize,
    /// Constants.
    pub rodata: usize,
    /// Variables that start with a value, which lies in flash as well.
    pub data: usize,
    /// Variables that start with zero.
    pub bss: usize,
    /// Variables that start with nothing.
    pub uninit: usize,
}

impl Sections {
    /// What the linker placed.
    #[must_use]
    pub fn linked() -> Self {
        Self {
            vector_table: bytes!(__vector_table..__stext),
            text: bytes!(__stext..__etext),
            rodata: bytes!(__srodata..__erodata),
            data: bytes!(__sdata..__edata),
            bss: bytes!(__sbss..__ebss),
            uninit: bytes!(__suninit..__euninit),
        }
    }

    /// Flash that they take.
    #[must_use]
    pub fn flash(&self) -> usize {
        self.vector_table + self.text + self.rodata + self.data
    }

    /// RAM that they take, the stack apart.
    #[must_use]
    pub fn ram(&self) -> usize {
        self.data + self.bss + self.uninit
    }
}

/// Bytes that there are for the stack.
#[must_use]
pub fn stack_bytes() -> usize {
    bytes!(_stack_end.._stack_start)
}

/// The most bytes of stack that were in use at any time since the start: all but those that are
/// still painted.
#[must_use]
pub fn stack_high_water_bytes() -> usize {
    let words = stack_bytes() / size_of::<u32>();
    let bottom = addr_of!(_stack_end);
    // SAFETY: all of it lies within the stack's region, which the start-up code painted.
    let painted =
        (0..words).take_while(|&i| unsafe { bottom.add(i).read_volatile() } == STACK_PAINT_VALUE);
    (words - painted.count()) * size_of::<u32>()
}

/// All this, as the link tells it.
#[must_use]
pub fn taken() -> Memory {
    let sections = Sections::linked();
    Memory {
        vector_table: sections.vector_table as u32,
        text: sections.text as u32,
        rodata: sections.rodata as u32,
        data: sections.data as u32,
        bss: sections.bss as u32,
        uninit: sections.uninit as u32,
        stack_reserved: stack_bytes() as u32,
        stack_high_water: stack_high_water_bytes() as u32,
    }
}
