@ ---------------------------------------------------------------------------------------------------------
@ Projection of a frame to features. VMUL and VADD (1 cycle each) rather than VFMA (3), in an order that hardly ever
@ uses a result in the very next instruction.
@ ---------------------------------------------------------------------------------------------------------

@ s0.. += \outputs weights at r0, times \factor; r0 moves to the next line, r11 further.
    .macro projection_line outputs, factor
    .if \outputs == 18
    vldmia r0!, {s18-s29}
    each_with 12, vmul, 18, 18, \factor
    each 12, vadd, 0, 0, 18
    vldmia r0!, {s18-s23}
    add r0, r0, r11
    each_with 6, vmul, 18, 18, \factor
    each 6, vadd, 12, 12, 18
    .else
    transfer vldmia, 18, \outputs, r0
    add r0, r0, r11
    each_with \outputs, vmul, 18, 18, \factor
    each \outputs, vadd, 0, 0, 18
    .endif
    .endm

@ s0.. += Σ over r3 lines of \outputs weights at r0, times the factors at r1. Returns.
    .macro projection_sums outputs
    lsrs r3, r3, #1
    bcc 1f
    vldmia r1!, {s31}
    adds r3, #1
    b 2f
1:
    vldmia r1!, {s30-s31}
    projection_line \outputs, s30
2:
    projection_line \outputs, s31
    subs r3, #1
    bne 1b
    bx lr
    .endm

@ As projection_sums, for an even number of lines that follow each other without gaps; goes on for any other.
    .macro projection_sums_of_line outputs
    orrs r2, r11, r3, lsl #31
    bne 3f
    lsrs r3, r3, #1
1:
    vldmia r1!, {s30-s31}
    transfer vldmia, 18, 2 * \outputs, r0
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
    .macro projection_two_lines
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

@ r8 = how many of r2 outputs (1 or more) the next sums take
    function projection_width
    mov r8, r2
    cmp r2, #6
    bls 1f
    mov r8, #6
    cmp r2, #18
    blo 1f
    mov r8, #18
1:
    bx lr
    .size projection_width, . - projection_width

@ The first r8 (of projection_width) of s0..s17 += Σ over r3 lines (1 or more) of weights at r0, times the factors at r1.
@ A line begins r11 bytes behind the weights of the last one. r0 to r3 and s18..s31 are overwritten.
    function projection_sums
    cmp r8, #18
    bne projection_sums_of_few
    cmp r11, #0
    bne 1f
    lsls r8, r3, #31 @ odd?
    mov r8, #18
    beq 4f
    vldmia r1!, {s31}
    projection_line 18, s31
    subs r3, #1
    it eq
    bxeq lr
4:
    lsrs r3, r3, #2
    bcc 2f
    adds r3, #1
    b 3f
2:
    projection_two_lines
3:
    projection_two_lines
    subs r3, #1
    bne 2b
    bx lr
1:
    projection_sums 18
projection_sums_of_few:
    tbh [pc, r8, lsl #1]
3:
    .short 0
    .short (projection_sums_1 - 3b) / 2
    .short (projection_sums_2 - 3b) / 2
    .short (projection_sums_3 - 3b) / 2
    .short (projection_sums_4 - 3b) / 2
    .short (projection_sums_5 - 3b) / 2
    .short (projection_sums_6 - 3b) / 2
    .irp outputs, 1, 2, 3, 4, 5, 6
projection_sums_\outputs:
    .if \outputs >= 4
    projection_sums_of_line \outputs
    .endif
    projection_sums \outputs
    .endr
    .size projection_sums, . - projection_sums

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
    bl projection_width
    sub r11, r7, r8
    lsl r11, r11, #2
    mov r1, r5
    mov r2, r8
    bl taxel_load
    mov r0, r10
    mov r1, r4
    mov r3, r9
    bl projection_sums
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
