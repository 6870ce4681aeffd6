@ Inner loops of the gate, the projection and the two fast number formats for a Cortex-M4F, at 18 inputs and 18
@ outputs.
@
@ The compiler cannot be led here: it neither keeps 18 accumulators in registers while it streams the
@ weights through the rest by load-multiple, nor pairs 16-bit products (docs/cycles.md has both figures).
@ cortex_m4.rs declares these functions; gate.rs, projection.rs, expanded.rs and fixed16.rs hold their twins in
@ Rust, which do the same operations in the same order: outputs agree bit for bit, which tests check.
@
@ Procedure call standard: AAPCS, hard float, for the functions that cortex_m4.rs declares. None reads or writes
@ beyond the sizes that its arguments give. Stack: at most 192 bytes.

    .syntax unified
    .fpu fpv4-sp-d16
    .thumb

    .macro function name
    .section .text.\name, "ax", %progbits
    .balign 4
    .global \name
    .type \name, %function
    .thumb_func
\name:
    .endm

@ Bits of the argument flags
    .equ AFFINE, 1
    .equ SCALED, 2
@ Bit of the FPSCR
    .equ INVALID_OPERATION, 1

@ s0..s17 = s0..s17 \operation the 18 numbers at \at; \at is overwritten.
    .macro with_eighteen operation, at
    vldmia \at!, {s18-s31}
    \operation\().f32 s0, s0, s18
    \operation\().f32 s1, s1, s19
    \operation\().f32 s2, s2, s20
    \operation\().f32 s3, s3, s21
    \operation\().f32 s4, s4, s22
    \operation\().f32 s5, s5, s23
    \operation\().f32 s6, s6, s24
    \operation\().f32 s7, s7, s25
    \operation\().f32 s8, s8, s26
    \operation\().f32 s9, s9, s27
    \operation\().f32 s10, s10, s28
    \operation\().f32 s11, s11, s29
    \operation\().f32 s12, s12, s30
    \operation\().f32 s13, s13, s31
    vldmia \at, {s18-s21}
    \operation\().f32 s14, s14, s18
    \operation\().f32 s15, s15, s19
    \operation\().f32 s16, s16, s20
    \operation\().f32 s17, s17, s21
    .endm

@ s0..s17 = the inputs at r0 as integers in UNITS, saturated. r1 moves from the block's start, past its middles and
@ units. r0 and r3 are overwritten.
@ The invalid-operation flag is cleared first; it is set afterwards if an input was saturated or NaN.
    .macro inputs flags
    vmrs r3, fpscr
    vldmia r0, {s0-s17}
    bic r3, r3, #INVALID_OPERATION
    vmsr fpscr, r3
    tst \flags, #SCALED
    bne 5f
    mov r0, r1
    with_eighteen vsub, r0
    add r0, r1, #18 * 4
    with_eighteen vmul, r0
5:
    .irp i, 0,1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17
    vcvt.s32.f32 s\i, s\i
    .endr
    add r1, r1, #36 * 4
    .endm

@ ---------------------------------------------------------------------------------------------------------
@ f32, expanded distance. VMUL and VADD (1 cycle each) rather than VFMA (3), in an order that never uses
@ a result in the very next instruction.
@ ---------------------------------------------------------------------------------------------------------

@ First half of one centre: s18..s21 become the four partial sums, 9 products taken in.
    .macro f32_first_half
    vmul.f32 s21, s21, s0
    vmul.f32 s22, s22, s1
    vmul.f32 s23, s23, s2
    vmul.f32 s24, s24, s3
    vmul.f32 s25, s25, s4
    vmul.f32 s26, s26, s5
    vmul.f32 s27, s27, s6
    vmul.f32 s28, s28, s7
    vmul.f32 s29, s29, s8
    .endm

    .macro f32_second_half
    vadd.f32 s18, s20, s21
    vadd.f32 s19, s31, s22
    vadd.f32 s20, s23, s27
    vadd.f32 s21, s24, s28
    vadd.f32 s18, s18, s25
    vadd.f32 s19, s19, s26
    vadd.f32 s18, s18, s29
    vldmia r1!, {s22-s30}
    vmul.f32 s22, s22, s9
    vmul.f32 s23, s23, s10
    vmul.f32 s24, s24, s11
    vmul.f32 s25, s25, s12
    vmul.f32 s26, s26, s13
    vmul.f32 s27, s27, s14
    vmul.f32 s28, s28, s15
    vmul.f32 s29, s29, s16
    vmul.f32 s30, s30, s17
    vadd.f32 s19, s19, s22
    vadd.f32 s20, s20, s23
    vadd.f32 s21, s21, s24
    vadd.f32 s18, s18, s25
    vadd.f32 s19, s19, s26
    vadd.f32 s20, s20, s27
    vadd.f32 s18, s18, s29
    vadd.f32 s19, s19, s30
    vadd.f32 s21, s21, s28
    vadd.f32 s18, s18, s19
    vadd.f32 s19, s20, s21
    .endm

