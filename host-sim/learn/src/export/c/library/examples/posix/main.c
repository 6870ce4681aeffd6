/* Decodes lines of readings on stdin to lines of outputs on stdout, both with commas between numbers:
 *
//@if !relative
 *     ./decode < readings.csv > outputs.csv
//@end
//@if relative
 *     ./decode baseline.csv < readings.csv > outputs.csv
 *
 * baseline.csv holds one line: the readings of the untouched sensor.
//@end
 *
 * An empty field or "nan" is a missing reading. A first line that holds names is skipped.
 */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "taxel_model.h"

static float readings[TAXEL_MODEL_READINGS], outputs[TAXEL_MODEL_OUTPUTS], scratch[TAXEL_MODEL_SCRATCH];
static uint8_t status[TAXEL_MODEL_ROWS];

/* Reads a line of readings. Returns 1, 0 at the end, or -1 if it does not hold TAXEL_MODEL_READINGS numbers. */
static int read_line(FILE *file)
{
    static char line[64u * TAXEL_MODEL_READINGS + 64u];
    char *rest = line;
    if (fgets(line, sizeof line, file) == NULL) {
        return 0;
    }
    line[strcspn(line, "\r\n")] = '\0';
    for (unsigned i = 0; i < TAXEL_MODEL_READINGS; i++) {
        char *end;
        readings[i] = strtof(rest, &end);
        if (end == rest) {
            readings[i] = strtof("nan", NULL);
        }
        end += strspn(end, " ");
        if (*end != (i + 1 < TAXEL_MODEL_READINGS ? ',' : '\0')) {
            return -1;
        }
        rest = end + 1;
    }
    return 1;
}

/* Reads a line, but skips names in the first one. */
static int read_frame(FILE *file, unsigned long number)
{
    const int found = read_line(file);
    return found < 0 && number == 1 ? read_line(file) : found;
}

//@if !relative
int main(void)
{
    unsigned long number = 1;
    int found;
//@end
//@if relative
int main(int count, char **arguments)
{
    unsigned long number = 1;
    int found;
    FILE *file = count == 2 ? fopen(arguments[1], "r") : NULL;
    if (file == NULL || read_frame(file, 1) != 1) {
        fprintf(stderr, "usage: decode BASELINE.csv < READINGS.csv, with %u readings a line\n", TAXEL_MODEL_READINGS);
        return 2;
    }
    fclose(file);
//@end
    if (taxel_model_selftest() != 0) {
        fprintf(stderr, "the self-test failed: compile taxel_model.c as the C standard says\n");
        return 1;
    }
//@if relative
    taxel_model_set_baseline(readings);
//@end
    for (unsigned i = 0; i < TAXEL_MODEL_OUTPUTS; i++) {
        printf("%s%s", i == 0 ? "" : ",", taxel_model_output_name(i));
    }
    puts("");
    for (; (found = read_frame(stdin, number)) > 0; number++) {
//@if fill
        taxel_model_fill(readings, scratch);
//@end
        taxel_model_decode(readings, outputs, status, scratch);
        for (unsigned i = 0; i < TAXEL_MODEL_OUTPUTS; i++) {
            printf("%s%.9g", i == 0 ? "" : ",", (double)outputs[i]);
        }
        puts("");
    }
    if (found < 0) {
        fprintf(stderr, "frame %lu: not %u numbers with commas between them\n", number, TAXEL_MODEL_READINGS);
        return 2;
    }
    return 0;
}
