
@ ---------------------------------------------------------------------------------------------------------
@ 16-bit fixed point: two products an SMLAD, sixteen centres at a time.
@
@ A batch's exponents are put on the stack, the last centre's lowest; by STR, because PUSH takes a cycle more. They
@ are turned into activations in place, packed in pairs. The sums then take the centres from the last to the first,
@ which makes no difference to integers.
@ ---------------------------------------------------------------------------------------------------------

@ Most centres of a batch: 1 KiB of stack
    .equ FX_MOST, 256

@ Frame of networks of other sizes
    .equ FX_PAIRS, 0 @ pairs of up to 18 inputs, and zeros behind them
    .equ FX_X, 48 @ address of the pairs of inputs
    .equ FX_P, 52 @ number of them
    .equ FX_BIAS, 56
    .equ FX_OUTPUTS, 60
    .equ FX_OUTPUT, 64
    .equ FX_CENTRES, 68 @ centres that are left
    .equ FX_FORM, 72 @ form; then the end of the tail of nine pairs
    .equ FX_STATE, 76 @ inputs; then where sums start: 0 bias, 1 output, 2 bias and tail of nine pairs
    .equ FX_GROUP, 80 @ number of the first output of a group, and how many it has
    .equ FX_ENTRY, 88 @ where the first of the sums is, and by how much the weights end before the batch's words
    .equ FX_FRAME, 96

@ What the loops need is in registers that they do not use otherwise:
@   s18 end of the batch on the stack    s19 bytes of the weights of sixteen centres
@   s20 what comes behind the sums
@   s21 bytes from the weights of sixteen centres back to those before    s22 where the first of the sums is
@   s23 activations to come    s24 end of the activations
@   s25 frame    s26 term that all exponents share
@   s27 words behind the batch
@ Until the powers, s27 is the batch's words, and s24 the end of sixteen exponents on the stack.
@ For many inputs, which stream by, and until the powers:
@   s24 words behind the batch
@   s28 end of the pairs of inputs    s29 bytes that the tail's lines are read too far; then pairs of inputs to come
@   s30 bytes from the first eight pairs of a line to the next line    s31 and from eight pairs more

@ r1 += the pairs in \weights, times those in r\first and the registers behind it (before it if \step is -1).
    .macro fixed16_products first, step, weights:vararg
    .altmacro
    .set done, 0
    .irp weight, \weights
    fixed16_product \weight, %(\first + done)
    .set done, done + \step
    .endr
    .noaltmacro
    .endm

    .macro fixed16_product weight, number
    smlad r1, \weight, r\number, r1
    .endm

@ r1 = one line at r0: a number, and as many pairs times those from r4 on. r2, r3, lr are overwritten, and the
@ registers between the inputs and lr.
    .macro fixed16_line pairs
    .if \pairs == 1
    ldmia r0!, {r1, r2}
    fixed16_products 4, 1, r2
    .elseif \pairs == 2
    ldmia r0!, {r1, r2, r3}
    fixed16_products 4, 1, r2, r3
    .elseif \pairs == 3
    ldmia r0!, {r1, r2, r3, lr}
    fixed16_products 4, 1, r2, r3, lr
    .elseif \pairs == 4
    ldmia r0!, {r1, r2, r3, r12, lr}
    fixed16_products 4, 1, r2, r3, r12, lr
    .elseif \pairs == 5
    ldmia r0!, {r1, r2, r3, r11, r12, lr}
    fixed16_products 4, 1, r2, r3, r11, r12, lr
    .elseif \pairs == 6
    ldmia r0!, {r1, r2, r3, r10, r11, r12, lr}
    fixed16_products 4, 1, r2, r3, r10, r11, r12, lr
    .elseif \pairs == 7
    ldmia r0!, {r1, r2, r3, r11, r12, lr}
    fixed16_products 4, 1, r2, r3, r11, r12, lr
    ldmia r0!, {r2, r3}
    fixed16_products 9, 1, r2, r3
    .elseif \pairs == 8
    ldmia r0!, {r1, r2, r3, r12, lr}
    fixed16_products 4, 1, r2, r3, r12, lr
    ldmia r0!, {r2, r3, r12, lr}
    fixed16_products 8, 1, r2, r3, r12, lr
    .elseif \pairs == 9
    ldmia r0!, {r1, r2, r3, lr}
    fixed16_products 4, 1, r2, r3, lr
    ldmia r0!, {r2, r3, lr}
    fixed16_products 7, 1, r2, r3, lr
    ldmia r0!, {r2, r3, lr}
    fixed16_products 10, 1, r2, r3, lr
    .endif
    .endm