@ The previous centre gets its last addition and is stored while this centre's coefficients are used.
    .macro f32_next_centre
    vldmia r1!, {s20-s29}
    vadd.f32 s18, s18, s19
    f32_first_half
    vstmia r2!, {s18}
    f32_second_half
    .endm

@ s0..s11 += s18..s29
    .macro f32_add_twelve
    vadd.f32 s0, s0, s18
    vadd.f32 s1, s1, s19
    vadd.f32 s2, s2, s20
    vadd.f32 s3, s3, s21
    vadd.f32 s4, s4, s22
    vadd.f32 s5, s5, s23
    vadd.f32 s6, s6, s24
    vadd.f32 s7, s7, s25
    vadd.f32 s8, s8, s26
    vadd.f32 s9, s9, s27
    vadd.f32 s10, s10, s28
    vadd.f32 s11, s11, s29
    .endm

@ s12..s17 += s18..s23
    .macro f32_add_six
    vadd.f32 s12, s12, s18
    vadd.f32 s13, s13, s19
    vadd.f32 s14, s14, s20
    vadd.f32 s15, s15, s21
    vadd.f32 s16, s16, s22
    vadd.f32 s17, s17, s23
    .endm

@ s0..s17 += two lines of weights at r0, each times its factor at r1.
    .macro f32_two_centres
    vldmia r1!, {s30-s31}
    vldmia r0!, {s18-s29}
    .irp i, 18,19,20,21,22,23,24,25,26,27,28,29
    vmul.f32 s\i, s\i, s30
    .endr
    f32_add_twelve
    vldmia r0!, {s18-s29}
    .irp i, 18,19,20,21,22,23
    vmul.f32 s\i, s\i, s30
    .endr
    .irp i, 24,25,26,27,28,29
    vmul.f32 s\i, s\i, s31
    .endr
    f32_add_six
    vadd.f32 s0, s0, s24
    vadd.f32 s1, s1, s25
    vadd.f32 s2, s2, s26
    vadd.f32 s3, s3, s27
    vadd.f32 s4, s4, s28
    vadd.f32 s5, s5, s29
    vldmia r0!, {s18-s29}
    .irp i, 18,19,20,21,22,23,24,25,26,27,28,29
    vmul.f32 s\i, s\i, s31
    .endr
    vadd.f32 s6, s6, s18
    vadd.f32 s7, s7, s19
    vadd.f32 s8, s8, s20
    vadd.f32 s9, s9, s21
    vadd.f32 s10, s10, s22
    vadd.f32 s11, s11, s23
    vadd.f32 s12, s12, s24
    vadd.f32 s13, s13, s25
    vadd.f32 s14, s14, s26
    vadd.f32 s15, s15, s27
    vadd.f32 s16, s16, s28
    vadd.f32 s17, s17, s29
    .endm

@ s0..s17 += two lines of weights at r0, 72 bytes and r11 apart, each times its factor at r1.
    .macro f32_two_centres_apart
    vldmia r1!, {s30-s31}
    .irp factor, s30, s31
    vldmia r0!, {s18-s29}
    .irp i, 18,19,20,21,22,23,24,25,26,27,28,29
    vmul.f32 s\i, s\i, \factor
    .endr
    f32_add_twelve
    vldmia r0!, {s18-s23}
    add r0, r0, r11
    .irp i, 18,19,20,21,22,23
    vmul.f32 s\i, s\i, \factor
    .endr
    f32_add_six
    .endr
    .endm

