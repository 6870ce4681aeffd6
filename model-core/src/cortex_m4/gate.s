
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

@ u32 taxel_give_rest(readings: *const f32 [readings], baseline: *const f32 [readings],
@                     rest: *const f32 [outputs], outputs: *mut f32 [outputs], tolerance: f32,
@                     readings: u32 ≥ 1, outputs: u32 ≥ 1)
@ Copies rest to outputs and returns 1 if the readings are at rest, as gate.rs defines it; else returns 0.
    function taxel_give_rest
    vsub.f32 s1, s0, s0
    vsub.f32 s2, s0, s0
    ldr r12, [sp]
    subs r12, #18
    blo 2f
1:
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
    cmp r12, #0
    beq 4f
    subs r12, #18
    bhs 1b
2:
    add r12, r12, #18
3:
    vldmia r0!, {s4}
    vldmia r1!, {s10}
    gate_reading s4, s10
    subs r12, #1
    bne 3b
4:
    ldrd r0, r12, [sp]
    vmov s3, r0
    vmul.f32 s1, s1, s1
    vcvt.f32.u32 s3, s3
    vmul.f32 s2, s2, s2
    vmul.f32 s1, s1, s3
    vcmp.f32 s1, s2
    vmrs APSR_nzcv, fpscr
    bhi 9f
    cmp r12, #18
    bne 5f
    vldmia r2!, {s0-s15}
    vstmia r3!, {s0-s15}
    vldmia r2, {s0-s1}
    vstmia r3, {s0-s1}
    movs r0, #1
    bx lr
5:
    ldr r0, [r2], #4
    str r0, [r3], #4
    subs r12, #1
    bne 5b
    movs r0, #1
    bx lr
9:
    movs r0, #0
    bx lr
    .size taxel_give_rest, . - taxel_give_rest
