@ ---------------------------------------------------------------------------------------------------------
@ A component of a mixture of Gaussians. In assembly because the compiler loads number by number, and takes as many
@ instructions around a row of the triangle as in it.
@ ---------------------------------------------------------------------------------------------------------

@ f32 taxel_density(component: *const f32 [1 + features + features · (features + 1) / 2],
@                   features: *const f32 [features], count: u32 ≥ 1, floor: f32)
@ c − ½‖W·f − o‖², with the parameters in the component as confidence.rs says. Ends with the first row that takes it
@ below the floor.
    function taxel_density
    push {r4-r6, lr}
    vmov.f32 s3, s0
    add r3, r0, #4
    vldr s0, [r0]
    add r0, r3, r2, lsl #2
    vmov.f32 s1, #0.5
    movs r4, #1
    movs r6, #0
    vmov s13, r6
@ A row; r0 its numbers, r1 features, r2 number of rows, r3 offsets, r4 numbers of the row; s0 density, s3 floor
1:
    vldmia r3!, {s2}
    vmov.f32 s12, s13
    mov r5, r1
    lsrs r6, r4, #2
    beq 3f
2:
    vldmia r0!, {s4-s7}
    vldmia r5!, {s8-s11}
    each 4, vmul, 4, 4, 8
    subs r6, r6, #1
    vadd.f32 s4, s4, s5
    vadd.f32 s6, s6, s7
    vadd.f32 s4, s4, s6
    vadd.f32 s12, s12, s4
    bne 2b
@ Two numbers if bit 1 of their number is set, which becomes the carry, and one if bit 0 is, which becomes the sign.
3:
    lsls r6, r4, #31
    bcc 4f
    vldmia r0!, {s4-s5}
    vldmia r5!, {s8-s9}
    vmul.f32 s4, s4, s8
    vmul.f32 s5, s5, s9
    vadd.f32 s12, s12, s4
    vadd.f32 s12, s12, s5
4:
    bpl 5f
    vldmia r0!, {s4}
    vldr s8, [r5]
    vmul.f32 s4, s4, s8
    vadd.f32 s12, s12, s4
5:
    vsub.f32 s12, s12, s2
    adds r4, r4, #1
    vmul.f32 s12, s12, s12
    vmul.f32 s12, s12, s1
    vsub.f32 s0, s0, s12
    vcmp.f32 s0, s3
    vmrs APSR_nzcv, fpscr
    bmi 6f
    cmp r4, r2
    bls 1b
6:
    pop {r4-r6, pc}
    .size taxel_density, . - taxel_density