@ s0..s17 = the inputs in units, s31 = −g·‖x‖², r1 = the bias, which is kept at [sp, #F32_BIAS], r6 = r2.
    .macro f32_open flags
    inputs \flags
    .irp i, 0,1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17
    vcvt.f32.s32 s\i, s\i
    .endr
    vldr s30, [r1]
@ ‖x‖² in four partial sums
    vmul.f32 s18, s0, s0
    vmul.f32 s19, s1, s1
    vmul.f32 s20, s2, s2
    vmul.f32 s21, s3, s3
    vmul.f32 s22, s4, s4
    vmul.f32 s23, s5, s5
    vmul.f32 s24, s6, s6
    vmul.f32 s25, s7, s7
    vadd.f32 s18, s18, s22
    vadd.f32 s19, s19, s23
    vadd.f32 s20, s20, s24
    vadd.f32 s21, s21, s25
    vmul.f32 s22, s8, s8
    vmul.f32 s23, s9, s9
    vmul.f32 s24, s10, s10
    vmul.f32 s25, s11, s11
    vadd.f32 s18, s18, s22
    vadd.f32 s19, s19, s23
    vadd.f32 s20, s20, s24
    vadd.f32 s21, s21, s25
    vmul.f32 s22, s12, s12
    vmul.f32 s23, s13, s13
    vmul.f32 s24, s14, s14
    vmul.f32 s25, s15, s15
    vadd.f32 s18, s18, s22
    vadd.f32 s19, s19, s23
    vadd.f32 s20, s20, s24
    vadd.f32 s21, s21, s25
    vmul.f32 s22, s16, s16
    vmul.f32 s23, s17, s17
    vadd.f32 s20, s20, s21
    vadd.f32 s18, s18, s22
    vadd.f32 s19, s19, s23
    adds r1, #4
    vadd.f32 s18, s18, s19
    str r1, [sp, #F32_BIAS]
    vadd.f32 s18, s18, s20
    mov r6, r2
    vnmul.f32 s31, s30, s18
    .endm

@ r9 = groups of four centres to do now, of the r10 left
    .macro f32_take_fours
    mov r9, r10
    cmp r9, #MOST_FOURS
    it hi
    movhi r9, #MOST_FOURS
    sub r10, r10, r9
    .endm

@ u32 taxel_f32(inputs: *const f32 [18], block: *const u32, output: *mut f32 [18], fours: u32 ≥ 1,
@                flags: u32, activations: *mut f32 [128])
@ output = A·x + Σ_k weights_k · 2^(exponents_k[0] + exponents_k[1..]·x − decay·‖x‖²) + bias, with the
@ parameters in the block as expanded.rs says. Returns the FPSCR.
    .equ F32_SHARED, 72
    .equ F32_BIAS, 76
    .equ F32_FRAME, 80
    .equ F32_ARGUMENTS, F32_FRAME + 16 * 4 + 9 * 4
    .equ MOST_FOURS, 32

    function taxel_f32
    push {r4-r11, lr}
    vpush {s16-s31}
    sub sp, #F32_FRAME
    ldr r9, [sp, #F32_ARGUMENTS]
    ldr r7, [sp, #F32_ARGUMENTS + 4]
    mov r10, r3
    f32_open r9
    add r4, r1, #18 * 4
    adr.w r11, 8f
    mov r0, r4
    tst r9, #AFFINE
    it ne
    addne r4, r4, #18 * 18 * 4
@ r5 = weights, behind 4·19 words for every four centres
    mov r2, #4 * 19 * 4
    mul r5, r10, r2
    add r5, r5, r4
    bne 1f
    cmp r10, #MOST_FOURS
    bls 2f
1:
@ The inputs are needed again later
    vstmia sp, {s0-s17}
    vstr s31, [sp, #F32_SHARED]
    tst r9, #AFFINE
    beq 2f
    mov r1, sp
    movs r3, #9
    bl taxel_f32_sums
    b 7f

@ r4 exponents, r5 weights, r6 output, r7 activations, r10 groups of four left, r11 sums so far
2:
    f32_take_fours
    bl taxel_f32_activations
    mov r0, r5
    mov r1, r7
    lsl r3, r9, #1
    bl taxel_f32_sums
    mov r5, r0
    cmp r10, #0
    beq 6f
7:
    mov r11, r6
    vstmia r6, {s0-s17}
    vldmia sp, {s0-s17}
    vldr s31, [sp, #F32_SHARED]
    b 2b
6:
    ldr r1, [sp, #F32_BIAS]
    with_eighteen vadd, r1
    vmrs r0, fpscr
    vstmia r6, {s0-s17}
    add sp, #F32_FRAME
    vpop {s16-s31}
    pop {r4-r11, pc}
    .balign 4
8:
    .fill 18, 4, 0
    .size taxel_f32, . - taxel_f32

@ Writes the activations of 4·r9 centres to r7, from the inputs in s0..s17 and the shared term in s31. r4 moves
@ past their exponents. r0..r3, r8, r12 are overwritten.
    function taxel_f32_activations
    push {lr}
    mov r3, r9
    mov r1, r4
    mov r2, r7
3:
    vldmia r1!, {s20-s29}
    f32_first_half
    f32_second_half
    f32_next_centre
    f32_next_centre
    f32_next_centre
    subs r3, #1
    vadd.f32 s18, s18, s19
    vstmia r2!, {s18}
    bne 3b
    mov r4, r1

@ Powers of two, four at once: constants in s16..s22
    adr r2, 9f
    vldmia r2, {s16-s22}
    mov r2, r7
    mov r3, r9
taxel_f32_powers: @ to its end: what one exponential costs is counted here
4:
    vldmia r2, {s0-s3}
    vadd.f32 s4, s0, s22
    vadd.f32 s5, s1, s22
    vadd.f32 s6, s2, s22
    vadd.f32 s7, s3, s22
    vsub.f32 s8, s4, s22
    vsub.f32 s9, s5, s22
    vsub.f32 s10, s6, s22
    vsub.f32 s11, s7, s22
    vsub.f32 s0, s0, s8
    vsub.f32 s1, s1, s9
    vsub.f32 s2, s2, s10
    vsub.f32 s3, s3, s11
    vmul.f32 s8, s0, s16
    vmul.f32 s9, s1, s16
    vmul.f32 s10, s2, s16
    vmul.f32 s11, s3, s16
    .irp constant, s17, s18, s19, s20
    vadd.f32 s8, s8, \constant
    vadd.f32 s9, s9, \constant
    vadd.f32 s10, s10, \constant
    vadd.f32 s11, s11, \constant
    vmul.f32 s8, s8, s0
    vmul.f32 s9, s9, s1
    vmul.f32 s10, s10, s2
    vmul.f32 s11, s11, s3
    .endr
    vadd.f32 s8, s8, s21
    vadd.f32 s9, s9, s21
    vadd.f32 s10, s10, s21
    vadd.f32 s11, s11, s21
    vmov r0, s8
    vmov lr, s4
    add r0, r0, lr, lsl #23
    vmov r1, s9
    vmov lr, s5
    add r1, r1, lr, lsl #23
    vmov r8, s10
    vmov lr, s6
    add r8, r8, lr, lsl #23
    vmov r12, s11
    vmov lr, s7
    add r12, r12, lr, lsl #23
    subs r3, #1
    stmia r2!, {r0, r1, r8, r12}
    bne 4b
taxel_f32_powers_end:
    pop {pc}
    .balign 4
9:
    .word 0x3aaca793 @ 2^f: degree 5 to 0; EXP2_COEFFICIENTS of exp.rs, which a test compares
    .word 0x3c1e7a2a
    .word 0x3d635f2b
    .word 0x3e75fccd
    .word 0x3f317210
    .word 0x3f800000
    .word 0x4b400000 @ 1.5·2^23: adding it rounds to the nearest integer
    .size taxel_f32_activations, . - taxel_f32_activations

@ s0..s17 = 18 numbers at r11 + Σ_k weights_k·factors_k, weights at r0 (left behind them), factors at r1,
@ 2·r3 of them.
    function taxel_f32_sums
    vldmia r11, {s0-s17}
    lsrs r3, r3, #1
    bcc 1f
    add r3, r3, #1
    b 2f
1:
    f32_two_centres
2:
    f32_two_centres
    subs r3, #1
    bne.w 1b
    bx lr
    .size taxel_f32_sums, . - taxel_f32_sums

@ ---------------------------------------------------------------------------------------------------------
@ Behind a projection: one network for the whole array, whose activations serve all outputs.
@ ---------------------------------------------------------------------------------------------------------

@ void taxel_project(readings: *const f32 [2·pairs], block: *const f32 [18·(1 + 2·pairs)],
@                    features: *mut f32 [18], pairs: u32 ≥ 1)
@ features = f₀ + Σ_j readings_j · p_j, with the parameters in the block as projection.rs says.
    function taxel_project
    push {r11, lr}
    vpush {s16-s31}
    mov r11, r1
    add r12, r1, #18 * 4
    mov r1, r0
    mov r0, r12
    bl taxel_f32_sums
    vstmia r2, {s0-s17}
    vpop {s16-s31}
    pop {r11, pc}
    .size taxel_project, . - taxel_project

@ u32 taxel_f32_array(inputs: *const f32 [18], block: *const u32, output: *mut f32 [18·groups],
@                     fours: u32 ≥ 1, flags: u32, activations: *mut f32 [128], groups: u32 ≥ 1)
@ Computes what taxel_f32 does, for several groups of 18 outputs.
    .equ F32A_AFFINE, 80
    .equ F32A_FIRST, 84
    .equ F32A_FRAME, 88
    .equ F32A_ARGUMENTS, F32A_FRAME + 16 * 4 + 9 * 4

    function taxel_f32_array
    push {r4-r11, lr}
    vpush {s16-s31}
    sub sp, #F32A_FRAME
    ldr r9, [sp, #F32A_ARGUMENTS]
    ldr r7, [sp, #F32A_ARGUMENTS + 4]
    mov r10, r3
    f32_open r9
    ldr r8, [sp, #F32A_ARGUMENTS + 8]
    vstmia sp, {s0-s17}
    vstr s31, [sp, #F32_SHARED]
@ r11 = bytes of a line of all outputs
    mov r0, #18 * 4
    mul r11, r0, r8
    add r4, r1, r11
    str r4, [sp, #F32A_AFFINE]
    mov r0, #18
    mul r0, r0, r11
    tst r9, #AFFINE
    it ne
    addne r4, r4, r0
    mov r2, #4 * 19 * 4
    mul r5, r10, r2
    add r5, r5, r4
    sub r11, r11, #18 * 4
    mov r0, #1
    str r0, [sp, #F32A_FIRST]

@ r4 exponents, r5 weights, r6 output, r7 activations, r8 groups of outputs left, r10 groups of four centres left
2:
    f32_take_fours
    vldmia sp, {s0-s17}
    vldr s31, [sp, #F32_SHARED]
    bl taxel_f32_activations
    ldr r8, [sp, #F32A_ARGUMENTS + 8]
3:
    ldr r0, [sp, #F32A_FIRST]
    cmp r0, #0
    bne 4f
    vldmia r6, {s0-s17}
    b 5f
4:
    adr.w r1, 8f
    vldmia r1, {s0-s17}
    ldr r0, [sp, #F32A_ARGUMENTS]
    lsls r0, r0, #31 @ AFFINE
    beq 5f
    ldr r0, [sp, #F32A_AFFINE]
    add r1, r0, #18 * 4
    str r1, [sp, #F32A_AFFINE]
    mov r1, sp
    movs r3, #9
    bl f32_sums_apart
5:
    mov r0, r5
    mov r1, r7
    lsl r3, r9, #1
    bl f32_sums_apart
    cmp r10, #0
    bne 6f
    ldr r1, [sp, #F32_BIAS]
    add r0, r1, #18 * 4
    str r0, [sp, #F32_BIAS]
    with_eighteen vadd, r1
6:
    vstmia r6!, {s0-s17}
    add r5, r5, #18 * 4
    subs r8, #1
    bne 3b
    add r0, r11, #18 * 4
    sub r6, r6, r0
    sub r5, r5, r0
    lsl r1, r9, #2
    mla r5, r1, r0, r5
    movs r0, #0
    str r0, [sp, #F32A_FIRST]
    cmp r10, #0
    bne 2b
    vmrs r0, fpscr
    add sp, #F32A_FRAME
    vpop {s16-s31}
    pop {r4-r11, pc}
    .balign 4
8:
    .fill 18, 4, 0

@ s0..s17 += Σ_k weights_k·factors_k, weights at r0, lines of them 72 bytes and r11 apart, factors at r1,
@ 2·r3 of them.
f32_sums_apart:
    f32_two_centres_apart
    subs r3, #1
    bne f32_sums_apart
    bx lr
    .size taxel_f32_array, . - taxel_f32_array

@ ---------------------------------------------------------------------------------------------------------
@ 16-bit fixed point: two products an SMLAD, sixteen centres at a time.
@ ---------------------------------------------------------------------------------------------------------

    .equ FX_OUTPUT, 36
    .equ FX_SHARED, 40
    .equ FX_EXPONENTS, 44
    .equ FX_SIXTEENS, 52
    .equ FX_NEXT, 56
    .equ FX_SCALE, 60
    .equ FX_FRAME, 64
    .equ FX_ARGUMENTS, FX_FRAME + 16 * 4 + 9 * 4

@ r1 = one line of ten words at r0: the first, plus nine pairs times the inputs in r4..r12.
    .macro fixed16_exponent
    ldmia r0!, {r1, r2, r3, lr}
    smlad r1, r2, r4, r1
    smlad r1, r3, r5, r1
    smlad r1, lr, r6, r1
    fixed16_later_products
    .endm

    .macro fixed16_later_products
    ldmia r0!, {r2, r3, lr}
    smlad r1, r2, r7, r1
    smlad r1, r3, r8, r1
    smlad r1, lr, r9, r1
    ldmia r0!, {r2, r3, lr}
    smlad r1, r2, r10, r1
    smlad r1, r3, r11, r1
    smlad r1, lr, r12, r1
    .endm

@ \power = 2^-\exponent in Q15 by the cubic in r0, r1, r12, lr (fixed16.rs); \exponent is overwritten.
    .macro fixed16_power power, exponent, fraction
    ubfx \fraction, \exponent, #0, #26
    smmla \power, \fraction, r0, r1
    smmla \power, \fraction, \power, r12
    smmla \power, \fraction, \power, lr
    lsr \exponent, \exponent, #26
    lsr \power, \power, \exponent
    .endm

@ \pair = activations of two centres, whose exponents are \even + r11 and \odd + r11 (r11 is the shared term).
    .macro fixed16_pair even, odd, pair, scratch
    vmov r2, r3, \even, \odd
    add r2, r2, r11
    add r3, r3, r11
    fixed16_power \scratch, r2, \pair
    fixed16_power r2, r3, \pair
    pkhbt \pair, \scratch, r2, lsl #16
    .endm

@ \pair = the high halves of two inputs.
    .macro fixed16_input pair, even, odd
    vmov r1, r2, \even, \odd
    pkhtb \pair, r2, r1, asr #16
    .endm

@ r4..r12 = the inputs in pairs; \flags and r0 as `inputs` leaves them, r0 behind the units.
    .macro fixed16_inputs flags
    inputs \flags
    mov r0, r1
    fixed16_input r4, s0, s1
    fixed16_input r5, s2, s3
    fixed16_input r6, s4, s5
    fixed16_input r7, s6, s7
    fixed16_input r8, s8, s9
    fixed16_input r9, s10, s11
    fixed16_input r10, s12, s13
    fixed16_input r11, s14, s15
    fixed16_input r12, s16, s17
    .endm

@ [sp, #FX_SHARED] = the term that all exponents share; r0 moves on to the bias. r1..r3 are overwritten.
    .macro fixed16_shared
    movs r1, #0
    movs r2, #0
@ ‖x‖² is in r2:r1
    .irp x, r4, r5, r6, r7, r8, r9, r10, r11, r12
    smlald r1, r2, \x, \x
    .endr
    ldr r3, [r0], #4
    lsrs r1, r1, #4
    orr r1, r1, r2, lsl #28
    umull r1, r2, r1, r3
    lsrs r1, r1, #30
    orr r1, r1, r2, lsl #2
    str r1, [sp, #FX_SHARED]
    .endm

@ s0..s17 += the affine tail at r0; r0 moves past it.
    .macro fixed16_tail
    .irp sum, s0, s1, s2, s3, s4, s5, s6, s7, s8, s9, s10, s11, s12, s13, s14, s15, s16, s17
    vmov r1, \sum
    ldmia r0!, {r2, r3, lr}
    smlad r1, r2, r4, r1
    smlad r1, r3, r5, r1
    smlad r1, lr, r6, r1
    fixed16_later_products
    vmov \sum, r1
    .endr
    .endm

@ r4..r11 = activations of sixteen centres at r0; the address of their weights is kept at [sp, #FX_NEXT].
    .macro fixed16_activations
    .irp place, s18, s19, s20, s21, s22, s23, s24, s25, s26, s27, s28, s29, s30, s31
    fixed16_exponent
    vmov \place, r1
    .endr
    fixed16_exponent
    str r1, [sp, #FX_EXPONENTS]
    fixed16_exponent
    str r1, [sp, #FX_EXPONENTS + 4]
    str r0, [sp, #FX_NEXT]
    ldr r11, [sp, #FX_SHARED]
    adr.w r0, 9f
    ldmia r0, {r0, r1, r12, lr}
    fixed16_pair s18, s19, r4, r5
    fixed16_pair s20, s21, r5, r6
    fixed16_pair s22, s23, r6, r7
    fixed16_pair s24, s25, r7, r8
    fixed16_pair s26, s27, r8, r9
    fixed16_pair s28, s29, r9, r10
    fixed16_pair s30, s31, r10, r11
@ No register is left for the last two
    ldr r2, [sp, #FX_EXPONENTS]
    ldr r3, [sp, #FX_SHARED]
    add r2, r2, r3
    fixed16_power r3, r2, r11
    ldr r2, [sp, #FX_EXPONENTS + 4]
    ldr r11, [sp, #FX_SHARED]
    add r2, r2, r11
    ubfx r11, r2, #0, #26
    smmla r0, r11, r0, r1
    smmla r0, r11, r0, r12
    smmla r0, r11, r0, lr
    lsrs r2, r2, #26
    lsr r0, r0, r2
    pkhbt r11, r3, r0, lsl #16
    .endm

@ s0..s17 += the weights at r0 times the activations in r4..r11; r0 moves past the weights.
    .macro fixed16_sums
    .irp sum, s0, s1, s2, s3, s4, s5, s6, s7, s8, s9, s10, s11, s12, s13, s14, s15, s16, s17
    vmov r1, \sum
    ldmia r0!, {r2, r3, r12, lr}
    smlad r1, r2, r4, r1
    smlad r1, r3, r5, r1
    smlad r1, r12, r6, r1
    smlad r1, lr, r7, r1
    ldmia r0!, {r2, r3, r12, lr}
    smlad r1, r2, r8, r1
    smlad r1, r3, r9, r1
    smlad r1, r12, r10, r1
    smlad r1, lr, r11, r1
    vmov \sum, r1
    .endr
    .endm

@ u32 taxel_fixed16(inputs: *const f32 [18], block: *const u32, output: *mut f32 [18], sixteens: u32 ≥ 1,
@                    flags: u32)
@ output = (bias + A·x + Σ_k weights_k · 2^-(exponents_k[0] + exponents_k[1..]·x + decay·‖x‖²/2^34)) · scale,
@ with the parameters in the block as fixed16.rs says. Returns the FPSCR.
    function taxel_fixed16
    push {r4-r11, lr}
    vpush {s16-s31}
    sub sp, #FX_FRAME
    ldr lr, [sp, #FX_ARGUMENTS]
    str r2, [sp, #FX_OUTPUT]
    str r3, [sp, #FX_SIXTEENS]
    fixed16_inputs lr
    ldr r3, [sp, #FX_SIXTEENS]
    cmp r3, #1
    beq 3f
    stmia sp, {r4-r12}
3:
    fixed16_shared
    vldmia r0!, {s0-s17}
    str r0, [sp, #FX_SCALE]
    adds r0, #18 * 4
    lsls lr, lr, #31 @ AFFINE
    beq 1f
    fixed16_tail
1:
    fixed16_activations
    ldr r0, [sp, #FX_NEXT]
    fixed16_sums
    ldr r1, [sp, #FX_SIXTEENS]
    subs r1, #1
    beq 2f
    str r1, [sp, #FX_SIXTEENS]
    ldmia sp, {r4-r12}
    b.w 1b
2:
    .irp i, 0,1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17
    vcvt.f32.s32 s\i, s\i
    .endr
    ldr r1, [sp, #FX_SCALE]
    ldr r2, [sp, #FX_OUTPUT]
    with_eighteen vmul, r1
    vmrs r0, fpscr
    vstmia r2, {s0-s17}
    add sp, #FX_FRAME
    vpop {s16-s31}
    pop {r4-r11, pc}
    .balign 4
9:
    .word -335049012, 30875674, -1449129, 32766
    .size taxel_fixed16, . - taxel_fixed16

@ u32 taxel_fixed16_array(inputs: *const f32 [18], block: *const u32, output: *mut f32 [18·groups],
@                         sixteens: u32 ≥ 1, flags: u32, groups: u32 ≥ 1)
@ Computes what taxel_fixed16 does, for several groups of 18 outputs; sums are kept in the outputs meanwhile.
@ Three outputs at a time: an output costs a tenth more than with all sums in registers, and the code is a third
@ as long.
    .equ FXA_END, FX_FRAME
    .equ FXA_FRAME, FX_FRAME + 8
    .equ FXA_ARGUMENTS, FXA_FRAME + 16 * 4 + 9 * 4

@ r1 += the eight pairs at r0 times those in r4..r11; r0 moves past its pairs.
    .macro fixed16_eight_pairs
    ldmia r0!, {r2, r3}
    smlad r1, r2, r4, r1
    smlad r1, r3, r5, r1
    ldmia r0!, {r2, r3}
    smlad r1, r2, r6, r1
    smlad r1, r3, r7, r1
    ldmia r0!, {r2, r3}
    smlad r1, r2, r8, r1
    smlad r1, r3, r9, r1
    ldmia r0!, {r2, r3}
    smlad r1, r2, r10, r1
    smlad r1, r3, r11, r1
    .endm

    function taxel_fixed16_array
    push {r4-r11, lr}
    vpush {s16-s31}
    sub sp, #FXA_FRAME
    ldr lr, [sp, #FXA_ARGUMENTS]
    str r2, [sp, #FX_OUTPUT]
    str r3, [sp, #FX_SIXTEENS]
    fixed16_inputs lr
    stmia sp, {r4-r12}
    fixed16_shared
@ Bias at r0, scale, tail
    ldr r2, [sp, #FXA_ARGUMENTS + 4]
    ldr r1, [sp, #FX_OUTPUT]
    mov r3, #18 * 4
    mul r3, r3, r2
    add r2, r1, r3
    str r2, [sp, #FXA_END]
1:
    vldmia r0!, {s0-s17}
    vstmia r1!, {s0-s17}
    cmp r1, r2
    bne 1b
    str r0, [sp, #FX_SCALE]
    add r0, r0, r3
    ldr r1, [sp, #FXA_ARGUMENTS]
    ldr lr, [sp, #FX_OUTPUT]
    lsls r1, r1, #31 @ AFFINE
    beq 3f
2:
    .irp output, 0, 4, 8
    ldr r1, [lr, #\output]
    fixed16_eight_pairs
    ldr r2, [r0], #4
    smlad r1, r2, r12, r1
    str r1, [lr, #\output]
    .endr
    ldr r2, [sp, #FXA_END]
    add lr, lr, #12
    cmp lr, r2
    bne 2b
3:
    ldmia sp, {r4-r12}
    fixed16_activations
    ldr r0, [sp, #FX_NEXT]
    ldr r12, [sp, #FX_OUTPUT]
    ldr lr, [sp, #FXA_END]
4:
    .irp output, 0, 4, 8
    ldr r1, [r12, #\output]
    fixed16_eight_pairs
    str r1, [r12, #\output]
    .endr
    add r12, r12, #12
    cmp r12, lr
    bne 4b
    ldr r1, [sp, #FX_SIXTEENS]
    subs r1, #1
    str r1, [sp, #FX_SIXTEENS]
    bne.w 3b
    ldr r1, [sp, #FX_SCALE]
    ldr r2, [sp, #FX_OUTPUT]
5:
    vldmia r2, {s0-s17}
    .irp i, 0,1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17
    vcvt.f32.s32 s\i, s\i
    .endr
    mov r0, r1
    with_eighteen vmul, r0
    add r1, r1, #18 * 4
    vstmia r2!, {s0-s17}
    cmp r2, lr
    bne 5b
    vmrs r0, fpscr
    add sp, #FXA_FRAME
    vpop {s16-s31}
    pop {r4-r11, pc}
    .balign 4
9:
    .word -335049012, 30875674, -1449129, 32766
    .size taxel_fixed16_array, . - taxel_fixed16_array

@ ---------------------------------------------------------------------------------------------------------
@ Gate. In assembly because the compiler loads number by number (2 cycles each; 7 for six at once) and saves
@ registers.
@ ---------------------------------------------------------------------------------------------------------

@ One reading: s1 += \reading - \rest, s2 += tolerance * \rest; branches away if the first difference is larger
@ than the second, or NaN.
    .macro gate_reading reading, rest
    vsub.f32 \reading, \reading, \rest
    vmul.f32 \rest, \rest, s0
    vadd.f32 s1, s1, \reading
    vabs.f32 \reading, \reading
    vadd.f32 s2, s2, \rest
    vcmp.f32 \reading, \rest
    vmrs APSR_nzcv, fpscr
    bhi 9f
    .endm

@ u32 taxel_give_rest(readings: *const f32 [18], baseline: *const f32 [18], rest: *const f32 [18],
@                     outputs: *mut f32 [18], tolerance: f32)
@ Copies rest to outputs and returns 1 if the readings are at rest, as gate.rs defines it; else returns 0.
    function taxel_give_rest
    mov r12, #0
    vmov s1, r12
    vmov s2, r12
    .rept 3
    vldmia r0!, {s4-s9}
    vldmia r1!, {s10-s15}
    gate_reading s4, s10
    gate_reading s5, s11
    gate_reading s6, s12
    gate_reading s7, s13
    gate_reading s8, s14
    gate_reading s9, s15
    .endr
    vmov.f32 s3, #18.0
    vmul.f32 s1, s1, s1
    vmul.f32 s2, s2, s2
    vmul.f32 s1, s1, s3
    vcmp.f32 s1, s2
    vmrs APSR_nzcv, fpscr
    bhi 9f
    vldmia r2!, {s0-s15}
    vstmia r3!, {s0-s15}
    vldmia r2, {s0-s1}
    vstmia r3, {s0-s1}
    movs r0, #1
    bx lr
9:
    movs r0, #0
    bx lr
    .size taxel_give_rest, . - taxel_give_rest
