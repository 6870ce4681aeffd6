@ ---------------------------------------------------------------------------------------------------------
@ Shape and strength of a touch. In assembly because the compiler loads and stores number by number.
@ ---------------------------------------------------------------------------------------------------------

@ s\to = s\left \operation s\right, \count times: the registers lie so many numbers apart.
    .macro apart count, operation, to, to_step, left, left_step, right, right_step
    .altmacro
    .set done, 0
    .rept \count
    each_one \operation, %(\to + \to_step * done), %(\left + \left_step * done), s, %(\right + \right_step * done)
    .set done, done + 1
    .endr
    .noaltmacro
    .endm

@ s0.. = |s\from..|, \count times, in registers that lie so many numbers apart.
    .macro magnitudes count, to, from, from_step
    .altmacro
    .set done, 0
    .rept \count
    magnitude %(\to + done), %(\from + \from_step * done)
    .set done, done + 1
    .endr
    .noaltmacro
    .endm

    .macro magnitude to, from
    vabs.f32 s\to, s\from
    .endm

@ Writes s24.. with the signs of s0.. at r2, \count times; the signs of s24.. are 0.
    .macro store_with_signs count
    .altmacro
    .set done, 0
    .rept \count / 2
    store_pair %(done), %(done + 1), %(24 + done), %(25 + done)
    .set done, done + 2
    .endr
    .noaltmacro
    .if \count % 2
    vmov r8, s0
    vmov r10, s24
    bfi r8, r10, #0, #31
    str r8, [r2], #4
    .endif
    .endm

    .macro store_pair sign, other_sign, of, other
    vmov r8, r9, s\sign, s\other_sign
    vmov r10, r11, s\of, s\other
    bfi r8, r10, #0, #31
    bfi r9, r11, #0, #31
    strd r8, r9, [r2], #8
    .endm

@ s24.. = s6, s8.. + s18.., and s30 += each of s24.., \count times, one behind.
    .macro sums_and_total count
    vadd.f32 s24, s6, s18
    .altmacro
    .set done, 1
    .rept \count - 1
    each_one vadd, %(24 + done), %(6 + 2 * done), s, %(18 + done)
    each_one vadd, 30, 30, s, %(23 + done)
    .set done, done + 1
    .endr
    each_one vadd, 30, 30, s, %(23 + done)
    .noaltmacro
    .endm

@ Loads \count readings at r0, relative to the baseline if r4 is not 0; then levels and thresholds at r1 to s6...
@ s0.. = changes.
    .macro changes count, last, last_of_pairs, last_of_baseline
    vldmia r0!, {s0-s\last}
    cbz r4, 2f
    vldmia r4!, {s18-s\last_of_baseline}
    each \count, vmul, 0, 0, 18
2:
    vldmia r1!, {s6-s\last_of_pairs}
    apart \count, vsub, 0, 1, 0, 1, 6, 2
    .endm

@ Twice what \count readings exceed their thresholds to either side, written at r2. s30 += the magnitudes.
    .macro either_side count, last, last_of_pairs, last_of_baseline, last_of_sums
    changes \count, \last, \last_of_pairs, \last_of_baseline
    magnitudes \count, 18, 0, 1
    apart \count, vsub, 6, 2, 18, 1, 7, 2
    magnitudes \count, 18, 6, 2
    sums_and_total \count
    store_with_signs \count
    .endm

@ The same to the side s31.
    .macro one_side count, last, last_of_pairs, last_of_baseline, last_of_sums
    changes \count, \last, \last_of_pairs, \last_of_baseline
    each_with \count, vmul, 0, 0, s31
    apart \count, vsub, 6, 2, 0, 1, 7, 2
    magnitudes \count, 18, 6, 2
    sums_and_total \count
    vstmia r2!, {s24-s\last_of_sums}
    .endm

@ All readings, six at a time, and then one by one.
    .macro all_readings name
    subs r3, r3, #6
    blo 3f
1:
    \name 6, 5, 17, 23, 29
    subs r3, r3, #6
    bhs 1b
3:
    adds r3, r3, #6
    beq 5f
4:
    \name 1, 0, 7, 18, 24
    subs r3, r3, #1
    bne 4b
5:
    .endm

@ void taxel_multiply(numbers: *mut f32 [count], count: u32, factor: f32)
@ numbers = numbers · factor. r0, r1 and s1..s12 are overwritten.
    function taxel_multiply
    subs r1, r1, #12
    blo 2f
1:
    vldmia r0, {s1-s12}
    each_with 12, vmul, 1, 1, s0
    vstmia r0!, {s1-s12}
    subs r1, r1, #12
    bhs 1b
2:
    adds r1, r1, #12
    beq 4f
3:
    vldr s1, [r0]
    vmul.f32 s1, s1, s0
    vstmia r0!, {s1}
    subs r1, r1, #1
    bne 3b
4:
    bx lr
    .size taxel_multiply, . - taxel_multiply

@ f32 taxel_touch(readings: *const f32 [count], pairs: *const f32 [2 · count], shape: *mut f32 [count],
@                 count: u32 ≥ 1, reciprocals: *const f32 [count] or 0, floor: f32, side: f32)
@ Writes the shape and returns the strength, as touch.rs says.
    function taxel_touch
    push {r4-r11, lr}
    vpush {s16-s31}
    ldr r4, [sp, #16 * 4 + 9 * 4]
    mov r5, r2
    mov r6, r3
    vmov r7, s0
    vmov.f32 s31, s1
    mov r12, #0
    vmov s30, r12
    vcmp.f32 s31, #0.0
    vmrs APSR_nzcv, fpscr
    bne 6f
    all_readings either_side
    b 7f
6:
    all_readings one_side
7:
    vmov.f32 s1, #0.5
    vmov s0, r7
    vmul.f32 s30, s30, s1
    vadd.f32 s30, s30, s0
    vdiv.f32 s31, s1, s30
    vmov.f32 s0, s31
    mov r0, r5
    mov r1, r6
    bl taxel_multiply
    vmov.f32 s0, s30
    vpop {s16-s31}
    pop {r4-r11, pc}
    .size taxel_touch, . - taxel_touch
