//! Decodes Thumb instructions of ARMv7E-M with the single-precision VFPv4, as far as their cost
//! needs it: the ARMv7-M Architecture Reference Manual (ARM DDI 0403), chapters A5 and A6.
//!
//! An unknown encoding is rejected, never guessed.

mod branch;
mod data;
mod float;
mod memory;
mod narrow;

use std::ops::Range;

/// Set of core registers: bit n is Rn.
pub type CoreSet = u16;

/// Set of floating-point registers: bit n is Sn.
pub type FpSet = u32;

const SP: u16 = 13;
const PC: u16 = 15;

/// Class of an instruction, on which its cost mainly depends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// Integer data processing, multiplications of all kinds, hints.
    Data,
    /// Integer division: SDIV, UDIV.
    Divide,
    /// One register loaded, of any width.
    Load { writes_base: bool },
    /// One register stored to base and constant, the base unchanged.
    Store,
    /// One register stored to base and register, or with the base changed.
    StoreIndexed,
    /// Load or store of two registers: LDRD, STRD.
    Double,
    /// Load or store of several registers: LDM, STM, PUSH, POP.
    Multiple { registers: u32 },
    /// Exclusive load or store: LDREX, STREX and their variants.
    Exclusive,
    /// A branch to a constant or a register, taken or not.
    Branch,
    /// Branch by a table: TBB, TBH.
    TableBranch,
    /// Condition for the next instructions: IT.
    IfThen,
    /// Access to special registers: MRS, MSR, CPS.
    Special,
    /// Barrier: DMB, DSB, ISB.
    Barrier,
    /// Floating-point addition, multiplication, conversion, absolute value, negation.
    FpArithmetic,
    /// Multiplication and addition in one, fused or chained.
    FpMultiplyAccumulate,
    /// Floating-point division and square root: VDIV, VSQRT.
    FpDivide,
    /// Moves between floating-point registers, of constants to them, comparison, VMRS, VMSR.
    FpMove,
    /// Moves between core and floating-point registers.
    FpTransfer { registers: u32 },
    /// Loads and stores of floating-point registers: VLDR, VSTR, VLDM, VSTM, VPUSH, VPOP.
    FpMemory { words: u32 },
    /// Instructions that end or suspend a program: their cost does not depend on the processor alone.
    Unpriced,
}

/// Properties of one instruction, as far as its cost needs them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Instruction {
    /// Length in bytes: 2 or 4.
    pub bytes: u32,
    pub class: Class,
    /// Core registers that the instruction computes, or loads if it is a [`Class::Load`]. Registers that are
    /// changed as a side effect, such as a base, are left out.
    pub result: CoreSet,
    /// Core registers from which its address in memory is computed.
    pub address: CoreSet,
    /// Floating-point registers that the instruction writes.
    pub fp_result: FpSet,
    /// Floating-point registers that the instruction needs at once. The addend of a multiplication with addition
    /// is needed later, and is left out.
    pub fp_source: FpSet,
    /// Whether another instruction than the next one in memory may be executed next.
    pub may_branch: bool,
    /// Whether the instruction is a call: BL, BLX.
    pub calls: bool,
    /// Place of a load relative to the program counter, in bytes from [`Self::literal`]'s base.
    literal: Option<i32>,
}

impl Instruction {
    fn new(class: Class) -> Self {
        let may_branch = matches!(class, Class::Branch | Class::TableBranch);
        Self {
            bytes: 0,
            class,
            result: 0,
            address: 0,
            fp_result: 0,
            fp_source: 0,
            may_branch,
            calls: false,
            literal: None,
        }
    }

    /// Addresses from which the instruction at `address` loads relative to the program counter; empty if it does not.
    /// The base is the instruction's address + 4, rounded down to a word (A5.1.2).
    pub fn literal(&self, address: u32) -> Range<u32> {
        let Some(distance) = self.literal else { return 0..0 };
        let start = ((address.wrapping_add(4)) & !3).wrapping_add_signed(distance);
        let words = match self.class {
            Class::Double => 2,
            Class::FpMemory { words } => words,
            _ => 1,
        };
        start..start.wrapping_add(4 * words)
    }

    fn call() -> Self {
        Self { calls: true, ..Self::new(Class::Branch) }
    }

    fn data() -> Self {
        Self::new(Class::Data)
    }

    fn load() -> Self {
        Self::new(Class::Load { writes_base: false })
    }

    fn multiple(list: u16) -> Option<Self> {
        // An empty list is unpredictable.
        (list != 0).then(|| Self::new(Class::Multiple { registers: list.count_ones() }))
    }

    /// Adds core register `register` to the result.
    fn to(mut self, register: u16) -> Self {
        self.result |= 1 << register;
        self.may_branch |= register == PC;
        self
    }

    /// Adds `register` to those of the address. The program counter is left out, because it is always available.
    fn at(mut self, register: u16) -> Self {
        if register != PC {
            self.address |= 1 << register;
        }
        self
    }

    /// Adds that this loads from `units` of `unit` bytes behind the program counter, or before it unless `up`.
    fn beside_code(mut self, units: u16, unit: i32, up: bool) -> Self {
        let distance = i32::from(units) * unit;
        self.literal = Some(if up { distance } else { -distance });
        self
    }

    fn branching(mut self, may_branch: bool) -> Self {
        self.may_branch = may_branch;
        self
    }

    fn fp(mut self, result: FpSet, source: FpSet) -> Self {
        self.fp_result = result;
        self.fp_source = source;
        self
    }
}

/// Decodes the instruction that starts with the halfword `first`; `second` is the next halfword. `None` if the
/// encoding is unknown.
pub fn decode(first: u16, second: Option<u16>) -> Option<Instruction> {
    if is_wide(first) {
        let instruction = wide(first, second?)?;
        Some(Instruction { bytes: 4, ..instruction })
    } else {
        Some(Instruction { bytes: 2, ..narrow::decode(first)? })
    }
}

/// Whether an instruction that starts with the halfword `first` has two halfwords.
pub fn is_wide(first: u16) -> bool {
    first >= 0xE800
}

/// Decodes an instruction of two halfwords: A5.3, table A5-9.
fn wide(first: u16, second: u16) -> Option<Instruction> {
    match first >> 8 {
        0xE8 | 0xE9 if first & 0x40 == 0 => memory::multiple(first, second),
        0xE8 | 0xE9 => memory::double_or_exclusive(first, second),
        0xEA | 0xEB => data::shifted_register(first, second),
        0xEC | 0xED => float::memory(first, second),
        0xEE => float::register(first, second),
        0xF0..=0xF7 if second & 0x8000 != 0 => branch::decode(first, second),
        0xF0..=0xF7 if first & 0x200 == 0 => data::modified_constant(first, second),
        0xF0..=0xF7 => data::plain_constant(first, second),
        0xF8 | 0xF9 => memory::single(first, second),
        0xFA => data::register(first, second),
        0xFB if first & 0x80 == 0 => data::multiply(first, second),
        0xFB => data::long_multiply_or_divide(first, second),
        _ => None,
    }
}

/// The `count` bits of `halfword` from bit `lowest` on.
fn bits(halfword: u16, lowest: u32, count: u32) -> u16 {
    (halfword >> lowest) & ((1 << count) - 1)
}

/// Bit `index` of `halfword`.
fn bit(halfword: u16, index: u32) -> bool {
    bits(halfword, index, 1) == 1
}

#[cfg(test)]
mod tests;
