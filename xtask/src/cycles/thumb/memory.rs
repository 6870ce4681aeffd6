//! Loads and stores of two halfwords: A5.3.5 to A5.3.10.

use super::{Class, Instruction, PC, bit, bits};

/// Decodes LDM, STM, and PUSH and POP with high registers: A5.3.5.
pub fn multiple(first: u16, second: u16) -> Option<Instruction> {
    // Increment after, decrement before; the others are for other processors.
    let known = matches!(bits(first, 7, 2), 1 | 2) && bits(first, 0, 4) != PC;
    let loads = bit(first, 4);
    // Storing the program counter is unpredictable, and so is the stack pointer in either.
    let known = known && !bit(second, 13) && (loads || !bit(second, 15));
    let instruction = Instruction::multiple(second).filter(|_| known)?;
    Some(instruction.at(bits(first, 0, 4)).branching(loads && bit(second, PC.into())))
}

/// Decodes LDRD, STRD, LDREX, STREX and their variants, TBB, TBH: A5.3.6.
pub fn double_or_exclusive(first: u16, second: u16) -> Option<Instruction> {
    let base = bits(first, 0, 4);
    if bit(first, 8) || bit(first, 5) {
        let access = Instruction::new(Class::Double).at(base);
        let is_literal = bit(first, 4) && base == PC;
        let beside_code = || access.beside_code(bits(second, 0, 8), 4, bit(first, 7));
        return Some(if is_literal { beside_code() } else { access });
    }
    let exclusive = Some(Instruction::new(Class::Exclusive).at(base));
    match bits(first, 4, 4) {
        // STREX, LDREX.
        4 if bits(second, 12, 4) != PC => exclusive,
        5 if bits(second, 8, 4) == 0xF => exclusive,
        // STREXB, STREXH; LDREXB, LDREXH.
        12 if matches!(second & 0xFF0, 0xF40 | 0xF50) => exclusive,
        13 if matches!(second & 0xFFF, 0xF4F | 0xF5F) => exclusive,
        13 if second & 0xFFE0 == 0xF000 => {
            Some(Instruction::new(Class::TableBranch).at(base).at(bits(second, 0, 4)))
        }
        _ => None,
    }
}

/// Decodes a load or store of one register of any width: A5.3.7 to A5.3.10.
pub fn single(first: u16, second: u16) -> Option<Instruction> {
    let (loads, signed, size) = (bit(first, 4), bit(first, 8), bits(first, 5, 2));
    let (base, register) = (bits(first, 0, 4), bits(second, 12, 4));
    // A word has no sign to extend, and a store none either; nothing is larger than a word.
    if size == 3 || (signed && (!loads || size == 2)) || (!loads && base == PC) {
        return None;
    }
    // A load of bytes to the program counter is a hint to the memory.
    let hint = loads && register == PC && size < 2;
    let (writes_base, index) = offset(first, second)?;
    let access = match (loads, writes_base || index.is_some()) {
        (true, _) if hint => Instruction::data(),
        (true, _) if base == PC => {
            Instruction::load().to(register).beside_code(bits(second, 0, 12), 1, bit(first, 7))
        }
        (true, _) => Instruction::new(Class::Load { writes_base }).to(register),
        (false, false) => Instruction::new(Class::Store),
        (false, true) => Instruction::new(Class::StoreIndexed),
    };
    Some(index.into_iter().fold(access.at(base), Instruction::at))
}

/// Whether the base is changed, and the register that is added to it, if any.
fn offset(first: u16, second: u16) -> Option<(bool, Option<u16>)> {
    let (before, changes) = (bit(second, 10), bit(second, 8));
    // Twelve bits of constant, or a place beside the code.
    if bit(first, 7) || bits(first, 0, 4) == PC {
        Some((false, None))
    } else if bit(second, 11) {
        (before || changes).then_some((changes, None))
    } else {
        (bits(second, 6, 5) == 0).then_some((false, Some(bits(second, 0, 4))))
    }
}
