//! Cost of an instruction on a Cortex-M4 with floating point whose memory never waits.
//!
//! The source is the Cortex-M4 Technical Reference Manual (ARM DDI 0439D): tables 3-1, 3-2 and 7-1, section 3.3.2.
//! Where the manual gives a range, the larger number is taken. `docs/cycles.md` has this as a table, with its
//! sources. It was not checked on hardware.

use super::thumb::{Class, Instruction};

/// Cycles P to refill the pipeline after a branch: 1 to 3, depending on the alignment and width of the target,
/// and on how early its address is known.
const REFILL: u64 = 2;

/// Cycles of a load to the program counter: "at least five cycles" (3.3.2).
const LOAD_TO_PC: u64 = 5;

/// Cycles of TBB and TBH: "at least six cycles" (3.3.2).
const TABLE_BRANCH: u64 = 6;

/// Cycles of SDIV and UDIV: 2 to 12, depending on the operands.
const DIVIDE: u64 = 12;

/// Cycles of MRS, MSR and CPS: 1 or 2.
const SPECIAL: u64 = 2;

/// Cycles of VDIV and VSQRT; fewer if only integer instructions follow.
const FP_DIVIDE: u64 = 14;

/// Cycles of `instruction` when `previous` was executed directly before it.
///
/// `branched` says whether the next instruction executed is not the one behind it in memory. `None` if the
/// instruction has no cost of its own ([`Class::Unpriced`]).
pub fn cycles(
    instruction: &Instruction,
    previous: Option<&Instruction>,
    branched: bool,
) -> Option<u64> {
    let refill = if branched { REFILL } else { 0 };
    let behind_load = previous.is_some_and(|previous| pipelines(previous, instruction));
    let own = match instruction.class {
        Class::Load { .. } if branched => LOAD_TO_PC,
        Class::Load { .. } | Class::StoreIndexed => 2 - u64::from(behind_load),
        Class::Data | Class::Branch => 1 + refill,
        Class::Store | Class::IfThen | Class::FpArithmetic | Class::FpMove => 1,
        Class::Divide => DIVIDE,
        Class::Multiple { registers } => 1 + u64::from(registers) + refill,
        Class::Exclusive => 2,
        Class::TableBranch => TABLE_BRANCH,
        Class::Special => SPECIAL,
        Class::Barrier => 1 + REFILL,
        Class::Double | Class::FpMultiplyAccumulate => 3,
        Class::FpDivide => FP_DIVIDE,
        Class::FpTransfer { registers } => registers.into(),
        Class::FpMemory { words } => 1 + u64::from(words),
        Class::Unpriced => return None,
    };
    Some(own + previous.map_or(0, |previous| stall(previous, instruction)))
}

/// Whether the address phase of `instruction` overlaps the data phase of `previous`.
///
/// This needs a load, and then a load or store whose address does not depend on the loaded value. Neither may
/// change its base, and nothing pipelines behind a store.
fn pipelines(previous: &Instruction, instruction: &Instruction) -> bool {
    let plain = |class| class == Class::Load { writes_base: false };
    plain(previous.class)
        && (plain(instruction.class) || instruction.class == Class::StoreIndexed)
        && previous.result & instruction.address == 0
}

/// Cycles that `instruction` waits for the result of `previous`.
fn stall(previous: &Instruction, instruction: &Instruction) -> u64 {
    // For an address that data processing has just computed, "there is no forwarding path" (3.3.2).
    let address =
        !matches!(previous.class, Class::Load { .. }) && previous.result & instruction.address != 0;
    // Arithmetic takes "one cycle longer if [its] result is consumed by the following
    // instruction" (table 7-1).
    let computes = matches!(
        previous.class,
        Class::FpArithmetic | Class::FpMultiplyAccumulate | Class::FpDivide
    );
    let operand = computes && previous.fp_result & instruction.fp_source != 0;
    u64::from(address) + u64::from(operand)
}

#[cfg(test)]
mod tests;
