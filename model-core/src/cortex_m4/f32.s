
@ ---------------------------------------------------------------------------------------------------------
@ f32, expanded distance. VMUL and VADD (1 cycle each) rather than VFMA (3), in an order that hardly ever uses a
@ result in the very next instruction. Partial sums i = 0..3 take the products of inputs i, i + 4, i + 8, …
@
@ Where a line of an odd length is filled up with inputs of zero, what is read beyond it is finite, and adds ±0.
@ ---------------------------------------------------------------------------------------------------------

@ Most groups of four centres of a batch: 512 bytes of stack
    .equ F32_MOST, 32

    .equ F32_OUTPUT, 0
    .equ F32_OUTPUTS, 4
    .equ F32_X, 8 @ address of the inputs in units
    .equ F32_INPUTS, 12
    .equ F32_BIAS, 16
    .equ F32_TAIL, 20 @ the tail, or 0 if there is none or it is done
    .equ F32_STARTED, 24 @ whether the sums so far are in the output
    .equ F32_SHARED, 28
    .equ F32_NEXT, 32 @ the next batch's exponents
    .equ F32_ACTIVATIONS, 36
    .equ F32_FRAME, F32_ACTIVATIONS + F32_MOST * 16

@ Exponent of one centre of 18 inputs, but for the last addition, s18 + s19. The first half of its line is in s20..s29.
    .macro f32_first_half
    each 9, vmul, 21, 21, 0
    .endm

@ s18..s21 become the four partial sums.
    .macro f32_second_half
    vadd.f32 s18, s20, s21
    vadd.f32 s19, s31, s22
    vadd.f32 s20, s23, s27
    vadd.f32 s21, s24, s28
    each 2, vadd, 18, 18, 25
    vadd.f32 s18, s18, s29
    vldmia r1!, {s22-s30}
    each 9, vmul, 22, 22, 9
    each 3, vadd, 19, 19, 22
    each 3, vadd, 18, 18, 25
    each 2, vadd, 18, 18, 29
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

@ Exponent of one centre of 4, 8 or 12 inputs, but for the last addition, s18 + s21.
    .macro f32_centre inputs
    load_from_18 1 + \inputs, r1
    each \inputs, vmul, 19, 19, 0
    vadd.f32 s18, s18, s19
    vadd.f32 s20, s31, s20
    .if \inputs >= 8
    each 2, vadd, 21, 21, 25
    vadd.f32 s18, s18, s23
    vadd.f32 s20, s20, s24
    .endif
    .if \inputs == 12
    each 2, vadd, 21, 21, 29
    vadd.f32 s18, s18, s27
    vadd.f32 s20, s20, s28
    .endif
    vadd.f32 s21, s21, s22
    vadd.f32 s18, s18, s20
    .endm

@ Exponent of one centre of 16 inputs, but for the last addition, s18 + s28.
    .macro f32_centre_of_16
    vldmia r1!, {s18-s26}
    each 8, vmul, 19, 19, 0
    vadd.f32 s18, s18, s19
    vadd.f32 s27, s31, s20
    each 2, vadd, 28, 21, 25
    vadd.f32 s18, s18, s23
    vadd.f32 s27, s27, s24
    vldmia r1!, {s19-s26}
    each 8, vmul, 19, 19, 8
    vadd.f32 s18, s18, s19
    each 3, vadd, 27, 27, 20
    vadd.f32 s18, s18, s23
    each 3, vadd, 27, 27, 24
    vadd.f32 s28, s28, s29
    vadd.f32 s18, s18, s27
    .endm

@ Exponents of two centres, by turns.
    .macro f32_centres inputs
    .if \inputs == 16
    f32_centre_of_16
    add r1, r1, r12
    vadd.f32 s17, s18, s28
    f32_centre_of_16
    subs r3, #1
    vadd.f32 s18, s18, s28
    .else
    f32_centre \inputs
    add r1, r1, r12
    vadd.f32 s17, s18, s21
    f32_centre \inputs
    subs r3, #1
    vadd.f32 s18, s18, s21
    .endif
    add r1, r1, r12
    vstmia r2!, {s17-s18}
    .endm

