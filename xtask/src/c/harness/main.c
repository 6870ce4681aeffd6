/* Decodes the frames of a file with an exported model, and compares all bits with what taxel-core made of them. The
 * file is what xtask/src/c/frames.rs writes: groups of a number of frames, a baseline, and the frames, each followed by
 * what is expected of it. A group of none ends it. C and C++ compile this file.
 */
#include <string.h>

#include "model.h"
#include "platform.h"

#define GUARD 4u
#define ROOM (4u * (MODEL_READINGS + MODEL_OUTPUTS + MODEL_ROWS))

static float readings[MODEL_READINGS], baseline[MODEL_READINGS], outputs[MODEL_OUTPUTS];
static float scratch[MODEL_SCRATCH + GUARD];
static uint8_t status[MODEL_ROWS];
#if MODEL_RELATIVE
static model_t sensor;
#define SENSOR &sensor,
#else
#define SENSOR
#endif
static uint32_t frame;

#ifdef __cplusplus
extern "C" {
#endif
/* What is between calls of these is counted. */
void region_begin(void);
void region_end(void);
#ifdef __cplusplus
}
#endif
__attribute__((noinline)) void region_begin(void)
{
    __asm__ volatile("");
}
__attribute__((noinline)) void region_end(void)
{
    __asm__ volatile("");
}

/* Whether bytes are those that come next in the file. */
static int same(const char *what, const void *found, unsigned bytes)
{
    static unsigned char expected[ROOM];
    if (take(expected, bytes) && memcmp(found, expected, bytes) == 0) {
        return 1;
    }
    report(what, frame);
    return 0;
}

/* Whether an int is the word that comes next. */
static int same_int(const char *what, int found)
{
    const uint32_t word = (uint32_t)found;
    return same(what, &word, sizeof word);
}

static int decodes_as_expected(void)
{
    int returned, is_same;
    memset(outputs, 0x55, sizeof outputs);
    region_begin();
    returned = model_decode(SENSOR readings, outputs, status, scratch);
    region_end();
    is_same = same_int("what decode returns", returned) && same("outputs", outputs, sizeof outputs)
        && same("status", status, sizeof status);
#if MODEL_CONFIDENCE
    if (is_same) {
        const float novelty = model_assess(SENSOR readings, outputs, scratch);
        is_same = same("novelty", &novelty, sizeof novelty) && same("deviations", outputs, sizeof outputs);
    }
#endif
#if MODEL_FILL
    if (is_same) {
        is_same = same_int("number of filled readings", model_fill(SENSOR readings, scratch));
        for (unsigned i = 0; i < MODEL_READINGS; i++) {
            /* Which of all NaN comes out is the processor's choice. */
            if (readings[i] != readings[i]) {
                const uint32_t usual = 0x7fc00000u;
                memcpy(&readings[i], &usual, sizeof usual);
            }
        }
        is_same = is_same && same("filled readings", readings, sizeof readings);
    }
#endif
    return is_same;
}

static int all_are_as_expected(void)
{
    uint32_t count;
    if (model_selftest() != 0) {
        report("self-test", 0);
        return 0;
    }
    if (strcmp(model_output_name(0), "") == 0 || model_output_name(MODEL_OUTPUTS) != 0
        || model_reading_name(0)[0] != 'r' || model_reading_name(MODEL_READINGS) != 0) {
        report("names", 0);
        return 0;
    }
    memset(scratch, 0x33, sizeof scratch);
    while (take(&count, sizeof count) && count > 0) {
        if (!take(baseline, sizeof baseline)) {
            break;
        }
#if MODEL_RELATIVE
        model_set_baseline(&sensor, baseline);
        /* The self-test has a sensor of its own. */
        if (model_selftest() != 0) {
            report("self-test", frame);
            return 0;
        }
#endif
        for (; count > 0; count--, frame++) {
            if (!take(readings, sizeof readings) || !decodes_as_expected()) {
                return 0;
            }
        }
    }
    for (unsigned i = 0; i < sizeof(float) * GUARD; i++) {
        if (((const unsigned char *)(scratch + MODEL_SCRATCH))[i] != 0x33) {
            report("scratch is too short", frame);
            return 0;
        }
    }
    return same_int("number of frames", (int)frame);
}

int main(int count, char **arguments)
{
    return begin(count, arguments) && all_are_as_expected() ? 0 : 1;
}
