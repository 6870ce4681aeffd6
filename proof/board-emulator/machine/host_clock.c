/* Loaded into taxel (LD_PRELOAD): its clock is the emulated board's, so neither of them is late however busy the computer
   is. A wait lasts until something arrives or the board's time is up; the board waits while taxel computes. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

/* Shared with machine/line.py. */
typedef struct {
    volatile int64_t now_us;  /* the board's time */
    volatile int64_t until_us; /* until when taxel waits */
    volatile int64_t waits;   /* 1 while it sleeps, 2 while it waits for bytes */
} Shared;

#define START_S 1000000 /* taxel's time when the board's is 0: it may reckon back */
#define LOOK_NS 2000000 /* from one look at the board's time to the next, while it waits */

static Shared *shared(void) {
    static Shared *page;
    if (!page) {
        int file = open(getenv("BOARD_CLOCK"), O_RDWR);
        page = mmap(0, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
        if (file < 0 || page == MAP_FAILED) abort();
        close(file);
    }
    return page;
}

static int64_t us_of(const struct timespec *time) {
    return time->tv_sec * 1000000LL + (time->tv_nsec + 999) / 1000;
}

int clock_gettime(clockid_t clock, struct timespec *time) {
    if (clock != CLOCK_MONOTONIC) return syscall(SYS_clock_gettime, clock, time);
    int64_t us = shared()->now_us;
    time->tv_sec = START_S + us / 1000000;
    time->tv_nsec = us % 1000000 * 1000;
    return 0;
}

static int wait_us(struct pollfd *files, nfds_t count, int64_t us, const sigset_t *mask) {
    Shared *page = shared();
    const struct timespec look = {0, LOOK_NS};
    int64_t end = us < 0 ? INT64_MAX : page->now_us + us;
    page->until_us = end;
    page->waits = count ? 2 : 1;
    int ready = 0;
    while (!ready && page->now_us < end)
        ready = syscall(SYS_ppoll, files, count, &look, mask, 8, 0);
    page->waits = 0;
    return ready;
}

int ppoll(struct pollfd *files, nfds_t count, const struct timespec *limit, const sigset_t *mask) {
    const struct timespec none = {0, 0};
    int ready = syscall(SYS_ppoll, files, count, &none, mask, 8, 0);
    return ready ? ready : wait_us(files, count, limit ? us_of(limit) : -1, mask);
}

int poll(struct pollfd *files, nfds_t count, int limit_ms) {
    const struct timespec limit = {limit_ms / 1000, limit_ms % 1000 * 1000000L};
    return ppoll(files, count, limit_ms < 0 ? 0 : &limit, 0);
}

static int sleep_us(int64_t us) { return us > 0 && wait_us(0, 0, us, 0) < 0 ? errno : 0; }

int nanosleep(const struct timespec *time, struct timespec *left) {
    (void)left;
    return sleep_us(us_of(time)) ? -1 : 0;
}

int clock_nanosleep(clockid_t clock, int flags, const struct timespec *time, struct timespec *left) {
    (void)left;
    if (clock != CLOCK_MONOTONIC) return syscall(SYS_clock_nanosleep, clock, flags, time, left);
    return sleep_us(us_of(time) - (flags & TIMER_ABSTIME ? START_S * 1000000LL + shared()->now_us : 0));
}