@ Four inputs from r12 on, for two centres at r1 and r8
    .macro f32_four_inputs
    vldmia r12!, {s0-s3}
    vldmia r1!, {s4-s7}
    vldmia r8!, {s8-s11}
    f32_four_products 0
    .endm
    .equ F32_FOUR_INPUTS_BYTES, 76

@ The same for four inputs in s\inputs and behind, whose coefficients are in s4..s11
    .macro f32_four_products inputs
    each 4, vmul, 4, 4, \inputs
    each 4, vmul, 8, 8, \inputs
    each 8, vadd, 16, 16, 4
    .endm

@ s0.. += \outputs weights at r0, times \factor; r0 moves to the next line, r11 further.
    .macro f32_line outputs, factor
    .if \outputs == 18
    vldmia r0!, {s18-s29}
    each_with 12, vmul, 18, 18, \factor
    each 12, vadd, 0, 0, 18
    vldmia r0!, {s18-s23}
    add r0, r0, r11
    each_with 6, vmul, 18, 18, \factor
    each 6, vadd, 12, 12, 18
    .else
    load_from_18 \outputs, r0
    add r0, r0, r11
    each_with \outputs, vmul, 18, 18, \factor
    each \outputs, vadd, 0, 0, 18
    .endif
    .endm

@ s0.. += Σ over r3 lines of \outputs weights at r0, times the factors at r1. Returns.
    .macro f32_sums outputs
    lsrs r3, r3, #1
    bcc 1f
    vldmia r1!, {s31}
    adds r3, #1
    b 2f
1:
    vldmia r1!, {s30-s31}
    f32_line \outputs, s30
2:
    f32_line \outputs, s31
    subs r3, #1
    bne 1b
    bx lr
    .endm

@ As f32_sums, for an even number of lines that follow each other without gaps; goes on for any other.
    .macro f32_sums_of_line outputs
    orrs r2, r11, r3, lsl #31
    bne 3f
    lsrs r3, r3, #1
1:
    vldmia r1!, {s30-s31}
    load_from_18 2 * \outputs, r0
    each_with \outputs, vmul, 18, 18, s30
    each_with \outputs, vmul, 18 + \outputs, 18 + \outputs, s31
    each \outputs, vadd, 0, 0, 18
    each \outputs, vadd, 0, 0, 18 + \outputs
    subs r3, #1
    bne 1b
    bx lr
3:
    .endm

@ s0..s17 += two lines of 18 weights at r0, each times its factor at r1.
    .macro f32_two_centres
    vldmia r1!, {s30-s31}
    vldmia r0!, {s18-s29}
    each_with 12, vmul, 18, 18, s30
    each 12, vadd, 0, 0, 18
    vldmia r0!, {s18-s29}
    each_with 6, vmul, 18, 18, s30
    each_with 6, vmul, 24, 24, s31
    each 6, vadd, 12, 12, 18
    each 6, vadd, 0, 0, 24
    vldmia r0!, {s18-s29}
    each_with 12, vmul, 18, 18, s31
    each 12, vadd, 6, 6, 18
    .endm

@ One input of an array whose length is no multiple of four: its square is added to \sum.
    .macro f32_last_input sum
    subs r4, #1
    blo 9f
    vldmia r0!, {s0}
    cmp r3, #0
    bne 1f
    vldmia r8!, {s4}
    vldmia r9!, {s8}
    vsub.f32 s0, s0, s4
    vmul.f32 s0, s0, s8
1:
    vcvt.s32.f32 s0, s0
    vcvt.f32.s32 s0, s0
    vmul.f32 s4, s0, s0
    vstmia r12!, {s0}
    vadd.f32 \sum, \sum, s4
    .endm

@ u32 taxel_f32(block: *const Block, inputs: *const f32 [inputs], output: *mut f32 [outputs],
@               space: *mut f32 [inputs])
@ output = A·x + Σ_k weights_k · 2^(exponents_k[0] + exponents_k[1..]·x − decay·‖x‖²) + bias, with the
@ parameters in the block's words as expanded.rs says. Returns the FPSCR. `space` may be the inputs; it is odd (one
@ byte beyond) if they are scaled already.
    function taxel_f32
    push {r4-r11, lr}
    vpush {s16-s31}
    sub sp, #F32_FRAME
    ldm r0, {r4-r8} @ inputs, centres, outputs, form, words
    mov r0, r1
    mov r1, r2
    clear_invalid_operation r2
    adds r5, #3
    lsr r10, r5, #2
    cmp r7, #1 @ AFFINE
    bhi.w f32_frame
