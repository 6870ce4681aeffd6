/* The platform of QEMU's mps2-an386: start-up, a C library of four functions, and files by semihosting. */
#include <string.h>

#include "platform.h"

#define SYS_OPEN 0x01u
#define SYS_WRITE0 0x04u
#define SYS_READ 0x06u
#define SYS_GET_CMDLINE 0x15u
#define SYS_EXIT 0x18u
#define APPLICATION_EXIT 0x20026u
#define INTERNAL_ERROR 0x20024u

extern uint32_t stack_top, data_start, data_end, data_source, bss_start, bss_end;
int main(int count, char **arguments);
void reset(void);
void fault(void);

static uint32_t handle;

static uint32_t call(uint32_t operation, uint32_t argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register uint32_t r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static uint32_t address_of(const void *place)
{
    return (uint32_t)place;
}

void reset(void)
{
    uint32_t *to = &data_start;
    const uint32_t *from = &data_source;
    static char *arguments[] = {0, 0};
    /* The floating-point unit. */
    *(volatile uint32_t *)0xe000ed88u |= 0xfu << 20;
    __asm__ volatile("dsb\n isb");
    while (to < &data_end) {
        *to++ = *from++;
    }
    for (to = &bss_start; to < &bss_end; to++) {
        *to = 0;
    }
    call(SYS_EXIT, main(2, arguments) == 0 ? APPLICATION_EXIT : INTERNAL_ERROR);
}

void fault(void)
{
    call(SYS_WRITE0, address_of("fault\n"));
    call(SYS_EXIT, INTERNAL_ERROR);
}

struct vectors {
    const void *stack;
    void (*handlers[6])(void);
};
__attribute__((section(".vectors"), used)) static const struct vectors vectors = {
    &stack_top, {reset, fault, fault, fault, fault, fault},
};

/* The command line is the name of the file. */
int begin(int count, char **arguments)
{
    static char line[512];
    const uint32_t asked[2] = {address_of(line), sizeof line};
    (void)count;
    (void)arguments;
    if (call(SYS_GET_CMDLINE, address_of(asked)) != 0) {
        return 0;
    }
    {
        uint32_t length = 0;
        while (line[length] != 0) {
            length++;
        }
        {
            const uint32_t opened[3] = {address_of(line), 1 /* rb */, length};
            handle = call(SYS_OPEN, address_of(opened));
        }
    }
    return handle != 0xffffffffu;
}

int take(void *bytes, unsigned count)
{
    const uint32_t read[3] = {handle, address_of(bytes), count};
    /* It returns how many bytes were not read. */
    return call(SYS_READ, address_of(read)) == 0;
}

void report(const char *what, uint32_t frame)
{
    char digits[] = "frame 0000000000: ";
    for (unsigned place = 15; frame > 0; place--, frame /= 10) {
        digits[place] = (char)('0' + frame % 10);
    }
    call(SYS_WRITE0, address_of(digits));
    call(SYS_WRITE0, address_of(what));
    call(SYS_WRITE0, address_of("\n"));
}

void *memcpy(void *to, const void *from, size_t count)
{
    char *target = to;
    const char *source = from;
    while (count-- > 0) {
        *target++ = *source++;
    }
    return to;
}

void *memset(void *to, int value, size_t count)
{
    char *target = to;
    while (count-- > 0) {
        *target++ = (char)value;
    }
    return to;
}

int memcmp(const void *a, const void *b, size_t count)
{
    const unsigned char *left = a, *right = b;
    for (; count > 0; count--, left++, right++) {
        if (*left != *right) {
            return *left < *right ? -1 : 1;
        }
    }
    return 0;
}

int strcmp(const char *a, const char *b)
{
    for (; *a != 0 && *a == *b; a++) {
        b++;
    }
    return *a - *b;
}
