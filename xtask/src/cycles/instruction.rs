//! What instructions cost on a Cortex-M4 with floating point whose memory never waits, from their text as QEMU lists it.
//!
//! The source is the Cortex-M4 Technical Reference Manual (ARM DDI 0439D): tables 3-1, 3-2 and 7-1, section 3.3.2.
//! Where the manual gives a range, the larger number is taken. It was not checked on hardware. An unknown instruction is rejected, never guessed.

use std::ops::Range;

/// Cycles P to refill the pipeline after a branch: 1 to 3, depending on the alignment and width of the target,
/// and on how early its address is known.
const REFILL: u64 = 2;

/// Cycles of a load to the program counter: "at least five cycles" (3.3.2).
const LOAD_TO_PC: u64 = 5;

/// Data processing, multiplications and hints of one cycle that compute their first register, without conditions.
const DATA: &str = "adc add addw adr and asr bfc bfi bic clrex clz eor lsl lsr mla mls mov movt movw mul mvn nop orn orr \
                    pkhbt pkhtb pld qadd qdadd qdsub qsub rbit rev rev16 revsh ror rrx rsb sbc sbfx sel sev smlabb \
                    smlabt smlad smladx smlatb smlatt smlawb smlawt smlsd smlsdx smmla smmlar smmls smmlsr smmul \
                    smmulr smuad smuadx smulbb smulbt smultb smultt smulwb smulwt smusd smusdx ssat ssat16 sub subw \
                    sxtab sxtab16 sxtah sxtb sxtb16 sxth ubfx usad8 usada8 usat usat16 uxtab uxtab16 uxtah uxtb \
                    uxtb16 uxth yield";
/// Prefixes of instructions on bytes and halfwords in parallel: how they saturate, and what they compute.
const PARALLEL: [&str; 2] = ["s q sh u uq uh", "add16 asx sax sub16 add8 sub8"];
/// Multiplications that compute their first two registers.
const LONG: &str =
    "smull umull umaal umlal smlal smlalbb smlalbt smlaltb smlaltt smlald smlaldx smlsld smlsldx";
/// Floating-point arithmetic of one cycle, and multiplication with addition, fused or chained, of three.
const FP_ARITHMETIC: &str = "vadd vsub vmul vnmul vabs vneg vcvt vcvtr vcvtb vcvtt";
const FP_ACCUMULATE: &str = "vmla vmls vnmla vnmls vfma vfms vfnma vfnms";

const CONDITIONS: &str = "eq ne hs cs lo cc mi pl vs vc hi ls ge lt gt le";

/// Set of registers: bit n is Rn, bit 16 + n is Sn.
type Set = u64;

const CORE: Set = 0xFFFF;
const SP: Set = 1 << 13;
const PC: Set = 1 << 15;

/// What an instruction's cost depends on besides its own cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// One register loaded to base and offset, the base unchanged.
    Load,
    /// One register loaded, with the base changed.
    LoadChangingBase,
    /// One register stored to base and register, or with the base changed.
    StoreIndexed,
    /// Floating-point arithmetic, whose result comes a cycle late.
    FpArithmetic,
    Other,
}

/// Properties of one instruction, as far as its cost needs them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Instruction {
    /// Length in bytes: 2 or 4.
    pub bytes: u32,
    kind: Kind,
    /// Cycles without waiting and branching.
    cycles: u64,
    /// Registers that the instruction computes, or loads if it loads one. Registers that are changed as a side effect,
    /// such as a base, are left out.
    result: Set,
    /// Core registers from which its address in memory is computed.
    address: Set,
    /// Floating-point registers that the instruction needs at once. The addend of a multiplication with addition
    /// is needed later, and is left out.
    source: Set,
    /// Whether another instruction than the next one in memory may be executed next.
    pub may_branch: bool,
    /// Whether the instruction is a call: BL, BLX.
    pub calls: bool,
    /// Distance and bytes of what is loaded relative to the program counter.
    literal: Option<(i32, u32)>,
}

