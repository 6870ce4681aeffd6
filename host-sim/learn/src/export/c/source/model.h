/* @TITLE@
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * A model of Taxel as C99: no heap, no libm, no state@BUT_BASELINE@. It gives the bits of Taxel's own decoder.
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

/* Decodes one frame: `readings` [TAXEL_MODEL_READINGS], NaN where one is missing, to `outputs` [TAXEL_MODEL_OUTPUTS]
 * and the `status` of each row [TAXEL_MODEL_ROWS]. `scratch` [TAXEL_MODEL_SCRATCH] is working space. No two arrays may
 * overlap.
 *
 * Returns 1 if an input of a decoded row was clamped, because it lies more than an eighth of its range of training
 * outside that range: such outputs are guesses. Else it returns 0.
 */
int taxel_model_decode(const float *readings, float *outputs, uint8_t *status, float *scratch);

//@if relative
/* Takes the readings of the untouched sensor [TAXEL_MODEL_READINGS], which readings are divided by. Before that, all
 * readings are missing. Returns how many channels have no usable baseline (NaN, infinite, not positive): their
 * readings are missing in every frame.
 */
int taxel_model_set_baseline(const float *baseline);

//@end
//@if assess
/* Tells how far off the outputs of a frame may be: a standard deviation of each, in its unit, to `deviations`
 * [TAXEL_MODEL_OUTPUTS]. Returns the novelty of the frame in nats: above 0, it is unlike the frames of training. All are NaN
 * if a reading is missing. `scratch` is that of taxel_model_decode.
 */
float taxel_model_assess(const float *readings, float *deviations, float *scratch);

//@end
//@if fill
/* Replaces missing readings (not finite) by those expected of the others; nothing if more than one in four is missing.
 * Returns how many it replaced. `scratch` is that of taxel_model_decode.
 */
int taxel_model_fill(float *readings, float *scratch);

//@end
/* Name of an output, from 0; a null pointer if there is none. */
const char *taxel_model_output_name(unsigned output);

/* CRC-32 of the blob that this model comes from, which tells models apart. */
uint32_t taxel_model_crc(void);

/* Decodes a few frames and compares all bits. Returns 0 if they are right, else the number of the first frame that is
 * not, from 1: the compiler was told to compute otherwise than the C standard says.@FORGETS@
 */
int taxel_model_selftest(void);

#ifdef __cplusplus
}
#endif

#endif