@ Puts the exponents of a batch on the stack, of up to eight pairs of inputs at r1, and goes on to the powers.
@ r0 = the batch's words.
    .macro fixed16_exponents pairs
    .irp i, 4,5,6,7,8,9,10,11
    .if \i < 4 + \pairs
    ldr r\i, [r1, #\i * 4 - 16]
    .endif
    .endr
1:
    sub r1, sp, #16 * 4
    vmov s24, r1
2:
    .if \pairs <= 4 || \pairs == 6
    sub sp, #4 * 4
    fixed16_line \pairs
    str r1, [sp, #12]
    fixed16_line \pairs
    str r1, [sp, #8]
    .else
    sub sp, #2 * 4
    .endif
    fixed16_line \pairs
    str r1, [sp, #4]
    fixed16_line \pairs
    str r1, [sp]
    vmov r2, s24
    cmp sp, r2
    bne 2b
    vmov r1, r2, s18, s19
    add r0, r0, r2
    cmp sp, r1
    bne 1b
    b.w fixed16_powers
    .endm

@ Adds the products of eight pairs at r0 and those in r4..r11 to an exponent, \place places before r12.
    .macro fixed16_eight_more place
    ldr r1, [r12, #-\place * 4]
    ldmia r0!, {r2, r3, lr}
    fixed16_products 4, 1, r2, r3, lr
    ldmia r0!, {r2, r3, lr}
    fixed16_products 7, 1, r2, r3, lr
    ldmia r0!, {r2, r3}
    fixed16_products 10, 1, r2, r3
    vmov lr, s31
    add r0, lr
    str r1, [r12, #-\place * 4]
    .endm

@ \pair = the high halves of two inputs, whose squares are added to \high:\low.
    .macro fixed16_input pair, even, odd, low, high
    vmov r1, r2, \even, \odd
    pkhtb \pair, r2, r1, asr #16
    smlald \low, \high, \pair, \pair
    .endm

@ \exponent = 2^-(\exponent + r12) in Q15 by the cubic in r8..r11 (fixed16.rs). r2 and r3 are overwritten.
    .macro fixed16_power exponent
    add \exponent, \exponent, r12
    ubfx r2, \exponent, #0, #26
    smmla r3, r2, r8, r9
    smmla r3, r2, r3, r10
    smmla r3, r2, r3, r11
    lsr \exponent, \exponent, #26
    lsr \exponent, r3, \exponent
    .endm

@ \sum += eight pairs of weights that end at r0, times the activations in r4..r11 (the last pair's first).
    .macro fixed16_sum sum
    vmov r1, \sum
    ldmdb r0!, {r2, r3, r12, lr}
    fixed16_products 7, -1, r2, r3, r12, lr
    ldmdb r0!, {r2, r3, r12, lr}
    fixed16_products 11, -1, r2, r3, r12, lr
    vmov \sum, r1
    .endm
    .equ FX_SUM_BYTES, 48

@ \sum += nine pairs of the tail that end at r0, times the inputs in r4..r12.
    .macro fixed16_tail_of_nine sum
    vmov r1, \sum
    ldmdb r0!, {r2, r3, lr}
    fixed16_products 10, 1, r2, r3, lr
    ldmdb r0!, {r2, r3, lr}
    fixed16_products 7, 1, r2, r3, lr
    ldmdb r0!, {r2, r3, lr}
    fixed16_products 4, 1, r2, r3, lr
    vmov \sum, r1
    .endm
    .equ FX_TAIL_BYTES, 56

@ u32 taxel_fixed16(block: *const Block, inputs: *const f32 [inputs], output: *mut f32 [outputs],
@                   space: *mut u32 [inputs])
@ output = (bias + A·x + Σ_k weights_k · 2^-(exponents_k[0] + exponents_k[1..]·x + g·‖x‖²)) · scale,
@ with the parameters in the block's words as fixed16.rs says. Returns the FPSCR. `space` may be the inputs; it is
@ odd (one byte beyond) if they are scaled already.
    function taxel_fixed16
    push {r4-r11, lr}
    vpush {s16-s27}
    ldm r0, {r4-r8} @ inputs, centres, outputs, form, words
    lsls r12, r7, #30 @ OTHER_SIZES
    bmi.w fixed16_any

@ 18 inputs, and up to 18 outputs: sums stay in s0..s17.
    .equ FX18_SPACE, 4
    .equ FX18_CENTRES, 8 @ this batch's and those behind it
    .equ FX18_FORM, 12
    .equ FX18_SCALE, 16
    push {r2, r3, r5, r7, r8}
    clear_invalid_operation r0
    vldmia r1, {s0-s17}
    lsls r3, r3, #31
    bne 1f
    mov r0, r8
    with_eighteen vsub, r0
    with_eighteen vmul, r0
1:
    convert 18, 0, s32, f32
    add r0, r8, #36 * 4
    vmov r1, r2, s0, s1
    pkhtb r4, r2, r1, asr #16
    smuad r3, r4, r4
    mov lr, #0
    fixed16_input r5, s2, s3, r3, lr
    fixed16_input r6, s4, s5, r3, lr
    fixed16_input r7, s6, s7, r3, lr
    fixed16_input r8, s8, s9, r3, lr
    fixed16_input r9, s10, s11, r3, lr
    fixed16_input r10, s12, s13, r3, lr
    fixed16_input r11, s14, s15, r3, lr
    fixed16_input r12, s16, s17, r3, lr
    ldr r1, [r0], #4
    lsrs r3, r3, #4
    orr r3, r3, lr, lsl #28
    umull r3, lr, r3, r1
    mov r2, sp
    lsrs r3, r3, #30
    orr r3, r3, lr, lsl #2
    vmov s25, s26, r2, r3
    vldmia r0!, {s0-s17} @ bias
    ldrd r1, r2, [sp, #FX18_CENTRES]
    str r0, [sp, #FX18_SCALE]
    adds r0, #18 * 4
    cbz r2, 2f
    cmp r2, #1 @ AFFINE alone
    bne 4f @ fewer outputs, or more than a batch
    adr.w r2, 3f + 1
    vmov s20, r2
    add r0, r0, #18 * 9 * 4
    b.w fixed16_tail
3:
    add r0, r0, #18 * 9 * 4
    ldr r1, [sp, #FX18_CENTRES]
2:
    adr r2, 9f
    vldmia r2, {s19-s22}
fixed16_start_of_18:
    adds r1, #15
    bic r1, r1, #15
    sub r1, sp, r1, lsl #2
    vmov s18, r1

@ Exponents of nine pairs of inputs, which are in r4..r12; r0 = the batch's words.
fixed16_exponents_of_nine:
    sub sp, #16 * 4
    .irp place, 15,14,13,12,11,10,9,8,7,6,5,4,3,2,1,0
    fixed16_line 9
    str r1, [sp, #\place * 4]
    .endr
    vmov r1, r2, s18, s19
    add r0, r0, r2
    cmp sp, r1
    bne fixed16_exponents_of_nine

@ Turns a batch's exponents into activations; r0 = the words behind the batch.
fixed16_powers:
    vmov s27, r0
    vmov lr, r12, s25, s26
    adr r8, 8f
    ldmia r8, {r8-r11}
    mov r0, sp
    mov r1, sp
1:
    .irp place, 0, 8, 16, 24
    ldmia r0!, {r4-r7}
    fixed16_power r4
    fixed16_power r5
    fixed16_power r6
    fixed16_power r7
    pkhbt r4, r5, r4, lsl #16
    pkhbt r5, r7, r6, lsl #16
    str r4, [r1, #\place]
    str r5, [r1, #\place + 4]
    .endr
    adds r1, #32
    cmp r0, lr
    bne 1b
    vmov r0, s27
@ Adds a batch's weights, which end at r0, to the sums of a group of outputs; r1 = end of the activations.
fixed16_first_sums:
    mov r2, sp
    ldmia r2!, {r4-r11}
    vmov s23, s24, r2, r1
    vmov r3, s22
    bx r3
    .balign 4
8:
    .word -335049012, 30875674, -1449129, 32766
9:
    .word 18 * 8 * 4 @ s19 to s22
    .word fixed16_summed_18 + 1
    .word 16 * 10 * 4
    .word fixed16_sums + 1

@ Fewer outputs, or more centres than a batch has. r2 = form
6:
    movs r3, #18
    b 7f
4:
    lsrs r3, r2, #8
    beq 6b
7:
    sub r0, r0, #36 * 4
    add r0, r0, r3, lsl #2
    str r0, [sp, #FX18_SCALE]
    add r0, r0, r3, lsl #2
    lsls r2, r2, #31 @ AFFINE
    beq 5f
    movs r1, #9 * 4
    mla r0, r3, r1, r0
    adr.w r2, 6f + 1
    vmov s20, r2
    adr.w r2, fixed16_tail_end + 1
    movs r1, #FX_TAIL_BYTES
    mls r2, r3, r1, r2
    bx r2
6:
    ldr r3, [sp, #FX18_FORM]
    lsrs r3, r3, #8
    it eq
    moveq r3, #18
    movs r1, #9 * 4
    mla r0, r3, r1, r0
@ A batch at r0, of r3 outputs
5:
    adr r2, fixed16_summed_few + 1
    lsls r1, r3, #5
    vmov s19, s20, r1, r2
    adr.w r2, fixed16_sums_end + 1
    movs r1, #FX_SUM_BYTES
    mls r2, r3, r1, r2
    mov r1, #16 * 10 * 4
    vmov s21, s22, r1, r2
    ldr r1, [sp, #FX18_CENTRES]
    cmp r1, #FX_MOST
    bls fixed16_start_of_18
    ldr r2, [sp, #FX18_SPACE]
    bic r2, r2, #1
    stmia r2, {r4-r12}
    mov r1, #FX_MOST
    b fixed16_start_of_18

@ Behind the sums of a batch, in general
fixed16_summed_few:
    vmov lr, s25
    mov sp, lr
    ldm sp, {r1-r5} @ output, space, centres, form, scale
    lsrs r7, r4, #8
    mov r4, r5
    it eq
    moveq r7, #18
    cmp r3, #FX_MOST
    bhi 1f
    bl fixed16_scale
    vmrs r0, fpscr
    add sp, #20
    vpop {s16-s27}
    pop {r4-r11, pc}
1:
    sub r1, r3, #FX_MOST
    str r1, [sp, #FX18_CENTRES]
    mov r3, r7
    bic r2, r2, #1
    ldmia r2, {r4-r12}
    vmov r0, s27
    b 5b

@ The first r7 of s0..s17 as numbers, times the scale at r4, to r1. r3 and s18..s22 are overwritten.
fixed16_scale:
    cmp r7, #18
    beq 2f
    add r4, r4, r7, lsl #2
    add r1, r1, r7, lsl #2
    adr r3, 1f + 1
    sub r3, r3, r7, lsl #4
    bx r3
    .balign 4
    .irp i, 17,16,15,14,13,12,11,10,9,8,7,6,5,4,3,2,1,0
    vcvt.f32.s32 s\i, s\i
    vldmdb r4!, {s22}
    vmul.f32 s\i, s\i, s22
    vstmdb r1!, {s\i}
    .endr
1:
    bx lr
2:
    .irp first, 0, 4, 8, 12
    convert 4, \first, f32, s32
    vldmia r4!, {s18-s21}
    each 4, vmul, \first, \first, 18
    .endr
    convert 2, 16, f32, s32
    vldmia r4!, {s18-s19}
    each 2, vmul, 16, 16, 18
    vstmia r1, {s0-s17}
    bx lr

@ Behind the sums of the one batch, 18 outputs
fixed16_summed_18:
    vmov lr, s25
    mov sp, lr
    pop {r1-r5} @ output, space, centres, form, scale
    convert 18, 0, f32, s32
    with_eighteen vmul, r5
    vmrs r0, fpscr
    vstmia r1, {s0-s17}
    vpop {s16-s27}
    pop {r4-r11, pc}

@ Before the first of several groups of outputs
fixed16_begin:
    vmov r1, s25
    ldrd r3, r2, [r1, #FX_ENTRY]
    sub r0, r0, r2
    vmov s22, r3
    bx r3

fixed16_sums:
    .irp sum, s17, s16, s15, s14, s13, s12, s11, s10, s9, s8, s7, s6, s5, s4, s3, s2, s1, s0
    fixed16_sum \sum
    .endr
fixed16_sums_end:
    vmov r1, r3, s23, s24
    cmp r1, r3
    beq 1f
    ldmia r1!, {r4-r11}
    vmov s23, r1
    vmov r2, r3, s21, s22
    sub r0, r0, r2
    bx r3
1:
    vmov r1, s20
    bx r1

@ s0..s17 += the tail that ends at r0, of nine pairs of inputs; goes to s20.
fixed16_tail:
    .irp sum, s17, s16, s15, s14, s13, s12, s11, s10, s9, s8, s7, s6, s5, s4, s3, s2, s1, s0
    fixed16_tail_of_nine \sum
    .endr
fixed16_tail_end:
    vmov r1, s20
    bx r1

@ Any other numbers of inputs and outputs: outputs in groups of up to 18, one batch after the other.
fixed16_any:
    vpush {s28-s31}
    sub sp, #FX_FRAME
    mov r0, r1
    mov r1, r2
    clear_invalid_operation r12
    strd r1, r5, [sp, #FX_OUTPUT]
    adds r1, r4, #1
    lsrs r1, r1, #1
    lsls r11, r3, #31 @ scaled?
    bic r12, r3, #1
    cmp r4, #18
    it ls
    movls r12, sp
    strd r12, r1, [sp, #FX_X]
    add r3, r8, r4, lsl #2 @ units
    add r2, r3, r4, lsl #2 @ decay
    adds r2, #4
    strd r2, r6, [sp, #FX_BIAS]
    strd r7, r4, [sp, #FX_FORM]
    mov r7, r11
    mov r9, #0
    mov r10, #0
    subs r4, #6
    blo 4f
2:
    vldmia r0!, {s0-s5}
    cbnz r7, 3f
    vldmia r8!, {s6-s11}
    vldmia r3!, {s12-s17}
    each 6, vsub, 0, 0, 6
    each 6, vmul, 0, 0, 12
3:
    convert 6, 0, s32, f32
    fixed16_input r5, s0, s1, r9, r10
    fixed16_input r6, s2, s3, r9, r10
    fixed16_input r11, s4, s5, r9, r10
    stmia r12!, {r5, r6, r11}
    subs r4, #6
    bhs 2b
4:
    adds r4, #6
    beq 8f
@ The others in pairs
5:
    cmp r4, #1
    beq 7f
    vldmia r0!, {s0-s1}
    cbnz r7, 6f
    vldmia r8!, {s2-s3}
    vldmia r3!, {s4-s5}
    vsub.f32 s0, s0, s2
    vsub.f32 s1, s1, s3
    vmul.f32 s0, s0, s4
    vmul.f32 s1, s1, s5
6:
    vcvt.s32.f32 s0, s0
    vcvt.s32.f32 s1, s1
    fixed16_input r5, s0, s1, r9, r10
    str r5, [r12], #4
    subs r4, #2
    bne 5b
    b 8f
@ The last of an odd number
7:
    vldr s0, [r0]
    cbnz r7, 6f
    vldr s2, [r8]
    vldr s4, [r3]
    vsub.f32 s0, s0, s2
    vmul.f32 s0, s0, s4
6:
    vcvt.s32.f32 s0, s0
    vmov r5, s0
    lsrs r5, r5, #16
    smlald r9, r10, r5, r5
    str r5, [r12], #4
8:
@ The term that all exponents share; fixed16.rs has the shift.
    ldrd r2, r3, [sp, #FX_FORM] @ form, inputs
    ldrd r7, r6, [sp, #FX_BIAS]
    ldr r1, [r7, #-4]
    cmp r3, #63
    bhi 1f
    lsrs r9, r9, #4
    orr r9, r9, r10, lsl #28
    umull r9, r10, r9, r1
    lsrs r9, r9, #30
    orr r9, r9, r10, lsl #2
    b 2f
1:
    clz r4, r3
    rsb r4, r4, #30
    rsb r5, r4, #32
    lsr r9, r9, r4
    lsl r10, r10, r5
    orr r9, r9, r10
    umull r9, r10, r9, r1
    adds r5, #2
    lsr r9, r9, r5
    subs r4, #2
    lsl r10, r10, r4
    orr r9, r9, r10
2:
    mov r11, sp
    vmov s25, s26, r11, r9
    add r0, r7, r6, lsl #3 @ behind bias and scale
    mov r4, #0
    cmp r3, #18
    bhi 1f
    lsls r2, r2, #31 @ AFFINE
    beq 5f
    cmp r3, #17
    blo 1f
    str r0, [sp, #FX_FORM]
    movs r4, #9 * 4
    mla r0, r6, r4, r0
    movs r4, #2
    b 5f
@ Inputs that stream by are filled up with zeros to four pairs
1:
    strd r4, r4, [r12]
    str r4, [r12, #8]
    ldrd r1, r5, [sp, #FX_X]
    adds r3, r5, #3
    lsrs r3, r3, #2
    lsls r8, r3, #4
    sub r8, r8, r5, lsl #2
    add r9, r1, r3, lsl #4
    vmov s28, s29, r9, r8
    lsls r5, r5, #2
    subs r5, #32
    adds r8, r5, #4
    vmov s30, s31, r5, r8
    ldr r2, [sp, #FX_FORM]
    lsls r2, r2, #31 @ AFFINE
    beq 5f
    vmov s18, r1
    mov r1, r7
    ldr r2, [sp, #FX_OUTPUT]
    mov r3, r6
2:
    ldr lr, [r1], #4
    vmov r12, s18
3:
    ldmia r12!, {r4-r7}
    ldmia r0!, {r8-r11}
    smlad lr, r8, r4, lr
    smlad lr, r9, r5, lr
    smlad lr, r10, r6, lr
    smlad lr, r11, r7, lr
    vmov r4, s28
    cmp r12, r4
    bne 3b
    vmov r4, s29
    sub r0, r0, r4
    str lr, [r2], #4
    subs r3, #1
    bne 2b
    movs r4, #1
5:
    str r4, [sp, #FX_STATE]
    vmov s27, r0

@ A batch, whose words are at s27; sp is at the frame
fixed16_batch:
    ldr r2, [sp, #FX_CENTRES]
    mov r1, #FX_MOST
    cmp r2, r1
    it lo
    movlo r1, r2
    subs r2, r2, r1
    str r2, [sp, #FX_CENTRES]
    adds r1, #15
    bic r1, r1, #15
    sub r2, sp, r1, lsl #2
    ldr r3, [sp, #FX_OUTPUTS]
    lsls r3, r3, #5
    vmov s18, s19, r2, r3
    movs r6, #0

@ A group of outputs, the first of which is number r6
fixed16_group:
    vmov lr, s25
    ldrd r4, r5, [lr, #FX_BIAS]
    sub r7, r5, r6
    cmp r7, #18
    it hi
    movhi r7, #18
    strd r6, r7, [lr, #FX_GROUP]
    ldr r1, [lr, #FX_P]
    adr.w r3, fixed16_sums_end + 1
    movs r0, #FX_SUM_BYTES
    mls r3, r7, r0, r3
    subs r2, r5, r7
    lsls r2, r2, #5
    beq 1f
    strd r3, r2, [lr, #FX_ENTRY]
    cbnz r6, 1f
    adr.w r3, fixed16_begin + 1
1:
    add r2, r2, r1, lsl #6
    adds r2, #64
    vmov s21, s22, r2, r3
    ldr r0, [lr, #FX_STATE]
    cmp r0, #1
    beq 2f
    add r1, r4, r6, lsl #2
    vldmia r1, {s0-s17} @ even if there are fewer: many words follow
    blo 4f
    ldr r0, [lr, #FX_FORM]
    adds r1, r6, r7
    movs r2, #9 * 4
    mla r0, r1, r2, r0
    adr.w r3, fixed16_tail_end + 1
    movs r1, #FX_TAIL_BYTES
    mls r3, r7, r1, r3
    adr.w r1, 3f + 1
    vmov s20, r1
    ldr r1, [lr, #FX_X]
    ldmia r1, {r4-r12}
    bx r3
2:
    ldr r1, [lr, #FX_OUTPUT]
    add r1, r1, r6, lsl #2
    mov r2, r7
    bl taxel_load
3:
    vmov lr, s25
    ldr r6, [lr, #FX_GROUP]
4:
    adr.w r1, fixed16_summed + 1
    vmov s20, r1
    cbz r6, 6f
    ldr r1, [lr, #FX_ENTRY + 4]
    vmov r0, s27
    sub r0, r0, r1
    add r0, r0, r6, lsl #5
    vmov r1, s24
    b.w fixed16_first_sums
6:
    vmov r0, s27
    ldrd r1, r2, [sp, #FX_X]
    cmp r2, #9
    bhi fixed16_exponents_of_many
    beq 5f
    tbh [pc, r2, lsl #1]
6:
    .short 0
    .short (fixed16_exponents_1 - 6b) / 2
    .short (fixed16_exponents_2 - 6b) / 2
    .short (fixed16_exponents_3 - 6b) / 2
    .short (fixed16_exponents_4 - 6b) / 2
    .short (fixed16_exponents_5 - 6b) / 2
    .short (fixed16_exponents_6 - 6b) / 2
    .short (fixed16_exponents_7 - 6b) / 2
    .short (fixed16_exponents_8 - 6b) / 2
5:
    ldmia r1, {r4-r12}
    b.w fixed16_exponents_of_nine

@ Exponents of ten or more pairs of inputs at r1: the first four or eight for all centres, then eight more at a time
fixed16_exponents_of_many:
    vmov r3, s28
    subs r3, r3, r1
    ldmia r1!, {r4-r7}
    lsls r3, r3, #27 @ fours odd in number?
    bmi 3f
    ldmia r1!, {r8-r11}
    vmov s29, r1
2:
    sub sp, #16 * 4
    .irp place, 15,14,13,12,11,10,9,8,7,6,5,4,3,2,1,0
    fixed16_line 8
    vmov lr, s30
    add r0, lr
    str r1, [sp, #\place * 4]
    .endr
    vmov r1, r2, s18, s19
    add r0, r0, r2
    cmp sp, r1
    bne 2b
    b 5f
3:
    vmov s29, r1
    vmov r8, s30
    adds r8, #16
4:
    sub sp, #16 * 4
    .irp place, 15,14,13,12,11,10,9,8,7,6,5,4,3,2,1,0
    fixed16_line 4
    add r0, r8
    str r1, [sp, #\place * 4]
    .endr
    vmov r1, r2, s18, s19
    add r0, r0, r2
    cmp sp, r1
    bne 4b
5:
    vmov s24, r0
6:
    vmov r2, r1, s28, s29
    cmp r1, r2
    beq 8f
    vmov r12, s25
    vmov r0, s27
    ldr r2, [r12, #FX_X]
    adds r0, #4
    subs r2, r1, r2
    ldmia r1!, {r4-r11}
    add r0, r0, r2
    vmov s29, r1
7:
    .irp place, 1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16
    fixed16_eight_more \place
    .endr
    vmov r1, r2, s18, s19
    sub r12, r12, #16 * 4
    add r0, r0, r2
    cmp r12, r1
    bne 7b
    b 6b
8:
    vmov r0, s24
    b.w fixed16_powers

@ A group's sums are complete for this batch.
fixed16_summed:
    vmov lr, s25
    ldrd r6, r7, [lr, #FX_GROUP]
    ldrd r4, r5, [lr, #FX_BIAS]
    ldrd r1, r0, [lr, #FX_OUTPUT]
    add r1, r1, r6, lsl #2
    cbnz r0, 1f
    add r4, r4, r5, lsl #2
    add r4, r4, r6, lsl #2 @ scale
    mov r8, lr
    bl fixed16_scale
    b 3f
1:
    mov r2, r7
    mov r8, lr
    bl taxel_store
3:
    mov lr, r8
    add r6, r6, r7
    cmp r6, r5
    blo.w fixed16_group
    mov sp, lr
    movs r1, #1
    str r1, [sp, #FX_STATE]
    ldr r1, [sp, #FX_CENTRES]
    cmp r1, #0
    bne.w fixed16_batch
    vmrs r0, fpscr
    add sp, #FX_FRAME
    vpop {s28-s31}
    vpop {s16-s27}
    pop {r4-r11, pc}

    .irp pairs, 1,2,3,4,5,6,7,8
fixed16_exponents_\pairs:
    fixed16_exponents \pairs
    .endr
    .size taxel_fixed16, . - taxel_fixed16