impl Instruction {
    /// Reads an instruction as it is listed: `e9dd 2302  ldrd r2, r3, [sp, #8]`. `None` if it is unknown, or stops the
    /// processor.
    pub fn read(listed: &str) -> Option<Self> {
        let first = u16::from_str_radix(listed.get(..4)?, 16).ok()?;
        let bytes = if first < 0xE800 { 2 } else { 4 };
        let text = listed.get(if bytes == 2 { 4 } else { 9 }..)?.trim();
        let (mnemonic, operands) = text.split_once([' ', '\t']).unwrap_or((text, ""));
        let name = mnemonic.split('.').next()?;
        // This processor has no double precision.
        if mnemonic.contains("f64") {
            return None;
        }
        let instruction = unconditional(name).find_map(|name| of_name(name, operands.trim()))?;
        Some(Self { bytes, ..instruction })
    }

    /// Cycles of this instruction when `previous` was executed directly before it. `branched` says whether the next
    /// instruction executed is not the one behind it in memory.
    pub fn cycles(&self, previous: Option<&Self>, branched: bool) -> u64 {
        let stalls = previous.map_or(0, |previous| self.stall_behind(previous));
        let is_load = matches!(self.kind, Kind::Load | Kind::LoadChangingBase);
        match self.kind {
            _ if branched && is_load => LOAD_TO_PC + stalls,
            _ if branched => self.cycles + REFILL + stalls,
            // The address phase overlaps the data phase of a load before it, unless that loads the address. Neither
            // may change its base, and nothing pipelines behind a store.
            Kind::Load | Kind::StoreIndexed
                if previous
                    .is_some_and(|it| it.kind == Kind::Load && it.result & self.address == 0) =>
            {
                self.cycles - 1
            }
            _ => self.cycles + stalls,
        }
    }

    /// Cycles that this waits for the result of `previous`.
    fn stall_behind(&self, previous: &Self) -> u64 {
        let is_load = matches!(previous.kind, Kind::Load | Kind::LoadChangingBase);
        // For an address that data processing has just computed, "there is no forwarding path" (3.3.2).
        let address = !is_load && previous.result & self.address != 0;
        // Arithmetic takes "one cycle longer if [its] result is consumed by the following instruction" (table 7-1).
        let operand = previous.kind == Kind::FpArithmetic && previous.result & self.source != 0;
        u64::from(address) + u64::from(operand)
    }

    /// Addresses from which the instruction at `address` loads relative to the program counter; empty if it does not.
    /// The base is the instruction's address + 4, rounded down to a word.
    pub fn literal(&self, address: u32) -> Range<u32> {
        let Some((distance, bytes)) = self.literal else { return 0..0 };
        let start = ((address.wrapping_add(4)) & !3).wrapping_add_signed(distance);
        start..start.wrapping_add(bytes)
    }
}

