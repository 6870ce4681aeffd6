//! Use of memory: by the program as linked, and by its stack so far.

use core::ptr;

use cortex_m_rt::STACK_PAINT_VALUE;
use taxel_firmware::link::message::Memory;

unsafe extern "C" {
    // Mutable, because what stands there changes.
    static mut __vector_table: u32;
    static mut _vector_table_end: u32;
    static mut __stext: u32;
    static mut __etext: u32;
    static mut __srodata: u32;
    static mut __erodata: u32;
    static mut __sdata: u32;
    static mut __edata: u32;
    static mut __sbss: u32;
    static mut __ebss: u32;
    static mut __suninit: u32;
    static mut __euninit: u32;
    static mut _stack_start: u32;
    static mut _stack_end: u32;
}

/// Number of bytes from one symbol of the linker to another.
macro_rules! bytes {
    ($start:ident .. $end:ident) => {
        (&raw const $end).addr() - (&raw const $start).addr()
    };
}

/// Sizes of the program's sections, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, defmt::Format)]
pub struct Sections {
    /// Table of exceptions and interrupts, in flash.
    pub vector_table: usize,
    /// Code, in flash.
    pub text: usize,
    /// Constants, in flash.
    pub rodata: usize,
    /// Variables with an initial value: in RAM, and their values in flash as well.
    pub data: usize,
    /// Variables that start as zero, in RAM.
    pub bss: usize,
    /// Variables that are not initialised, in RAM.
    pub uninit: usize,
}

impl Sections {
    /// Sizes of the sections as the linker placed them.
    pub fn linked() -> Self {
        Self {
            vector_table: bytes!(__vector_table.._vector_table_end),
            text: bytes!(__stext..__etext),
            rodata: bytes!(__srodata..__erodata),
            data: bytes!(__sdata..__edata),
            bss: bytes!(__sbss..__ebss),
            uninit: bytes!(__suninit..__euninit),
        }
    }

    /// Bytes of flash that the sections take.
    pub fn flash(&self) -> usize {
        self.vector_table + self.text + self.rodata + self.data
    }

    /// Bytes of RAM that the sections take, without the stack.
    pub fn ram(&self) -> usize {
        self.data + self.bss + self.uninit
    }
}

/// Bytes reserved for the stack.
pub fn stack_bytes() -> usize {
    bytes!(_stack_end.._stack_start)
}

/// Largest number of bytes of stack in use at any time since the start: all bytes except those that are
/// still painted.
pub fn stack_high_water_bytes() -> usize {
    let words = stack_bytes() / size_of::<u32>();
    // The symbol is a single word, and the stack is not: exposed, its address stands for all of it.
    let bottom = ptr::with_exposed_provenance::<u32>((&raw const _stack_end).expose_provenance());
    // SAFETY: every address lies within the stack's region, which the start-up code painted.
    let painted =
        (0..words).take_while(|&i| unsafe { bottom.add(i).read_volatile() } == STACK_PAINT_VALUE);
    (words - painted.count()) * size_of::<u32>()
}

/// Sizes of sections and stack, as the link reports them.
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
