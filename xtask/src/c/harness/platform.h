/* What the harness needs of a platform. */
#ifndef PLATFORM_H
#define PLATFORM_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Opens the file that the first argument names. */
int begin(int count, char **arguments);
/* Takes the next bytes of the file. Returns whether there are so many. */
int take(void *bytes, unsigned count);
/* Says what differs in which frame. */
void report(const char *what, uint32_t frame);

#ifdef __cplusplus
}
#endif

#endif
