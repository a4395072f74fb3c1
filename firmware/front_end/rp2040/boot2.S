// Second stage of the boot loader: the boot ROM loads these 256 bytes of the flash into memory, checks their last word, and
// calls them. Makes the flash readable, copies the program into memory and starts it (RP2040 data sheet, 2.8.1.3 and 4.10).
    .syntax unified
    .cpu cortex-m0plus
    .thumb
    .section .boot2, "ax"
    .global boot2
    .thumb_func
boot2:
    cpsid   i
    ldr     r4, ssi
    movs    r0, #0
    str     r0, [r4, #0x08]     // SSIENR: off while it is changed
    movs    r0, #2
    str     r0, [r4, #0x14]     // BAUDR: half of the ring oscillator, 6 MHz at most, for any flash
    ldr     r0, ctrlr0
    str     r0, [r4, #0x00]
    ldr     r0, spi_ctrlr0
    ldr     r1, spi_ctrlr0_at
    str     r0, [r1]
    movs    r0, #0
    str     r0, [r4, #0x04]     // CTRLR1: one word at a time
    movs    r0, #1
    str     r0, [r4, #0x10]     // SER: the flash
    str     r0, [r4, #0x08]     // SSIENR: on

    ldr     r0, from
    ldr     r1, to
    ldr     r2, end
1:  ldmia   r0!, {r3}
    stmia   r1!, {r3}
    cmp     r1, r2
    blo     1b

    ldr     r0, to
    ldr     r1, vtor
    str     r0, [r1]
    ldmia   r0!, {r1, r2}
    msr     msp, r1
    bx      r2

    .align  2
ssi:            .word 0x18000000
spi_ctrlr0_at:  .word 0x180000f4
ctrlr0:         .word (31 << 16) | (3 << 8)               // 32 bits a word; a read follows what is sent
spi_ctrlr0:     .word (0x03 << 24) | (2 << 8) | (6 << 2)  // command 03h of 8 bits, address of 24 bits
from:           .word 0x10000100
to:             .word image_begin
end:            .word image_end
vtor:           .word 0xe000ed08
