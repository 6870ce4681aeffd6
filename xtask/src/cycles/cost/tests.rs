//! Costs counted by hand from the manual's tables; GNU as made the encodings.

use super::*;
use crate::cycles::thumb::decode;

/// Halfwords of an instruction.
type Code = &'static [u16];

fn decoded(code: Code) -> Instruction {
    decode(code[0], code.get(1).copied()).unwrap()
}

/// Cycles of instructions in sequence, none of which branches.
fn sequence(codes: &[Code]) -> Vec<u64> {
    let instructions: Vec<_> = codes.iter().map(|code| decoded(code)).collect();
    (0..instructions.len())
        .map(|i| {
            let previous = i.checked_sub(1).map(|i| &instructions[i]);
            cycles(&instructions[i], previous, false).unwrap()
        })
        .collect()
}

/// Cycles of `count` rounds of a loop that ends in a conditional branch to its start.
fn rounds(body: &[Code], count: usize) -> u64 {
    let body: Vec<_> = body.iter().map(|code| decoded(code)).collect();
    let mut previous = None;
    let mut total = 0;
    for round in 1..=count {
        for (i, instruction) in body.iter().enumerate() {
            let branched = i + 1 == body.len() && round < count;
            total += cycles(instruction, previous, branched).unwrap();
            previous = Some(instruction);
        }
    }
    total
}

#[test]
fn the_manuals_own_examples_of_loads_and_stores() {
    let ldr_r0_r1: Code = &[0x6808];
    let ldr_r1_r2: Code = &[0x6811];
    let ldr_r0_r1_r2: Code = &[0x5888];
    // "LDR R0,[R1]; LDR R1,[R2] - normally three cycles total"
    assert_eq!(sequence(&[ldr_r0_r1, ldr_r1_r2]), [2, 1]);
    // "LDR R0,[R1,R2]; STR R0,[R3,#20] - normally three cycles total"
    assert_eq!(sequence(&[ldr_r0_r1_r2, &[0x6158]]), [2, 1]);
    // "LDR R0,[R1,R2]; STR R1,[R3,R2] - normally three cycles total"
    assert_eq!(sequence(&[ldr_r0_r1_r2, &[0x5099]]), [2, 1]);
    // "LDR R0,[R1,R5]; LDR R1,[R2]; LDR R2,[R3,#4] - normally four cycles total"
    assert_eq!(sequence(&[&[0x5948], ldr_r1_r2, &[0x685A]]), [2, 1, 1]);
    // "LDR PC,[any] ... at least five cycles"
    assert_eq!(cycles(&decoded(&[0xF8D1, 0xF004]), None, true), Some(5));
    // A three-element LDM: 2 + 1 + 1. "An eight element store takes nine cycles"
    assert_eq!(sequence(&[&[0xE890, 0x000E]]), [4]);
    assert_eq!(sequence(&[&[0xE880, 0x01FE]]), [9]);
}

#[test]
fn loads_wait_for_what_their_address_is_made_of() {
    // ldr r1, [r2]; ldr r0, [r1]: loaded just before, so not pipelined.
    assert_eq!(sequence(&[&[0x6811], &[0x6808]]), [2, 2]);
    // adds r1, #4; ldr r0, [r1]: computed just before, 2 + 1.
    assert_eq!(sequence(&[&[0x3104], &[0x6808]]), [1, 3]);
    // adds r1, #4; vldr s1, [r1]: the same, 1 + 1 word, + 1.
    assert_eq!(sequence(&[&[0x3104], &[0xEDD1, 0x0A00]]), [1, 3]);
    // adds r1, #4; str r0, [r3, #20]: another register.
    assert_eq!(sequence(&[&[0x3104], &[0x6158]]), [1, 1]);
    // adds r1, #4; nop; ldr r0, [r1]: not just before.
    assert_eq!(sequence(&[&[0x3104], &[0xBF00], &[0x6808]]), [1, 1, 2]);
}

#[test]
fn nothing_pipelines_behind_stores_multiples_and_changed_bases() {
    let ldr_r1_r2: Code = &[0x6811];
    // str r0, [r3, #20]
    assert_eq!(sequence(&[&[0x6158], ldr_r1_r2]), [1, 2]);
    // str r1, [r3, r2], indexed: 2
    assert_eq!(sequence(&[&[0x5099], ldr_r1_r2]), [2, 2]);
    // ldm r0, {r1, r2, r3}; ldr r0, [r1, r2]
    assert_eq!(sequence(&[&[0xE890, 0x000E], &[0x5888]]), [4, 2]);
    // ldr r3, [r2, #4]!; ldr r4, [r5]
    assert_eq!(sequence(&[&[0xF852, 0x3F04], &[0x682C]]), [2, 2]);
    // ldr r4, [r5]; ldr r3, [r2, #4]!
    assert_eq!(sequence(&[&[0x682C], &[0xF852, 0x3F04]]), [2, 2]);
    // str r4, [r5], #4: 2
    assert_eq!(sequence(&[&[0xF845, 0x4B04]]), [2]);
    // vldr s1, [r1]; vldr s2, [r1, #4]: table 7-1 says 2 without a note that they pipeline
    assert_eq!(sequence(&[&[0xEDD1, 0x0A00], &[0xED91, 0x1A01]]), [2, 2]);
}

