//! Integer data processing of two halfwords: A5.3.1, A5.3.3, A5.3.11 to A5.3.17.

use super::{Class, Instruction, PC, bit, bits};

/// Operation code of PKHBT and PKHTB, among the operations on shifted registers.
const PACK: u16 = 6;

/// Decodes data processing of a shifted register: A5.3.11.
pub fn shifted_register(first: u16, second: u16) -> Option<Instruction> {
    if bit(second, 15) {
        return None;
    }
    operation(first, second, bits(first, 5, 4) == PACK && !bit(first, 4) && !bit(second, 4))
}

/// Decodes data processing of a modified constant: A5.3.1.
pub fn modified_constant(first: u16, second: u16) -> Option<Instruction> {
    operation(first, second, false)
}

/// Decodes an operation of shifted registers or modified constants. Without a destination, some of them compare.
fn operation(first: u16, second: u16, also_known: bool) -> Option<Instruction> {
    let (operation, sets_flags) = (bits(first, 5, 4), bit(first, 4));
    let known = also_known || matches!(operation, 0..=4 | 8 | 10 | 11 | 13 | 14);
    let compares = sets_flags && matches!(operation, 0 | 4 | 8 | 13);
    match bits(second, 8, 4) {
        _ if !known => None,
        PC if compares => Some(Instruction::data()),
        PC => None,
        destination => Some(Instruction::data().to(destination)),
    }
}

/// Decodes data processing of a plain constant: A5.3.3.
pub fn plain_constant(first: u16, second: u16) -> Option<Instruction> {
    let known = match bits(first, 4, 5) {
        // ADD, ADR; MOVW; SUB, ADR; MOVT.
        0 | 4 | 10 | 12 => true,
        // Of the others, the constant has no twelfth bit. SSAT16 and USAT16, which are SSAT and USAT
        // shifted right by nothing.
        _ if bit(first, 10) => false,
        18 | 26 if second & 0x70C0 == 0 => second & 0x30 == 0,
        // SSAT; SBFX; BFI, BFC; USAT; UBFX.
        16 | 18 | 20 | 22 | 24 | 26 | 28 => !bit(second, 5),
        _ => false,
    };
    let destination = bits(second, 8, 4);
    (known && destination != PC).then(|| Instruction::data().to(destination))
}

/// Decodes data processing of registers: A5.3.12 to A5.3.15.
pub fn register(first: u16, second: u16) -> Option<Instruction> {
    let destination = bits(second, 8, 4);
    if bits(second, 12, 4) != 0xF || destination == PC {
        return None;
    }
    let (operation, variant) = (bits(first, 4, 4), bits(second, 4, 4));
    let known = match variant {
        // LSL, LSR, ASR, ROR by a register, and parallel additions and subtractions.
        0 => operation != 11 && operation != 15,
        1 | 2 | 4..=6 => matches!(operation, 8..=10 | 12..=14),
        // SXTAH to UXTAB, and their forms without an addend; QADD and its kin, REV and its kin; SEL,
        // CLZ.
        8 => operation <= 5 || matches!(operation, 8..=11),
        9..=11 => matches!(operation, 0..=5 | 8 | 9),
        _ => false,
    };
    known.then(|| Instruction::data().to(destination))
}

/// Decodes multiplications: A5.3.16.
pub fn multiply(first: u16, second: u16) -> Option<Instruction> {
    let (operation, variant) = (bits(first, 4, 3), bits(second, 4, 2));
    let known = match (operation, variant) {
        // MLA, MUL, MLS; SMLAxy, SMULxy; SMLAD, SMUAD, SMLAW, SMULW, SMLSD, SMUSD, SMMLA, SMMUL,
        // SMMLS; USAD8, USADA8.
        (0 | 2..=6, 0 | 1) | (1, _) | (7, 0) => true,
        _ => false,
    };
    let destination = bits(second, 8, 4);
    (known && bits(second, 6, 2) == 0 && destination != PC)
        .then(|| Instruction::data().to(destination))
}

/// Decodes long multiplications and divisions: A5.3.17.
pub fn long_multiply_or_divide(first: u16, second: u16) -> Option<Instruction> {
    let (low, high) = (bits(second, 12, 4), bits(second, 8, 4));
    match (bits(first, 4, 3), bits(second, 4, 4)) {
        // SDIV, UDIV.
        (1 | 3, 15) if high != PC && low == 0xF => Some(Instruction::new(Class::Divide).to(high)),
        // SMULL, UMULL, SMLAL; SMLALxy, SMLALD; SMLSLD; UMLAL, UMAAL.
        (0 | 2 | 4, 0) | (4, 8..=13) | (5, 12 | 13) | (6, 0 | 6) if low != PC && high != PC => {
            Some(Instruction::data().to(low).to(high))
        }
        _ => None,
    }
}
