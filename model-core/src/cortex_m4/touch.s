@ ---------------------------------------------------------------------------------------------------------
@ Shape and strength of a touch. In assembly because the compiler loads and stores number by number.
@ ---------------------------------------------------------------------------------------------------------

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

@ s24.. as \one makes them, and s30 += each of them, \count times, one behind.
    .macro with_total count, one
    .altmacro
    \one 0
    .set done, 1
    .rept \count - 1
    \one %(done)
    each_one vadd, 30, 30, s, %(23 + done)
    .set done, done + 1
    .endr
    each_one vadd, 30, 30, s, %(23 + done)
    .noaltmacro
    .endm

    .macro sum_with_magnitude number
    each_one vadd, %(24 + \number), %(6 + 2 * \number), s, %(18 + \number)
    .endm

    .macro magnitude_of_change number
    magnitude %(24 + \number), \number
    .endm

@ Loads \count readings at r0, relative to the baseline if r4 is not 0; then levels and thresholds at r1 to s6...
@ s0.. = changes.
    .macro changes count
    transfer vldmia, 0, \count, r0
    cbz r4, 2f
    transfer vldmia, 18, \count, r4
    each \count, vmul, 0, 0, 18
2:
    transfer vldmia, 6, 2 * \count, r1
    apart \count, vsub, 0, 1, 0, 1, 6, 2
    .endm

@ Twice what \count readings exceed their thresholds to either side, written at r2. s30 += the magnitudes.
    .macro either_side count
    changes \count
    magnitudes \count, 18, 0, 1
    apart \count, vsub, 6, 2, 18, 1, 7, 2
    magnitudes \count, 18, 6, 2
    with_total \count, sum_with_magnitude
    store_with_signs \count
    .endm

@ The same to the side s31.
    .macro one_side count
    changes \count
    each_with \count, vmul, 0, 0, s31
    apart \count, vsub, 6, 2, 0, 1, 7, 2
    magnitudes \count, 18, 6, 2
    with_total \count, sum_with_magnitude
    transfer vstmia, 24, \count, r2
    .endm

@ The same to either side where all thresholds are 0. Bits are equal: with a change a, |a| + ||a|| is |a + a|.
    .macro whole_changes count
    changes \count
    each \count, vadd, 0, 0, 0
    with_total \count, magnitude_of_change
    transfer vstmia, 0, \count, r2
    .endm

@ \name for as many numbers as \left says, \many at a time, and then one by one.
    .macro for_all name, many, left
    subs \left, \left, #\many
    blo 3f
1:
    \name \many
    subs \left, \left, #\many
    bhs 1b
3:
    adds \left, \left, #\many
    beq 5f
4:
    \name 1
    subs \left, \left, #1
    bne 4b
5:
    .endm

    .macro products count
    transfer vldmia, 1, \count, r2
    each_with \count, vmul, 1, 1, s0
    transfer vstmia, 1, \count, r0
    .endm

@ void taxel_multiply(numbers: *mut f32 [count], count: u32, factor: f32)
@ numbers = numbers · factor. r0 to r2 and s1..s12 are overwritten.
    function taxel_multiply
    mov r2, r0
    for_all products, 12, r1
    bx lr
    .size taxel_multiply, . - taxel_multiply

@ f32 taxel_touch(readings: *const f32 [count], pairs: *const f32 [2 · count], shape: *mut f32 [count],
@                 count: u32 ≥ 1, reciprocals: *const f32 [count] or 0, floor: f32, side: f32,
@                 whole_changes: bool)
@ Writes the shape and returns the strength, as touch.rs says.
    function taxel_touch
    push {r4-r11, lr}
    vpush {s16-s31}
    ldrd r4, r9, [sp, #16 * 4 + 9 * 4]
    mov r5, r2
    mov r6, r3
    vmov r7, s0
    vmov.f32 s31, s1
    mov r12, #0
    vmov s30, r12
    cmp r9, #0
    bne 8f
    vcmp.f32 s31, #0.0
    vmrs APSR_nzcv, fpscr
    bne 6f
    for_all either_side, 6, r3
    b 7f
6:
    for_all one_side, 6, r3
    b 7f
8:
    for_all whole_changes, 6, r3
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