/// The instruction of this `name`, which is without condition; `bytes` are left 0.
fn of_name(name: &str, operands: &str) -> Option<Instruction> {
    let is = |names: &str| names.split(' ').any(|known| known == name);
    let all = set_of(operands);
    // What stands before memory or a list, in brackets, and behind it.
    let (before, inside) = operands.split_once(['[', '{']).unwrap_or((operands, ""));
    let (inside, behind) = inside.split_once([']', '}']).unwrap_or((inside, ""));
    let mut registers = before.split(',').map(set_of);
    let first = registers.next().unwrap_or(0);
    let second = registers.next().unwrap_or(0);
    let base = if inside.is_empty() { 0 } else { set_of(inside) & CORE & !PC };
    let of = |kind, cycles| Instruction {
        bytes: 0,
        kind,
        cycles,
        result: 0,
        address: 0,
        source: 0,
        may_branch: false,
        calls: false,
        literal: None,
    };
    let other = |cycles| of(Kind::Other, cycles);
    let literal = |words: u32| {
        let distance = inside.strip_prefix("pc, #").and_then(signed);
        distance.map(|distance| (distance, 4 * words))
    };
    let computes = |result: Set| Instruction {
        result,
        address: base,
        may_branch: result & PC != 0,
        ..other(1)
    };
    let in_parallel = |(saturating, computed): (&str, &str)| {
        PARALLEL[0].split(' ').any(|it| it == saturating)
            && PARALLEL[1].split(' ').any(|it| it == computed)
    };
    Some(match name {
        _ if is(DATA) => computes(first),
        _ if (1..name.len().min(3)).any(|at| in_parallel(name.split_at(at))) => computes(first),
        _ if is(LONG) => computes(first | second),
        "cmp" | "cmn" | "tst" | "teq" | "vmsr" => other(1),
        // By their operands, 2 to 12.
        "sdiv" | "udiv" => Instruction { cycles: 12, ..computes(first) },
        "b" | "bx" | "cbz" | "cbnz" => Instruction { may_branch: true, ..other(1) },
        "bl" | "blx" => Instruction { may_branch: true, calls: true, ..other(1) },
        // "At least six cycles" (3.3.2), with the refill.
        "tbb" | "tbh" => Instruction { may_branch: true, address: base, ..other(6 - REFILL) },
        "ldr" | "ldrb" | "ldrh" | "ldrsb" | "ldrsh" => {
            let kind = if behind.is_empty() { Kind::Load } else { Kind::LoadChangingBase };
            Instruction { kind, cycles: 2, literal: literal(1), ..computes(first) }
        }
        "str" | "strb" | "strh" => {
            let indexed = !behind.is_empty() || base.count_ones() > 1;
            let plain = if indexed { of(Kind::StoreIndexed, 2) } else { other(1) };
            Instruction { address: base, ..plain }
        }
        "ldrd" | "strd" => Instruction { address: base, literal: literal(2), ..other(3) },
        "ldrex" | "ldrexb" | "ldrexh" | "strex" | "strexb" | "strexh" => {
            Instruction { address: base, ..other(2) }
        }
        "push" | "pop" | "ldm" | "ldmia" | "ldmdb" | "stm" | "stmia" | "stmdb" => {
            let (list, at) = (set_of(inside), if first == 0 { SP } else { first });
            let may_branch = list & PC != 0;
            Instruction { address: at, may_branch, ..other(1 + u64::from(list.count_ones())) }
        }
        // 1 or 2.
        "mrs" => Instruction { cycles: 2, ..computes(first) },
        "msr" | "cpsid" | "cpsie" => other(2),
        "dmb" | "dsb" | "isb" => other(1 + REFILL),
        _ if name.starts_with("it") && name[2..].chars().all(|it| matches!(it, 't' | 'e')) => {
            other(1)
        }
        _ if is(FP_ARITHMETIC) || is(FP_ACCUMULATE) || is("vdiv vsqrt") => {
            let cycles = if is(FP_ARITHMETIC) {
                1
            } else if is(FP_ACCUMULATE) {
                3
            } else {
                14
            };
            let source = registers.fold(second, |all, register| all | register);
            Instruction { result: first, source, ..of(Kind::FpArithmetic, cycles) }
        }
        "vcmp" | "vcmpe" => Instruction { source: all, ..other(1) },
        "vmov" if all & CORE != 0 => {
            let cycles = u64::from((all & CORE).count_ones());
            if first & CORE == 0 {
                Instruction { result: all & !CORE, ..other(cycles) }
            } else {
                Instruction { result: all & CORE, source: all & !CORE, ..other(cycles) }
            }
        }
        "vmov" => Instruction { result: first, source: second, ..other(1) },
        "vmrs" => Instruction { result: first, ..other(1) },
        "vldr" | "vldmia" | "vpop" | "vstr" | "vstmia" | "vstmdb" | "vldmdb" | "vpush" => {
            let values = all & !CORE;
            let address = if all & CORE == 0 { SP } else { all & CORE & !PC };
            let words = values.count_ones();
            let loads = name.starts_with("vl") || name == "vpop";
            let [result, source] = if loads { [values, 0] } else { [0, values] };
            let literal = literal(words);
            Instruction { result, address, source, literal, ..other(1 + u64::from(words)) }
        }
        _ => return None,
    })
}

