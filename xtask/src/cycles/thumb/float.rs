//! The single-precision floating-point extension: A5.3.18, A6.

use super::{Class, FpSet, Instruction, PC, bit, bits};

/// Whether an instruction works on double registers, not single ones; `None` if it is another coprocessor's.
fn is_double(second: u16) -> Option<bool> {
    match bits(second, 8, 4) {
        10 => Some(false),
        11 => Some(true),
        _ => None,
    }
}

/// Number of the single register, from its four upper bits and its lowest bit.
fn single(four: u16, lowest: u16) -> u32 {
    u32::from(four << 1 | lowest)
}

/// Set of `count` single registers from `first` on; `None` if there are fewer.
fn run(first: u32, count: u32) -> Option<FpSet> {
    let fits = count > 0 && first + count <= FpSet::BITS;
    fits.then(|| (FpSet::MAX >> (FpSet::BITS - count)) << first)
}

/// Decodes VLDR, VSTR, VLDM, VSTM, VPUSH, VPOP, and VMOV of two core registers: A6.5, A6.7.
pub fn memory(first: u16, second: u16) -> Option<Instruction> {
    let double = is_double(second)?;
    let (before, up, high, changes) = (bit(first, 8), bit(first, 7), bit(first, 6), bit(first, 5));
    let loads = bit(first, 4);
    if !before && !up {
        return (high && !changes).then(|| two_core_registers(first, second, double))?;
    }
    let one = before && !changes;
    if before && up && changes {
        return None;
    }
    let words = if one { 1 << u32::from(double) } else { bits(second, 0, 8).into() };
    // An odd number of words in double registers is an old form, which nobody should use.
    if double && words % 2 == 1 {
        return None;
    }
    let (four, one_more) = (bits(second, 12, 4), bits(first, 6, 1));
    // Sixteen double registers lie over the single ones.
    let start = match (double, one_more) {
        (false, lowest) => single(four, lowest),
        (true, 0) => single(four, 0),
        (true, _) => return None,
    };
    let registers = run(start, words)?;
    let base = bits(first, 0, 4);
    let access = Instruction::new(Class::FpMemory { words }).at(base);
    let is_literal = one && loads && base == PC;
    let beside_code = || access.beside_code(bits(second, 0, 8), 4, up);
    let access = if is_literal { beside_code() } else { access };
    Some(if loads { access.fp(registers, 0) } else { access.fp(0, registers) })
}

fn two_core_registers(first: u16, second: u16, double: bool) -> Option<Instruction> {
    if second & 0xD0 != 0x10 {
        return None;
    }
    let (four, one_more) = (bits(second, 0, 4), bits(second, 5, 1));
    let start = match (double, one_more) {
        (false, lowest) => single(four, lowest),
        (true, 0) => single(four, 0),
        (true, _) => return None,
    };
    let registers = run(start, 2)?;
    let transfer = Instruction::new(Class::FpTransfer { registers: 2 });
    Some(if bit(first, 4) {
        transfer.fp(0, registers).to(bits(second, 12, 4)).to(bits(first, 0, 4))
    } else {
        transfer.fp(registers, 0)
    })
}

/// Decodes data processing, and transfers of one core register: A6.4, A6.6.
pub fn register(first: u16, second: u16) -> Option<Instruction> {
    let double = is_double(second)?;
    match (bit(second, 4), double) {
        (true, _) => one_core_register(first, second, double),
        (false, false) => arithmetic(first, second),
        // Double precision, which this processor does not have.
        (false, true) => None,
    }
}

fn arithmetic(first: u16, second: u16) -> Option<Instruction> {
    let d = 1 << single(bits(second, 12, 4), bits(first, 6, 1));
    let n = 1 << single(bits(first, 0, 4), bits(second, 7, 1));
    let m = 1 << single(bits(second, 0, 4), bits(second, 5, 1));
    let variant = bit(second, 6);
    // Bit 2 of the operation is a bit of d.
    match bits(first, 4, 4) & 0b1011 {
        // VMLA, VMLS; VNMLA, VNMLS; VFNMA, VFNMS; VFMA, VFMS.
        0b0000 | 0b0001 | 0b1001 | 0b1010 => {
            Some(Instruction::new(Class::FpMultiplyAccumulate).fp(d, n | m))
        }
        // VMUL, VNMUL; VADD, VSUB.
        0b0010 | 0b0011 => Some(Instruction::new(Class::FpArithmetic).fp(d, n | m)),
        0b1000 if !variant => Some(Instruction::new(Class::FpDivide).fp(d, n | m)),
        // VMOV of a constant.
        0b1011 if !variant => {
            (second & 0xA0 == 0).then(|| Instruction::new(Class::FpMove).fp(d, 0))
        }
        // With zero, there is no m.
        0b1011 if bits(first, 0, 4) == 5 && second & 0x2F != 0 => None,
        0b1011 => one_operand(bits(first, 0, 4), bit(second, 7), d, m),
        _ => None,
    }
}

fn one_operand(operation: u16, variant: bool, d: FpSet, m: FpSet) -> Option<Instruction> {
    let (class, result, source) = match (operation, variant) {
        (0, false) => (Class::FpMove, d, m),
        (1, true) => (Class::FpDivide, d, m),
        // VCMP with a register and with zero.
        (4, _) => (Class::FpMove, 0, d | m),
        (5, _) => (Class::FpMove, 0, d),
        // VABS, VNEG; VCVT with half precision, and with integers.
        (0, true) | (1, false) | (2 | 3 | 8 | 12 | 13, _) => (Class::FpArithmetic, d, m),
        // VCVT with fixed point, in place.
        (10 | 11 | 14 | 15, _) => (Class::FpArithmetic, d, d),
        _ => return None,
    };
    Some(Instruction::new(class).fp(result, source))
}

fn one_core_register(first: u16, second: u16, double: bool) -> Option<Instruction> {
    let (to_core, operation) = (bit(first, 4), bits(first, 5, 3));
    let core = bits(second, 12, 4);
    let number = single(bits(first, 0, 4), bits(second, 7, 1));
    let one = Instruction::new(Class::FpTransfer { registers: 1 });
    let transfer = |register: FpSet| {
        Some(if to_core { one.fp(0, register).to(core) } else { one.fp(register, 0) })
    };
    // Bits that must be zero.
    let plain = second & 0x6F == 0;
    match (double, operation) {
        (false, 0) if plain => transfer(1 << number),
        // VMRS, VMSR; to "the program counter" go the flags alone.
        (false, 7) if plain && !bit(second, 7) && bits(first, 0, 4) == 1 => {
            let status = Instruction::new(Class::FpMove);
            Some(if to_core && core != PC { status.to(core) } else { status })
        }
        // VMOV with half of a double register.
        (true, 0 | 1) if plain && !bit(second, 7) => {
            transfer(1 << single(bits(first, 0, 4), operation))
        }
        _ => None,
    }
}
