/* @TITLE@
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * A model of Taxel as C99: no heap, no libm, no state of its own. It gives the bits of Taxel's own decoder.
 * `taxel export` wrote this file; write it anew rather than edit it.
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
#define TAXEL_MODEL_RELATIVE @RELATIVE@    /* 1: readings count relative to a baseline */
#define TAXEL_MODEL_CONFIDENCE @CONFIDENCE@  /* 1: there is taxel_model_assess */
#define TAXEL_MODEL_FILL @FILL@        /* 1: there is taxel_model_fill */
//@if ohm
/* Limits of readings in Ω. Below, the two wires are shorted; above, one is broken: such readings are missing. */
#define TAXEL_MODEL_SHORTED_BELOW_OHM @SHORTED_BELOW@
#define TAXEL_MODEL_OPEN_ABOVE_OHM @OPEN_ABOVE@
//@end

/* Numbers of the outputs. */
@OUTPUT_NUMBERS@
#ifdef __cplusplus
extern "C" {
#endif

/* How the decoding of a row ended. */
enum taxel_model_status {
    /* The outputs are valid. */
    TAXEL_MODEL_DECODED = @DECODED@,
    /* A reading of the row is not finite@OR_ANOTHER_ROWS@; the outputs are NaN. */
    TAXEL_MODEL_MISSING_READING = @MISSING_READING@,
    /* Readings are so large that an output overflowed; the outputs are NaN. */
    TAXEL_MODEL_OVERFLOW = @OVERFLOW@,
    /* Nothing touches the sensor enough to have a place: outputs that are places are NaN, all others are valid. */
    TAXEL_MODEL_NO_TOUCH = @NO_TOUCH@
};

//@if relative
/* A sensor at rest. Sensors that share the model have one each. Where it is all zero, all readings are missing. */
typedef struct {
    float reciprocals[TAXEL_MODEL_READINGS]; /* one over each reading at rest; 0 where that is unknown */
} taxel_model_t;

/* Takes the readings of the untouched sensor [TAXEL_MODEL_READINGS], which its readings are divided by. Returns how many
 * channels have no usable baseline (NaN, infinite, not positive@OR_BEYOND@): their readings are missing in every frame.
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
 * outside that range: such outputs are guesses. Else it returns 0.
 */
int taxel_model_decode(@SENSOR@float *readings, float *outputs, uint8_t *status, float *scratch);

//@if assess
/* Tells how far off the outputs of a frame may be: a standard deviation of each, in its unit, to `deviations`
 * [TAXEL_MODEL_OUTPUTS]. Returns the novelty of the frame in nats: above 0, it is unlike the frames of training. All are NaN
 * if a reading is missing. `scratch` is that of taxel_model_decode.
 */
float taxel_model_assess(@SENSOR@float *readings, float *deviations, float *scratch);

//@end
//@if fill
/* Replaces missing readings (not finite@OR_BEYOND@) by those expected of the others; nothing if more than one in four is missing.
 * Returns how many it replaced. `scratch` is that of taxel_model_decode.
 */
int taxel_model_fill(@SENSOR@float *readings, float *scratch);

//@end
/* Names of an output and of a reading, from 0; a null pointer if there is none. */
const char *taxel_model_output_name(unsigned output);
const char *taxel_model_reading_name(unsigned reading);

/* CRC-32 of the blob that this model comes from, which tells models apart. */
uint32_t taxel_model_crc(void);

/* Decodes a few frames and compares all bits. Returns 0 if they are right, else the number of the first frame that is
 * not, from 1: the compiler was told to compute otherwise than the C standard says.
 */
int taxel_model_selftest(void);

#ifdef __cplusplus
}
#endif

#endif
