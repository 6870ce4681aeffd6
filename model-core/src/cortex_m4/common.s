@ Inner loops of the gate, the projection and the two fast number formats for a Cortex-M4F: any number of inputs,
@ centres and outputs.
@
@ The compiler cannot be led here: it neither keeps 18 accumulators in registers while it streams the
@ weights through the rest by load-multiple, nor pairs 16-bit products (docs/cycles.md has both figures).
@ routines.rs declares these functions; gate.rs, projection.rs, expanded.rs and fixed16.rs hold their twins in
@ Rust, which do the same operations in the same order: outputs agree bit for bit, which tests check.
@
@ Every loop is at most 1 KiB long, so that it fits the instruction cache of an STM32F4. Loops run over a *batch* of
@ centres: one loop for their exponents, one for the powers, one for the sums.
@
@ Procedure call standard: AAPCS, hard float, for the functions that routines.rs declares. None writes beyond the
@ sizes that its arguments give, nor reads beyond the network's words and the other arguments.

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

@ Bit of the FPSCR
    .equ INVALID_OPERATION, 1

@ s0..s17 = s0..s17 \operation the 18 numbers at \at; \at moves past them. s18..s27 are overwritten.
    .macro with_eighteen operation, at
    vldmia \at!, {s18-s27}
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
    vldmia \at!, {s18-s25}
    \operation\().f32 s10, s10, s18
    \operation\().f32 s11, s11, s19
    \operation\().f32 s12, s12, s20
    \operation\().f32 s13, s13, s21
    \operation\().f32 s14, s14, s22
    \operation\().f32 s15, s15, s23
    \operation\().f32 s16, s16, s24
    \operation\().f32 s17, s17, s25
    .endm

@ The invalid-operation flag is cleared; it is set afterwards if an input was saturated or NaN. \scratch is overwritten.
    .macro clear_invalid_operation scratch
    vmrs \scratch, fpscr
    bic \scratch, \scratch, #INVALID_OPERATION
    vmsr fpscr, \scratch
    .endm

@ Stores the first r2 of s0..s17 (1 to 18) at r1. r1 and r3 are overwritten.
    function taxel_store
    cmp r2, #18
    bne 1f
    vstmia r1, {s0-s17}
    bx lr
1:
    adr.w r3, 2f + 1
    add r1, r1, r2, lsl #2
    sub r3, r3, r2, lsl #2
    bx r3
    .irp i, 17,16,15,14,13,12,11,10,9,8,7,6,5,4,3,2,1,0
    vstmdb r1!, {s\i}
    .endr
2:
    bx lr
    .size taxel_store, . - taxel_store

@ Loads the first r2 of s0..s17 (1 to 18) from r1. r1 and r3 are overwritten.
    function taxel_load
    cmp r2, #18
    bne 1f
    vldmia r1, {s0-s17}
    bx lr
1:
    adr.w r3, 2f + 1
    add r1, r1, r2, lsl #2
    sub r3, r3, r2, lsl #2
    bx r3
    .irp i, 17,16,15,14,13,12,11,10,9,8,7,6,5,4,3,2,1,0
    vldmdb r1!, {s\i}
    .endr
2:
    bx lr
    .size taxel_load, . - taxel_load
