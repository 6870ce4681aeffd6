/* The platform of a host: files of the C library. */
#include <stdio.h>

#include "platform.h"

static FILE *file;

int begin(int count, char **arguments)
{
    file = count == 2 ? fopen(arguments[1], "rb") : NULL;
    return file != NULL;
}

int take(void *bytes, unsigned count)
{
    return fread(bytes, 1, count, file) == count;
}

void report(const char *what, uint32_t frame)
{
    printf("frame %lu: %s\n", (unsigned long)frame, what);
}
