/* @TITLE@
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * A model of Taxel as C99: no heap, no libm, no state of its own. It equals Taxel's own decoder bit for bit.
 * `taxel export` wrote this file; export it again rather than edit it.
 *
@COLUMNS@ *
@COST@ */
#ifndef TAXEL_MODEL_H
#define TAXEL_MODEL_H

#include <stdint.h>

#define TAXEL_MODEL_ROWS @ROWS@u      /* row-wires */
#define TAXEL_MODEL_READINGS @READINGS@u  /* readings of a frame, row after row */
#define TAXEL_MODEL_OUTPUTS @OUTPUTS@u   /* outputs of a frame, row after row */
#define TAXEL_MODEL_ROW_READINGS @ROW_READINGS@u  /* readings of a row */
#define TAXEL_MODEL_ROW_OUTPUTS @ROW_OUTPUTS@u   /* outputs of a row: outputs[i] is of row i / TAXEL_MODEL_ROW_OUTPUTS */
#define TAXEL_MODEL_SCRATCH @SCRATCH@u   /* floats of working space */
#define TAXEL_MODEL_RELATIVE @RELATIVE@    /* 1: readings are taken relative to a baseline */
#define TAXEL_MODEL_CONFIDENCE @CONFIDENCE@  /* 1: taxel_model_assess exists */
#define TAXEL_MODEL_FILL @FILL@        /* 1: taxel_model_fill exists */
//@if ohm
/* Limits of readings in Ω. Below them, two wires are shorted; above them, one is broken: such readings count as missing. */
#define TAXEL_MODEL_SHORTED_BELOW_OHM @SHORTED_BELOW@
#define TAXEL_MODEL_OPEN_ABOVE_OHM @OPEN_ABOVE@
//@end

/* Numbers of the outputs. */
@OUTPUT_NUMBERS@
#ifdef __cplusplus
extern "C" {
#endif

/* Result of decoding a row. */
enum taxel_model_status {
    /* The outputs are valid. */
    TAXEL_MODEL_DECODED = @DECODED@,
    /* A reading of the row is not finite@OR_ANOTHER_ROWS@; the outputs are NaN. */
    TAXEL_MODEL_MISSING_READING = @MISSING_READING@,
    /* Readings are so large that an output overflowed; the outputs are NaN. */
    TAXEL_MODEL_OVERFLOW = @OVERFLOW@,
    /* No touch is strong enough to have a position: outputs that are positions are NaN, all others are valid. */
    TAXEL_MODEL_NO_TOUCH = @NO_TOUCH@
};

//@if relative
/* Sensor at rest. Each sensor that shares the model has its own. While it is all zero, all readings count as missing. */
typedef struct {
    float reciprocals[TAXEL_MODEL_READINGS]; /* reciprocal of each reading at rest; 0 if it is unknown */
} taxel_model_t;

/* Sets the baseline: readings of the untouched sensor [TAXEL_MODEL_READINGS], by which later ones are divided.
 * Returns how many channels have no usable baseline (NaN, infinite, not positive@OR_BEYOND@): their readings count as
 * missing in every frame.
 */
int taxel_model_set_baseline(taxel_model_t *sensor, const float *baseline);

//@end
/* Decodes one frame: `readings` [TAXEL_MODEL_READINGS], NaN where one is missing, to `outputs` [TAXEL_MODEL_OUTPUTS]
 * and the `status` of each row [TAXEL_MODEL_ROWS]. `scratch` [TAXEL_MODEL_SCRATCH] is working space. No two arrays may
 * overlap.
//@if ohm
 * Readings outside the limits become NaN first.
//@end
 *
 * Returns 1 if an input of a decoded row was clamped, because it lies more than an eighth of its range of training
 * outside that range: such outputs are unreliable. Otherwise it returns 0.
 */
int taxel_model_decode(@SENSOR@float *readings, float *outputs, uint8_t *status, float *scratch);

//@if assess
/* Estimates how far off the outputs of a frame may be: a standard deviation of each, in its unit, in `deviations`
 * [TAXEL_MODEL_OUTPUTS]. Returns the novelty of the frame in nats: above 0, it is unlike the frames of training. All are NaN
 * if a reading is missing. `scratch` is that of taxel_model_decode.
 */
float taxel_model_assess(@SENSOR@float *readings, float *deviations, float *scratch);

//@end
//@if fill
/* Replaces missing readings (not finite@OR_BEYOND@) by those expected from the others, unless more than one in four is missing.
 * Returns how many it replaced. `scratch` is that of taxel_model_decode.
 */
int taxel_model_fill(@SENSOR@float *readings, float *scratch);

//@end
/* Name of an output or of a reading, counted from 0; a null pointer if there is none. */
const char *taxel_model_output_name(unsigned output);
const char *taxel_model_reading_name(unsigned reading);

/* CRC-32 of the blob that this model comes from, which identifies the model. */
uint32_t taxel_model_crc(void);

/* Decodes a few frames and compares all bits. Returns 0 if they are right, otherwise the number of the first frame
 * that is not, from 1: the compiler's options then change results from those of the C standard.
 */
int taxel_model_selftest(void);

#ifdef __cplusplus
}
#endif

#endif