@ 18 inputs and outputs, one batch
    mov r6, r1
    add r4, r8, #36 * 4
    add r5, r4, #19 * 4
    mov r9, r10
    bne 1f
    bic r12, r3, #1
    add r5, r5, #18 * 18 * 4
1:
    lsls r3, r3, #31

@ 18 inputs
f32_eighteen:
    vldmia r0, {s0-s17}
    bne 2f
    with_eighteen vsub, r8
    with_eighteen vmul, r8
2:
    convert 18, 0, s32, f32
    convert 18, 0, f32, s32
    vldr s30, [r4]
@ ‖x‖² in four partial sums
    each 8, vmul, 18, 0, 0
    each 4, vadd, 18, 18, 22
    each 4, vmul, 22, 8, 8
    each 4, vadd, 18, 18, 22
    each 4, vmul, 22, 12, 12
    each 4, vadd, 18, 18, 22
    each 2, vmul, 22, 16, 16
    vadd.f32 s20, s20, s21
    each 2, vadd, 18, 18, 22
    mov r1, r5
    vadd.f32 s18, s18, s19
    mov r0, #4 * 19 * 4
    vadd.f32 s18, s18, s20
    mla r5, r10, r0, r5
    vnmul.f32 s31, s30, s18
    cmp r7, #0
    bne f32_keep
f32_start_of_18:
    add r2, sp, #F32_ACTIVATIONS
    mov r3, r9
@ r1 = exponents, r2 = activations, r3 = r9 = groups of four centres now, r5 weights, r10 groups left
f32_exponents_of_18:
    vldmia r1!, {s20-s29}
    f32_first_half
    f32_second_half
    f32_next_centre
    f32_next_centre
    f32_next_centre
    subs r3, #1
    vadd.f32 s18, s18, s19
    vstmia r2!, {s18}
    bne f32_exponents_of_18

