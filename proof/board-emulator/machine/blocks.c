/* Called by Unicorn before each block of code: lets time pass, and stops the processor when something is due.
   Called a hundred million times a second of the board, so it is not in Python. */
#include <stdint.h>

typedef struct {
    int64_t now;  /* cycles of the processor since power-on */
    int64_t due;  /* cycle from which on the processor must stop at the next block */
    int64_t fresh; /* the processor was just started: its first block runs in any case */
    int (*stop)(void *unicorn);
} Time;

void on_block(void *unicorn, uint64_t address, uint32_t bytes, void *user) {
    Time *time = user;
    (void)address;
    if (time->now >= time->due && !time->fresh) {
        time->stop(unicorn);
        return;
    }
    time->fresh = 0;
    /* A cycle for each half-word, and one for the branch at the end. */
    time->now += bytes / 2 + 1;
}