#[test]
fn a_floating_point_result_is_there_one_instruction_later() {
    let vmla_s0_s1_s2: Code = &[0xEE00, 0x0A81];
    let vmla_s0_s3_s4: Code = &[0xEE01, 0x0A82];
    let vstr_s0: Code = &[0xED81, 0x0A00];
    // The addend comes later; stored just behind, it costs one more: 1 + 1 + 1.
    assert_eq!(sequence(&[vmla_s0_s1_s2, vmla_s0_s3_s4, vstr_s0]), [3, 3, 3]);
    // vcvt.s32.f32 s0, s0; vmov r0, s0
    assert_eq!(sequence(&[&[0xEEBD, 0x0AC0], &[0xEE10, 0x0A10]]), [1, 2]);
    // vdiv.f32 s0, s1, s2; vneg.f32 s3, s0
    assert_eq!(sequence(&[&[0xEE80, 0x0A81], &[0xEEF1, 0x1A40]]), [14, 2]);
    // vldr s1, [r1]; vcmp.f32 s1, s2; vmrs: what was loaded or compared does not wait
    assert_eq!(sequence(&[&[0xEDD1, 0x0A00], &[0xEEF4, 0x0A41], &[0xEEF1, 0xFA10]]), [2, 1, 1]);
}

#[test]
fn one_instruction_each() {
    for (code, branched, expected, what) in [
        (&[0x3101][..], false, 1, "adds r1, #1"),
        (&[0xFB22, 0x1104], false, 1, "smlad r1, r2, r4, r1"),
        (&[0xFBB3, 0xF2F4], false, 12, "udiv r2, r3, r4, at its slowest"),
        (&[0xBF08], false, 1, "it eq, not folded"),
        (&[0x4770], true, 3, "bx lr"),
        (&[0xF000, 0xF805], true, 3, "bl"),
        (&[0xD1EB], false, 1, "bne, not taken"),
        (&[0x468F], true, 3, "mov pc, r1"),
        (&[0xBD10], true, 5, "pop {r4, pc}: 1 + 2 + 2"),
        (&[0xE8DF, 0xF001], true, 6, "tbb"),
        (&[0xF3EF, 0x8100], false, 2, "mrs r1, apsr"),
        (&[0xE9DD, 0x2302], false, 3, "ldrd r2, r3, [sp, #8]"),
        (&[0xEC91, 0x8B10], false, 17, "vldmia r1, {d8-d15}"),
        (&[0xED91, 0x3B02], false, 3, "vldr d3, [r1, #8]"),
        (&[0xEC43, 0x2A10], false, 2, "vmov s0, s1, r2, r3"),
        (&[0xEE02, 0x1A90], false, 1, "vmov s5, r1"),
    ] {
        assert_eq!(cycles(&decoded(code), None, branched), Some(expected), "{what}");
    }
    // bkpt 0xab
    assert_eq!(cycles(&decoded(&[0xBEAB]), None, false), None);
}

#[test]
fn a_loop_of_sums_of_products_in_floating_point() {
    let body: [Code; 11] = [
        &[0xECB1, 0xAA04], // vldmia r1!, {s20-s23}   1 + 4
        &[0xEE2A, 0xAA00], // vmul.f32 s20, s20, s0   1
        &[0xEE6A, 0xAAA0], // vmul.f32 s21, s21, s1   1
        &[0xEE2B, 0xBA01], // vmul.f32 s22, s22, s2   1
        &[0xEE6B, 0xBAA1], // vmul.f32 s23, s23, s3   1
        &[0xEE3A, 0xAA2A], // vadd.f32 s20, s20, s21  1
        &[0xEE3B, 0xBA2B], // vadd.f32 s22, s22, s23  1
        &[0xEE3A, 0xAA0B], // vadd.f32 s20, s20, s22  1 + 1: s22 was computed just before
        &[0xED82, 0xAA00], // vstr s20, [r2]          2 + 1: s20 likewise
        &[0x3B01],         // subs r3, #1             1
        &[0xD1EB],         // bne                     1 + 2 if taken
    ];
    // 17 a round without the branch; 3 for each but the last, which takes 1.
    assert_eq!(rounds(&body, 1), 18);
    assert_eq!(rounds(&body, 100), 100 * 17 + 99 * 3 + 1);
}

#[test]
fn a_loop_of_sums_of_products_in_16_bits() {
    let body: [Code; 7] = [
        &[0xE8B0, 0x400C], // ldmia.w r0!, {r2, r3, lr}  1 + 3
        &[0xFB22, 0x1104], // smlad r1, r2, r4, r1       1
        &[0xFB23, 0x1105], // smlad r1, r3, r5, r1       1
        &[0xFB2E, 0x1106], // smlad r1, lr, r6, r1       1
        &[0x9101],         // str r1, [sp, #4]           1: its data may be new, its address is not
        &[0x3F01],         // subs r7, #1                1
        &[0xD1F4],         // bne                        1 + 2 if taken
    ];
    assert_eq!(rounds(&body, 1), 10);
    assert_eq!(rounds(&body, 100), 100 * 9 + 99 * 3 + 1);
}