@ Powers of two, four at once: constants in s16..s22
f32_powers:
    str r1, [sp, #F32_NEXT]
    adr.w r2, f32_constants
    vldmia r2, {s16-s22}
    add r2, sp, #F32_ACTIVATIONS
    mov r3, r9
taxel_f32_powers: @ to its end: what one exponential costs is counted here
4:
    vldmia r2, {s0-s3}
    each_with 4, vadd, 4, 0, s22
    each_with 4, vsub, 8, 4, s22
    each 4, vsub, 0, 0, 8
    each_with 4, vmul, 8, 0, s16
    .irp constant, s17, s18, s19, s20
    each_with 4, vadd, 8, 8, \constant
    each 4, vmul, 8, 8, 0
    .endr
    each_with 4, vadd, 8, 8, s21
    vmov r0, r1, s8, s9
    vmov r12, lr, s4, s5
    add r0, r0, r12, lsl #23
    add r1, r1, lr, lsl #23
    vmov r8, r11, s10, s11
    vmov r12, lr, s6, s7
    add r8, r8, r12, lsl #23
    add r11, r11, lr, lsl #23
    subs r3, #1
    stmia r2!, {r0, r1, r8, r11}
    bne 4b
taxel_f32_powers_end:

    cmp r7, #1
    bhi 1f
    adr.w r0, f32_zeros
    vldmia r0, {s0-s17}
    bne 2f
    add r0, r4, #19 * 4
    mov r1, r10
    movs r3, #9
    bl f32_sums_of_18
2:
    mov r0, r5
    add r1, sp, #F32_ACTIVATIONS
    lsl r3, r9, #1
    bl f32_sums_of_18
    adds r0, r4, #4
    with_eighteen vadd, r0
    vmrs r0, fpscr
    vstmia r6, {s0-s17}
    add sp, #F32_FRAME
    vpop {s16-s31}
    pop {r4-r11, pc}
@ To be used again
f32_keep:
    vstmia r12, {s0-s17}
    cmp r7, #1
    itt eq
    moveq r10, r12
    beq f32_start_of_18
    vstr s31, [sp, #F32_SHARED]
f32_batch_of_18:
    mov r9, r10
    cmp r10, #F32_MOST
    it hi
    movhi r9, #F32_MOST
    sub r10, r10, r9
    b f32_start_of_18

@ Sums of all outputs, in groups; r6 = bytes of outputs that are done
1:
    mov r6, #0
5:
    ldrd r1, r2, [sp, #F32_OUTPUT]
    ldr r3, [sp, #F32_STARTED]
    sub r2, r2, r6, lsr #2
    mov r8, #18
    cmp r2, #18
    blo 1f @ fewer
2:
    ldr r7, [sp, #F32_OUTPUTS]
    sub r11, r7, r8
    lsl r11, r11, #2
    cmp r3, #0
    bne f32_load
    adr.w r1, f32_zeros
    vldmia r1, {s0-s17}
    ldr r0, [sp, #F32_TAIL]
    cbz r0, f32_add
    add r0, r0, r6
    ldrd r1, r3, [sp, #F32_X]
    bl f32_sums
f32_add:
    add r0, r5, r6
    add r1, sp, #F32_ACTIVATIONS
    lsl r3, r9, #2
    bl f32_sums
    cmp r10, #0
    bne f32_store
    ldr r0, [sp, #F32_BIAS]
    add r0, r0, r6
    ldr r1, [sp, #F32_OUTPUT]
    add r1, r1, r6
    cmp r8, #18
    bne f32_finish
    with_eighteen vadd, r0
    vstmia r1, {s0-s17}
f32_stored:
    add r6, r6, r8, lsl #2
    cmp r6, r7, lsl #2
    blo 5b
    cmp r10, #0
    bne f32_next_batch
    vmrs r0, fpscr
    add sp, #F32_FRAME
    vpop {s16-s31}
    pop {r4-r11, pc}
    .balign 4

f32_constants:
    .word 0x3aaca793 @ 2^f: degree 5 to 0; EXP2_COEFFICIENTS of exp.rs, which a test compares
    .word 0x3c1e7a2a
    .word 0x3d635f2b
    .word 0x3e75fccd
    .word 0x3f317210
    .word 0x3f800000
    .word 0x4b400000 @ 1.5·2^23: adding it rounds to the nearest integer
f32_zeros:
    .fill 18, 4, 0
1:
    bl f32_width
    b 2b
@ The sums so far
f32_load:
    add r1, r1, r6
    mov r2, r8
    bl taxel_load
    b f32_add
f32_store:
    ldr r1, [sp, #F32_OUTPUT]
    add r1, r1, r6
    mov r2, r8
    bl taxel_store
    b f32_stored
@ The first r8 of s0..s5 plus the bias at r0, to r1
f32_finish:
    add r0, r0, r8, lsl #2
    add r1, r1, r8, lsl #2
    adr r3, 1f + 1
    add r2, r8, r8, lsl #1
    sub r3, r3, r2, lsl #2
    bx r3
    .balign 4
    .irp i, 5,4,3,2,1,0
    vldmdb r0!, {s18}
    vadd.f32 s\i, s\i, s18
    vstmdb r1!, {s\i}
    .endr
1:
    b f32_stored

f32_next_batch:
    movs r1, #1
    str r1, [sp, #F32_STARTED]
    lsl r0, r9, #4
    mla r5, r0, r7, r5
    movs r7, #2 @ OTHER_SIZES, if nothing else
    ldrd r1, r2, [sp, #F32_X]
    cmp r2, #18
    bne f32_batch
    vldmia r1, {s0-s17}
    vldr s31, [sp, #F32_SHARED]
    ldr r1, [sp, #F32_NEXT]
    b f32_batch_of_18

@ Any other network: what is used again is kept in the frame
f32_frame:
    bic r12, r3, #1
    strd r1, r6, [sp, #F32_OUTPUT]
    strd r12, r4, [sp, #F32_X]
    add r9, r8, r4, lsl #2 @ units
    add r11, r9, r4, lsl #2 @ decay
    add r2, r11, #4
    add r5, r2, r6, lsl #2
    lsls r1, r7, #31 @ AFFINE
    mov r1, #0
    beq 1f
    mov r1, r5
    mul lr, r4, r6
    add r5, r5, lr, lsl #2
1:
    strd r2, r1, [sp, #F32_BIAS]
    mov lr, #0
    str lr, [sp, #F32_STARTED]
    cmp r4, #18
    bne f32_any
    mov r4, r11
    lsls r3, r3, #31 @ scaled?
    b.w f32_eighteen

@ Other numbers of inputs: r5 = exponents, r11 = decay
f32_any:
    lsls r3, r3, #31 @ scaled?
    vmov s24, s25, lr, lr
    vmov s26, s27, lr, lr
    subs r4, #4
    blo 3f
2:
    vldmia r0!, {s0-s3}
    cbnz r3, 1f
    vldmia r8!, {s4-s7}
    vldmia r9!, {s8-s11}
    each 4, vsub, 0, 0, 4
    each 4, vmul, 0, 0, 8
1:
    convert 4, 0, s32, f32
    convert 4, 0, f32, s32
    each 4, vmul, 4, 0, 0
    each 4, vadd, 24, 24, 4
    vstmia r12!, {s0-s3}
    subs r4, #4
    bhs 2b
3:
    adds r4, #4
    f32_last_input s24
    f32_last_input s25
    f32_last_input s26
9:
    vldr s30, [r11]
    vadd.f32 s24, s24, s25
    vadd.f32 s26, s26, s27
    ldr r1, [sp, #F32_INPUTS]
    vadd.f32 s24, s24, s26
    adds r1, #1
    vnmul.f32 s31, s30, s24
    mul r1, r1, r10
    vstr s31, [sp, #F32_SHARED]
    str r5, [sp, #F32_NEXT]
    add r5, r5, r1, lsl #4

@ A batch of any other number of inputs; r10 = groups of four centres left
f32_batch:
    mov r9, r10
    cmp r10, #F32_MOST
    it hi
    movhi r9, #F32_MOST
    sub r10, r10, r9
    adr.w r1, f32_zeros
    vldmia r1, {s0-s15}
    ldrd r1, r2, [sp, #F32_X]
    mov r6, r2
    cmp r2, #16
    bhi 1f
    bl taxel_load
    vldr s31, [sp, #F32_SHARED]
    adds r0, r6, #3
    lsrs r0, r0, #2
    sub r12, r6, r0, lsl #2
    lsl r12, r12, #2
    ldr r1, [sp, #F32_NEXT]
    add r2, sp, #F32_ACTIVATIONS
    lsl r3, r9, #1
    cmp r0, #2
    blo f32_exponents_4
    beq f32_exponents_8
    cmp r0, #3
    beq f32_exponents_12
@ Exponents of up to 16 inputs, filled up to a multiple of four
    .irp inputs, 16, 12, 8, 4
f32_exponents_\inputs:
    f32_centres \inputs
    bne f32_exponents_\inputs
    b.w f32_powers
    .endr

@ Exponents of 17, 19 or more inputs, which stream by for two centres at once, but for the last 1 to 4
1:
    mov r7, r1
    subs r3, r2, #1
    lsrs r0, r3, #2 @ fours that stream by
    add r1, r1, r0, lsl #4
    sub r2, r2, r0, lsl #2
    bl taxel_load
    vmov.f32 s24, s0
    vmov.f32 s25, s1
    vmov.f32 s26, s2
    vmov.f32 s27, s3
    vmov.f32 s28, s15 @ 0
    vldr s31, [sp, #F32_SHARED]
    ldr r1, [sp, #F32_NEXT]
    mov r4, r7
    adds r2, r0, #1
    lsls r2, r2, #4
    sub r11, r2, r6, lsl #2 @ bytes that are read beyond a line
    adds r7, r6, #1
    lsls r7, r7, #2 @ bytes of a line
    adds r6, r0, #3
    lsrs r6, r6, #2 @ passes over four fours
    rsb r0, r0, r6, lsl #2
    movs r2, #F32_FOUR_INPUTS_BYTES
    adr r3, 2f + 1
    mla r0, r0, r2, r3
    add r2, sp, #F32_ACTIVATIONS
    lsl r3, r9, #1
1:
    add r8, r1, r7
    vldmia r1!, {s16}
    vldmia r8!, {s20}
    vmov.f32 s17, s31
    vmov.f32 s21, s31
    vmov.f32 s18, s28
    vmov.f32 s19, s28
    vmov.f32 s22, s28
    vmov.f32 s23, s28
    mov r12, r4
    mov lr, r6
    bx r0
    .balign 4
2:
    f32_four_inputs
    f32_four_inputs
    f32_four_inputs
    f32_four_inputs
    subs lr, #1
    bne 2b
    vldmia r1!, {s4-s7}
    vldmia r8!, {s8-s11}
    f32_four_products 24
    vadd.f32 s16, s16, s17
    vadd.f32 s20, s20, s21
    vadd.f32 s18, s18, s19
    vadd.f32 s22, s22, s23
    vadd.f32 s16, s16, s18
    vadd.f32 s17, s20, s22
    sub r1, r8, r11
    vstmia r2!, {s16-s17}
    subs r3, #1
    bne 1b
    b.w f32_powers
    .size taxel_f32, . - taxel_f32

@ r8 = how many of r2 outputs (1 or more) the next sums take
    function f32_width
    mov r8, r2
    cmp r2, #6
    bls 1f
    mov r8, #6
    cmp r2, #18
    blo 1f
    mov r8, #18
1:
    bx lr
    .size f32_width, . - f32_width

@ The first r8 (of f32_width) of s0..s17 += Σ over r3 lines (1 or more) of weights at r0, times the factors at r1.
@ A line begins r11 bytes behind the weights of the last one. r0 to r3 and s18..s31 are overwritten.
    function f32_sums
    cmp r8, #18
    bne f32_sums_of_few
    cmp r11, #0
    bne 1f
    lsls r8, r3, #31 @ odd?
    mov r8, #18
    bne 1f
    lsrs r3, r3, #1
    .thumb_func
f32_sums_of_18:
    lsrs r3, r3, #1
    bcc 2f
    adds r3, #1
    b 3f
2:
    f32_two_centres
3:
    f32_two_centres
    subs r3, #1
    bne 2b
    bx lr
1:
    f32_sums 18
f32_sums_of_few:
    tbh [pc, r8, lsl #1]
3:
    .short 0
    .short (f32_sums_1 - 3b) / 2
    .short (f32_sums_2 - 3b) / 2
    .short (f32_sums_3 - 3b) / 2
    .short (f32_sums_4 - 3b) / 2
    .short (f32_sums_5 - 3b) / 2
    .short (f32_sums_6 - 3b) / 2
    .irp outputs, 1, 2, 3, 4, 5, 6
f32_sums_\outputs:
    .if \outputs >= 4
    f32_sums_of_line \outputs
    .endif
    f32_sums \outputs
    .endr
    .size f32_sums, . - f32_sums

@ ---------------------------------------------------------------------------------------------------------
@ Projection of a frame to features.
@ ---------------------------------------------------------------------------------------------------------

@ void taxel_project(readings: *const f32 [count], block: *const f32 [features · (1 + count)],
@                    features: *mut f32 [features], count: u32 ≥ 1, features: u32 ≥ 1)
@ features = f₀ + Σ_j readings_j · p_j, with the parameters in the block as projection.rs says.
    function taxel_project
    push {r4-r11, lr}
    vpush {s16-s31}
    ldr r7, [sp, #16 * 4 + 9 * 4]
    mov r4, r0
    mov r5, r1
    mov r6, r2
    mov r9, r3
    add r10, r1, r7, lsl #2
    mov r12, r7
1:
    mov r2, r12
    bl f32_width
    sub r11, r7, r8
    lsl r11, r11, #2
    mov r1, r5
    mov r2, r8
    bl taxel_load
    mov r0, r10
    mov r1, r4
    mov r3, r9
    bl f32_sums
    mov r1, r6
    mov r2, r8
    bl taxel_store
    add r5, r5, r8, lsl #2
    add r6, r6, r8, lsl #2
    add r10, r10, r8, lsl #2
    subs r12, r12, r8
    bne 1b
    vpop {s16-s31}
    pop {r4-r11, pc}
    .size taxel_project, . - taxel_project
