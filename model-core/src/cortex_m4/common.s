@ Inner loops of the projection, the confidence and the number format fixed16 for a Cortex-M4F: any number of inputs,
@ centres and outputs.
@
@ The compiler cannot be led here: it neither keeps 18 accumulators in registers while it streams the
@ weights through the rest by load-multiple, nor pairs 16-bit products (docs/cycles.md has both figures).
@ routines.rs declares these functions; projection.rs, confidence.rs and fixed16.rs hold their twins
@ in Rust, which do the same operations in the same order: outputs agree bit for bit, which tests check.
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

@ Runs of instructions on consecutive registers, which `done` counts. % computes an argument, behind .altmacro alone.

@ s\to = s\left \operation s\right, and so on with the registers behind each: \count times.
    .macro each count, operation, to, left, right
    apart \count, \operation, \to, 1, \left, 1, \right, 1
    .endm

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

@ s\to = s\left \operation \right, and so on with the registers behind the first two: \count times.
    .macro each_with count, operation, to, left, right
    .altmacro
    .set done, 0
    .rept \count
    each_one \operation, %(\to + done), %(\left + done), \right
    .set done, done + 1
    .endr
    .noaltmacro
    .endm

    .macro each_one operation, to, left, right, number
    \operation\().f32 s\to, s\left, \right\()\number
    .endm

@ Converts s\first and the registers behind it, \count in all, in place.
    .macro convert count, first, to, from
    .altmacro
    .set done, 0
    .rept \count
    convert_one %(\first + done), \to, \from
    .set done, done + 1
    .endr
    .noaltmacro
    .endm

    .macro convert_one number, to, from
    vcvt.\to\().\from s\number, s\number
    .endm

@ Loads or stores s\first and the registers behind it, \count in all, at \at, which moves past the numbers.
    .macro transfer operation, first, count, at
    .altmacro
    transfer_to \operation, \first, %(\first + \count - 1), \at
    .noaltmacro
    .endm

    .macro transfer_to operation, first, last, at
    \operation \at!, {s\first-s\last}
    .endm

@ s0..s17 = s0..s17 \operation the 18 numbers at \at; \at moves past them. s18..s27 are overwritten.
    .macro with_eighteen operation, at
    vldmia \at!, {s18-s27}
    each 10, \operation, 0, 0, 18
    vldmia \at!, {s18-s25}
    each 8, \operation, 10, 10, 18
    .endm

@ The invalid-operation flag is cleared; it is set afterwards if an input was saturated or NaN. \scratch is overwritten.
    .macro clear_invalid_operation scratch
    vmrs \scratch, fpscr
    bic \scratch, \scratch, #INVALID_OPERATION
    vmsr fpscr, \scratch
    .endm

@ A function that transfers the first r2 of s0..s17 (1 to 18) at r1. r1 and r3 are overwritten.
    .macro transfers_first_of_18 name, transfer
    function \name
    cmp r2, #18
    bne 1f
    \transfer\()ia r1, {s0-s17}
    bx lr
1:
    adr.w r3, 2f + 1
    add r1, r1, r2, lsl #2
    sub r3, r3, r2, lsl #2
    bx r3
    .irp i, 17,16,15,14,13,12,11,10,9,8,7,6,5,4,3,2,1,0
    \transfer\()db r1!, {s\i}
    .endr
2:
    bx lr
    .size \name, . - \name
    .endm

    transfers_first_of_18 taxel_store, vstm
    transfers_first_of_18 taxel_load, vldm
