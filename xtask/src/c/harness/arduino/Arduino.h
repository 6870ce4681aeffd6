/* What the example's sketch uses of Arduino. */
#include <math.h>

struct Stream {
    void begin(unsigned long) {}
    void print(const char *) {}
    void print(char) {}
    void print(float, int) {}
    void println(const char *) {}
};
static Stream Serial;
