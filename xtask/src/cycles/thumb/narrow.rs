//! Instructions of one halfword: A5.2.

use super::{Class, Instruction, SP, bit, bits};

/// Decodes an instruction of one halfword; `None` if the encoding is unknown.
pub fn decode(h: u16) -> Option<Instruction> {
    let data = Instruction::data();
    let load = Instruction::load();
    let store = Instruction::new(Class::Store);
    let (low, second, high) = (bits(h, 0, 3), bits(h, 3, 3), bits(h, 8, 3));
    Some(match h >> 11 {
        // Shifts, additions and subtractions of registers and small constants.
        0b00000..=0b00011 => data.to(low),
        // MOV, ADD, SUB of a constant; ADR, ADD of the stack pointer and a constant.
        0b00100 | 0b00110 | 0b00111 | 0b10100 | 0b10101 => data.to(high),
        // CMP with a constant.
        0b00101 => data,
        0b01000 if !bit(h, 10) => match bits(h, 6, 4) {
            // TST, CMP, CMN.
            8 | 10 | 11 => data,
            _ => data.to(low),
        },
        0b01000 => high_registers(h)?,
        // LDR from a place beside the code.
        0b01001 => load.to(high).beside_code(bits(h, 0, 8), 4, true),
        0b01010 | 0b01011 => {
            let access = if bits(h, 9, 3) < 3 {
                Instruction::new(Class::StoreIndexed)
            } else {
                load.to(low)
            };
            access.at(second).at(bits(h, 6, 3))
        }
        0b01100 | 0b01110 | 0b10000 => store.at(second),
        0b01101 | 0b01111 | 0b10001 => load.to(low).at(second),
        0b10010 => store.at(SP),
        0b10011 => load.to(high).at(SP),
        0b10110 | 0b10111 => miscellaneous(h)?,
        0b11000 | 0b11001 => Instruction::multiple(bits(h, 0, 8))?.at(high),
        0b11010 | 0b11011 => match bits(h, 8, 4) {
            // UDF, SVC.
            14 | 15 => Instruction::new(Class::Unpriced),
            _ => Instruction::new(Class::Branch),
        },
        0b11100 => Instruction::new(Class::Branch),
        _ => return None,
    })
}

/// Decodes ADD, CMP, MOV of any registers, BX, BLX: A5.2.3.
fn high_registers(h: u16) -> Option<Instruction> {
    let destination = bits(h, 0, 3) | (bits(h, 7, 1) << 3);
    match bits(h, 8, 2) {
        1 => Some(Instruction::data()),
        3 if bits(h, 0, 3) != 0 => None,
        3 if bit(h, 7) => Some(Instruction::call()),
        3 => Some(Instruction::new(Class::Branch)),
        _ => Some(Instruction::data().to(destination)),
    }
}

/// Decodes miscellaneous instructions: A5.2.5.
fn miscellaneous(h: u16) -> Option<Instruction> {
    let data = Instruction::data();
    match bits(h, 8, 4) {
        0b0000 => Some(data.to(SP)),
        // CBZ, CBNZ.
        0b0001 | 0b0011 | 0b1001 | 0b1011 => Some(Instruction::new(Class::Branch)),
        // SXTH, SXTB, UXTH, UXTB.
        0b0010 => Some(data.to(bits(h, 0, 3))),
        // PUSH.
        0b0100 | 0b0101 => Some(Instruction::multiple(bits(h, 0, 9))?.at(SP)),
        // CPS.
        0b0110 => (h & 0xFFE8 == 0xB660).then(|| Instruction::new(Class::Special)),
        // REV, REV16, REVSH.
        0b1010 => (bits(h, 6, 2) != 2).then(|| data.to(bits(h, 0, 3))),
        // POP; its ninth register is the program counter.
        0b1100 | 0b1101 => Some(Instruction::multiple(bits(h, 0, 9))?.at(SP).branching(bit(h, 8))),
        // BKPT.
        0b1110 => Some(Instruction::new(Class::Unpriced)),
        0b1111 if bits(h, 0, 4) != 0 => Some(Instruction::new(Class::IfThen)),
        0b1111 => match bits(h, 4, 4) {
            // NOP, YIELD, SEV.
            0 | 1 | 4 => Some(data),
            // WFE, WFI.
            2 | 3 => Some(Instruction::new(Class::Unpriced)),
            _ => None,
        },
        _ => None,
    }
}
