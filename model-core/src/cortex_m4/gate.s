
@ ---------------------------------------------------------------------------------------------------------
@ Gate. In assembly because the compiler loads number by number (2 cycles each; 7 for six at once).
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

@ u32 taxel_give_rest(readings: *const f32 [rows · inputs], baseline: *const f32 [rows · inputs],
@                     rest: *const f32 [rows · outputs], outputs: *mut f32 [rows · outputs], tolerance: f32,
@                     rest_status: *const u8 [rows], status: *mut u8 [rows], rows: u32 ≥ 1, inputs: u32 ≥ 1,
@                     outputs: u32 ≥ 1, until_awake: u32)
@ Copies rest to outputs for each row that is at rest, as gate.rs defines it, and writes the status of each. Ends with
@ the first row that is awake if until_awake is not 0. Returns the number of rows that are awake.
    .equ GATE_DECODED, 0
    .equ GATE_MISSING_READING, 1
    .equ GATE_AT_REST, 3
    .equ GATE_ARGUMENTS, 9 * 4
    .equ GATE_UNTIL_AWAKE, GATE_ARGUMENTS + 5 * 4

    function taxel_give_rest
    push {r4-r11, lr}
    add r12, sp, #GATE_ARGUMENTS
    ldm r12, {r4-r8}
    vmov s3, r7
    mul r9, r6, r7
    vcvt.f32.u32 s3, s3
    add r10, r0, r9, lsl #2
    add r11, r1, r9, lsl #2
    movs r9, #0
    mov lr, #GATE_AT_REST
@ A row; r4 status at rest, r5 status, r6 rows left, r7 inputs, r8 outputs, r9 rows awake, r10 and r11 ends of the
@ readings and the baseline
gate_row:
    ldrb r12, [r4], #1
    cmp r12, #GATE_DECODED
    bne 9f
    vsub.f32 s1, s0, s0
    vsub.f32 s2, s0, s0
    subs r12, r7, #18
    blo 3f
2:
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
    beq 5f
    subs r12, #18
    bhs 2b
3:
    add r12, r12, #18
4:
    vldmia r0!, {s4}
    vldmia r1!, {s10}
    gate_reading s4, s10
    subs r12, #1
    bne 4b
5:
    vmul.f32 s1, s1, s1
    vmul.f32 s2, s2, s2
    vmul.f32 s1, s1, s3
    vcmp.f32 s1, s2
    vmrs APSR_nzcv, fpscr
    bhi 9f
    cmp r8, #18
    bne 7f
    vldmia r2!, {s4-s15}
    vstmia r3!, {s4-s15}
    vldmia r2!, {s4-s9}
    vstmia r3!, {s4-s9}
6:
    strb lr, [r5], #1
    subs r6, #1
    bne gate_row
    mov r0, r9
    pop {r4-r11, pc}
@ Any other number of outputs: by four, then one by one
7:
    subs r12, r8, #4
    blo 2f
1:
    vldmia r2!, {s4-s7}
    vstmia r3!, {s4-s7}
    subs r12, #4
    bhs 1b
2:
    adds r12, #4
    beq 6b
3:
    vldmia r2!, {s4}
    vstmia r3!, {s4}
    subs r12, #1
    bne 3b
    b 6b
@ A row that is awake
9:
    mov r12, #GATE_MISSING_READING
    strb r12, [r5], #1
    add r9, #1
    ldr r12, [sp, #GATE_UNTIL_AWAKE]
    cmp r12, #0
    bne 1f
    subs r6, #1
    mul r12, r6, r7
    add r2, r2, r8, lsl #2
    add r3, r3, r8, lsl #2
    sub r0, r10, r12, lsl #2
    sub r1, r11, r12, lsl #2
    cmp r6, #0
    bne gate_row
1:
    mov r0, r9
    pop {r4-r11, pc}
    .size taxel_give_rest, . - taxel_give_rest
