use super::*;

/// Registers in the form `r4-r6 r14`; `-` if there are none.
fn registers(letter: char, set: u32) -> String {
    let is_in = |n: u32| n < 32 && set >> n & 1 == 1;
    let runs =
        (0..32).filter(|&n| is_in(n) && (n == 0 || !is_in(n - 1))).map(|first| {
            match (first..32).take_while(|&n| is_in(n)).last() {
                Some(last) if last > first => format!("{letter}{first}-{letter}{last}"),
                _ => format!("{letter}{first}"),
            }
        });
    let runs: Vec<String> = runs.collect();
    if runs.is_empty() { "-".into() } else { runs.join(" ") }
}

fn described(i: &Instruction) -> String {
    let branches = if i.may_branch { ", may branch" } else { "" };
    let calls = if i.calls { ", calls" } else { "" };
    format!(
        "{:?}{branches}{calls} | {} | {} | {} | {}",
        i.class,
        registers('r', i.result.into()),
        registers('r', i.address.into()),
        registers('s', i.fp_result),
        registers('s', i.fp_source)
    )
}

#[test]
fn encodings_of_an_assembler_are_decoded_to_what_they_say() {
    let mut checked = 0;
    for line in include_str!("encodings.txt").lines() {
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let mut columns = line.splitn(3, " | ");
        let mut column = || columns.next().unwrap();
        let (halfwords, text, expected) = (column(), column(), column());
        let halfwords: Vec<u16> =
            halfwords.split(' ').map(|h| u16::from_str_radix(h, 16).unwrap()).collect();
        let instruction = decode(halfwords[0], halfwords.get(1).copied());
        let instruction = instruction.unwrap_or_else(|| panic!("{text} is not known"));
        assert_eq!(instruction.bytes as usize, 2 * halfwords.len(), "{text}");
        assert_eq!(described(&instruction), expected, "{text}");
        checked += 1;
    }
    assert!(checked > 200, "{checked}");
}

#[test]
fn what_this_processor_has_not_is_refused() {
    for (first, second, what) in [
        (0xB650, None, "setend le"),
        (0xBA80, None, "hlt"),
        (0xBF50, None, "an unallocated hint"),
        (0xC300, None, "stmia r3!, {}"),
        (0xB400, None, "push {}"),
        (0x4701, None, "bx with bits that must be zero"),
        (0xEE31, Some(0x0B02), "vadd.f64 d0, d1, d2"),
        (0xFE81, Some(0x0A81), "vmaxnm.f32 s0, s3, s2 (FPv5)"),
        (0xFE01, Some(0x0A81), "vseleq.f32 s0, s3, s2 (FPv5)"),
        (0xEF00, Some(0x0D40), "vadd.f32 q0, q0, q0 (NEON)"),
        (0xEC91, Some(0x0B03), "fldmiax r1, {d0}"),
        (0xEC91, Some(0x0A00), "vldmia r1, {}"),
        (0xECD1, Some(0xFA02), "vldmia r1, {s31, s32}"),
        (0xF2C0, Some(0xE800), "blx to a constant"),
        (0xE8BD, Some(0x0000), "ldmia sp!, {}"),
        (0xE98D, Some(0xC010), "srs"),
        (0xEAA1, Some(0x0102), "data processing, operation 5"),
        (0xFB11, Some(0xF142), "a multiplication with bits that must be zero"),
        (0xFBB1, Some(0xF0E2), "a division that is none"),
        (0xF911, Some(0x0A00), "a load that neither adds first nor changes its base"),
        (0xF821, Some(0x1103), "a store with bits that must be zero"),
        (0xEE11, Some(0x0C10), "a coprocessor that is not there"),
    ] {
        assert_eq!(decode(first, second), None, "{first:04x} {second:04x?}: {what}");
    }
}

#[test]
fn an_instruction_cut_in_two_is_refused() {
    assert_eq!(decode(0xF000, None), None);
}

#[test]
fn loads_beside_the_code_say_from_where() {
    for (first, second, at, from, what) in [
        (0x4902, None, 0x100, 0x10C..0x110, "ldr r1, [pc, #8]"),
        (0x4902, None, 0x102, 0x10C..0x110, "ldr r1, [pc, #8] at an odd halfword"),
        (0xF8DF, Some(0x1008), 0x102, 0x10C..0x110, "ldr.w r1, [pc, #8]"),
        (0xF85F, Some(0x1008), 0x102, 0xFC..0x100, "ldr.w r1, [pc, #-8]"),
        (0xE9DF, Some(0x0102), 0x102, 0x10C..0x114, "ldrd r0, r1, [pc, #8]"),
        (0xE95F, Some(0x0102), 0x102, 0xFC..0x104, "ldrd r0, r1, [pc, #-8]"),
        (0xED9F, Some(0x0A02), 0x102, 0x10C..0x110, "vldr s0, [pc, #8]"),
        (0xED1F, Some(0x0B02), 0x102, 0xFC..0x104, "vldr d0, [pc, #-8]"),
        (0x6809, None, 0x100, 0..0, "ldr r1, [r1]"),
        (0xF8D1, Some(0x1008), 0x100, 0..0, "ldr.w r1, [r1, #8]"),
        (0xE9D2, Some(0x0102), 0x100, 0..0, "ldrd r0, r1, [r2, #8]"),
        (0xED91, Some(0x0A02), 0x100, 0..0, "vldr s0, [r1, #8]"),
        (0xF89F, Some(0xF008), 0x100, 0..0, "pld [pc, #8]"),
    ] {
        assert_eq!(decode(first, second).unwrap().literal(at), from, "{what}");
    }
}