/// What the name of an instruction may be without its condition and the `s` that says that it sets flags.
fn unconditional(name: &str) -> impl Iterator<Item = &str> {
    let condition = CONDITIONS.split(' ').find_map(|condition| name.strip_suffix(condition));
    let sets_flags =
        [condition, Some(name)].map(|name| name.and_then(|name| name.strip_suffix('s')));
    [Some(name), condition].into_iter().chain(sets_flags).flatten()
}

/// The registers that `text` names, with ranges: `r4-r6, lr`, `d8-d15`.
fn set_of(text: &str) -> Set {
    let one = |name: &str| -> Option<Set> {
        let number = |digits: &str, most: u32| digits.parse().ok().filter(|it: &u32| *it <= most);
        Some(match name {
            "sb" => 1 << 9,
            "sl" => 1 << 10,
            "fp" => 1 << 11,
            "ip" => 1 << 12,
            "sp" => SP,
            "lr" => 1 << 14,
            "pc" => PC,
            _ => match name.split_at_checked(1)? {
                ("r", digits) => 1 << number(digits, 15)?,
                ("s", digits) => 1 << (16 + number(digits, 31)?),
                ("d", digits) => 0b11 << (16 + 2 * number(digits, 15)?),
                _ => return None,
            },
        })
    };
    let of_range = |range: &str| {
        let (first, last) = range.split_once('-').unwrap_or((range, range));
        let (first, last) = (one(first.trim())?, one(last.trim())?);
        let before = (first & first.wrapping_neg()) - 1;
        Some(last | ((last - 1) & !before))
    };
    let names = text.split([',', '[', ']', '{', '}', '!', ' ']);
    names.filter_map(of_range).fold(0, |all, registers| all | registers)
}

