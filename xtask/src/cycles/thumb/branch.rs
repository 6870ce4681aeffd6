//! Branches and control of two halfwords: A5.3.4.

use super::{Class, Instruction, bit, bits};

/// Decodes a branch or control instruction; `None` if the encoding is unknown.
pub fn decode(first: u16, second: u16) -> Option<Instruction> {
    let branch = Some(Instruction::new(Class::Branch));
    match (bit(second, 14), bit(second, 12)) {
        (false, true) => branch,
        // BL.
        (true, true) => Some(Instruction::call()),
        // BLX to a constant, which this processor does not have.
        (true, false) => None,
        // B with a condition.
        (false, false) if bits(first, 7, 3) != 7 => branch,
        (false, false) => control(first, second),
    }
}

/// Decodes miscellaneous control: A5.3.5, with the bits that must be as given.
fn control(first: u16, second: u16) -> Option<Instruction> {
    let (operation, rest) = (bits(second, 0, 8), second & 0xFF00);
    match (first, rest) {
        (0xF3AF, 0x8000) => match operation {
            // NOP, YIELD, SEV.
            0 | 1 | 4 => Some(Instruction::data()),
            // WFE, WFI.
            2 | 3 => Some(Instruction::new(Class::Unpriced)),
            _ => None,
        },
        (0xF3BF, 0x8F00) => match operation >> 4 {
            // CLREX.
            2 if operation == 0x2F => Some(Instruction::data()),
            4..=6 => Some(Instruction::new(Class::Barrier)),
            _ => None,
        },
        // MRS, MSR.
        (0xF3EF, 0x8000..=0x8EFF) => Some(Instruction::new(Class::Special).to(bits(second, 8, 4))),
        (0xF380..=0xF38E, 0x8000..=0x8CFF) => Some(Instruction::new(Class::Special)),
        // UDF.
        (0xF7F0..=0xF7FF, 0xA000..=0xAFFF) => Some(Instruction::new(Class::Unpriced)),
        _ => None,
    }
}
