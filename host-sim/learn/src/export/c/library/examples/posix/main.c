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
 * An empty field or "nan" is a missing reading. Blank lines are skipped, and names in the first line.
 */
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "taxel_model.h"

static float readings[TAXEL_MODEL_READINGS], outputs[TAXEL_MODEL_OUTPUTS], scratch[TAXEL_MODEL_SCRATCH];
static uint8_t status[TAXEL_MODEL_ROWS];
//@if relative
static taxel_model_t sensor;
//@end

/* Whether a line begins with a name, in quotes or not: a letter, but not that of "nan" or "inf". */
static int holds_names(const char *line)
{
    char *end;
    strtof(line, &end);
    line += strspn(line, " \"");
    return end == line && isalpha((unsigned char)*line);
}

/* Reads the next line of readings, and counts lines in `number`. Returns 1, 0 at the end, or -1 if it does not hold
 * TAXEL_MODEL_READINGS numbers.
 */
static int read_frame(FILE *file, unsigned long *number)
{
    static char line[64u * TAXEL_MODEL_READINGS + 64u];
    char *rest;
    do {
        if (fgets(line, sizeof line, file) == NULL) {
            return 0;
        }
        line[strcspn(line, "\r\n")] = '\0';
        /* Spreadsheets begin a file with a mark of its encoding. */
        rest = line + (++*number == 1 && strncmp(line, "\xef\xbb\xbf", 3) == 0 ? 3 : 0);
    } while (*rest == '\0' || (*number == 1 && holds_names(rest)));
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

//@if !relative
int main(void)
{
    unsigned long number = 0;
    int found;
//@end
//@if relative
int main(int count, char **arguments)
{
    unsigned long number = 0;
    int found;
    FILE *file = count == 2 ? fopen(arguments[1], "r") : NULL;
    if (file == NULL || read_frame(file, &number) != 1) {
        fprintf(stderr, "usage: decode BASELINE.csv < READINGS.csv, with %u readings a line\n", TAXEL_MODEL_READINGS);
        return 2;
    }
    fclose(file);
    number = 0;
//@end
    if (taxel_model_selftest() != 0) {
        fprintf(stderr, "the self-test failed: compile taxel_model.c as the C standard says\n");
        return 1;
    }
//@if relative
    taxel_model_set_baseline(&sensor, readings);
//@end
    for (unsigned i = 0; i < TAXEL_MODEL_OUTPUTS; i++) {
        printf("%s%s", i == 0 ? "" : ",", taxel_model_output_name(i));
    }
    puts("");
    while ((found = read_frame(stdin, &number)) > 0) {
//@if fill
        taxel_model_fill(@GIVE@readings, scratch);
//@end
        taxel_model_decode(@GIVE@readings, outputs, status, scratch);
        for (unsigned i = 0; i < TAXEL_MODEL_OUTPUTS; i++) {
            printf("%s%.9g", i == 0 ? "" : ",", (double)outputs[i]);
        }
        puts("");
    }
    if (found < 0) {
        fprintf(stderr, "line %lu: not %u numbers with commas between them: give the readings that taxel_model.h lists\n",
                number, TAXEL_MODEL_READINGS);
        return 2;
    }
    return 0;
}