/// A number in decimal or hexadecimal digits, with its sign.
fn signed(text: &str) -> Option<i32> {
    let (sign, digits) = text.strip_prefix('-').map_or((1, text), |digits| (-1, digits));
    let hexadecimal = digits.strip_prefix("0x").map(|digits| i32::from_str_radix(digits, 16));
    Some(sign * hexadecimal.unwrap_or_else(|| digits.parse()).ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cycles of instructions in sequence, none of which branches.
    fn sequence(listed: &[&str]) -> Vec<u64> {
        let read: Vec<_> = listed.iter().map(|it| Instruction::read(it).unwrap()).collect();
        let previous = |i: usize| i.checked_sub(1).map(|i| &read[i]);
        (0..read.len()).map(|i| read[i].cycles(previous(i), false)).collect()
    }

    fn set(registers: &str) -> Set {
        if registers == "-" { 0 } else { set_of(&registers.replace(' ', ",")) }
    }

    #[test]
    fn instructions_of_an_assembler_are_read_as_what_they_say() {
        let lines = include_str!("instructions.txt").lines();
        let mut checked = 0;
        for line in lines.filter(|line| !line.is_empty() && !line.starts_with('#')) {
            let columns: Vec<&str> = line.split(" | ").collect();
            let [listed, cycles, result, address, source, branches] = columns[..] else {
                panic!("{line}");
            };
            let read = Instruction::read(listed).unwrap_or_else(|| panic!("{line} is not known"));
            assert_eq!(read.cycles(None, false), cycles.parse::<u64>().unwrap(), "{line}");
            let sets = [result, address, source].map(set);
            assert_eq!([read.result, read.address, read.source], sets, "{line}");
            assert_eq!(
                [read.may_branch, read.calls],
                [branches != "-", branches == "calls"],
                "{line}"
            );
            checked += 1;
        }
        assert!(checked > 190, "{checked}");
        for refused in [
            "beab  bkpt 0xab",
            "bf30  wfi",
            "df00  svc 0",
            "b650  setend le",
            "ee31 0b02  vadd.f64 d0, d1, d2",
            "fe81 0a81  vmaxnm.f32 s0, s3, s2",
        ] {
            assert_eq!(Instruction::read(refused), None, "{refused}");
        }
    }

    #[test]
    fn loads_beside_the_code_say_from_where() {
        for (listed, address, from) in [
            ("4902  ldr r1, [pc, #8]", 0x102, 0x10C..0x110),
            ("f85f 1008  ldr.w r1, [pc, #-0x8]", 0x102, 0xFC..0x100),
            ("e9df 0102  ldrd r0, r1, [pc, #8]", 0x102, 0x10C..0x114),
            ("ed1f 0b02  vldr d0, [pc, #-8]", 0x102, 0xFC..0x104),
            ("f8d1 1008  ldr.w r1, [r1, #8]", 0x100, 0..0),
        ] {
            assert_eq!(Instruction::read(listed).unwrap().literal(address), from, "{listed}");
        }
    }

    #[test]
    fn loads_pipeline_and_wait_as_in_the_manuals_own_examples() {
        let (load, other) = ("6808  ldr r0, [r1]", "6811  ldr r1, [r2]");
        assert_eq!(sequence(&[load, other]), [2, 1]);
        assert_eq!(sequence(&["5888  ldr r0, [r1, r2]", "6158  str r0, [r3, #20]"]), [2, 1]);
        assert_eq!(sequence(&["5888  ldr r0, [r1, r2]", "5099  str r1, [r3, r2]"]), [2, 1]);
        // The address was loaded, or computed, just before.
        assert_eq!(sequence(&[other, load]), [2, 2]);
        assert_eq!(sequence(&["3104  adds r1, #4", load]), [1, 3]);
        assert_eq!(sequence(&["3104  adds r1, #4", "edd1 0a00  vldr s1, [r1]"]), [1, 3]);
        assert_eq!(sequence(&["3104  adds r1, #4", "bf00  nop", load]), [1, 1, 2]);
        // Nothing pipelines behind stores, several registers, and changed bases.
        assert_eq!(sequence(&["5099  str r1, [r3, r2]", other]), [2, 2]);
        assert_eq!(sequence(&["e890 000e  ldm.w r0, {r1, r2, r3}", "6820  ldr r0, [r4]"]), [4, 2]);
        assert_eq!(sequence(&["f852 3f04  ldr r3, [r2, #4]!", "682c  ldr r4, [r5]"]), [2, 2]);
        assert_eq!(sequence(&["682c  ldr r4, [r5]", "f852 3f04  ldr r3, [r2, #4]!"]), [2, 2]);
    }

    #[test]
    fn a_floating_point_result_is_there_one_instruction_later() {
        let chained = ["ee00 0a81  vmla.f32 s0, s1, s2", "ee01 0a82  vmla.f32 s0, s3, s4"];
        // The addend comes later; stored just behind, it costs one more: 1 + 1 + 1.
        assert_eq!(sequence(&[chained[0], chained[1], "ed81 0a00  vstr s0, [r1]"]), [3, 3, 3]);
        assert_eq!(sequence(&["eebd 0ac0  vcvt.s32.f32 s0, s0", "ee10 0a10  vmov r0, s0"]), [1, 2]);
        // What was loaded or compared does not wait.
        assert_eq!(sequence(&["edd1 0a00  vldr s1, [r1]", "eef4 0a41  vcmp.f32 s1, s2"]), [2, 1]);
    }

    #[test]
    fn a_branch_that_is_taken_refills_the_pipeline() {
        for (listed, cycles) in [
            ("d1eb  bne #0x10", 3),
            ("4770  bx lr", 3),
            ("468f  mov pc, r1", 3),
            ("bd10  pop {r4, pc}", 5),
            ("e8df f001  tbb [pc, r1]", 6),
            ("f8d1 f004  ldr.w pc, [r1, #4]", 5),
        ] {
            assert_eq!(Instruction::read(listed).unwrap().cycles(None, true), cycles, "{listed}");
        }
    }
}
