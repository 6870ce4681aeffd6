
/* Infers the outputs of a network, and their status. Returns whether they were decoded, and an input was clamped. */
static int decode_inputs@OF@(unsigned network, const float *inputs, float *scratch, float *outputs, uint8_t *status)
{
    const int clamped = infer@OF@(network, inputs, scratch, outputs);
    *status = TAXEL_MODEL_DECODED;
    if (clamped && !all_finite(inputs, INPUTS)) {
        give_up(outputs, NETWORK_OUTPUTS, status, TAXEL_MODEL_MISSING_READING);
        return 0;
    }
//@if f32
    if (!all_finite(outputs, NETWORK_OUTPUTS)) {
        give_up(outputs, NETWORK_OUTPUTS, status, TAXEL_MODEL_OVERFLOW);
        return 0;
    }
//@end
    return clamped;
}

//@if array
/* Decodes the outputs that one network makes of a whole frame. Sets *worst to their status if that is worse. Returns
 * whether they were decoded, and an input was clamped.
 */
static int decode_part@OF@(@SENSOR@const float *readings, float *outputs, uint8_t *worst, float *scratch)
{
    const float *inputs = readings;
    uint8_t status;
    int clamped;
//@if touch
    float *const seen = scratch + INPUTS + PROJECTED;
    const float strength = shape_and_strength(@GIVEN@touch@OF@, readings, seen);
    inputs = seen;
//@end
//@if ratios
    float *const seen = scratch + INPUTS + PROJECTED;
    for (unsigned i = 0; i < READINGS; i++) {
        seen[i] = relative(sensor, readings, i);
    }
    inputs = seen;
//@end
//@if projection
    project(projection@OF@, inputs, SEEN, scratch + INPUTS, INPUTS);
    inputs = scratch + INPUTS;
//@end
    clamped = decode_inputs@OF@(0, inputs, scratch, outputs, &status);
    /* Features can overflow although no reading is missing. */
    if (status == TAXEL_MODEL_MISSING_READING && all_finite(readings, READINGS)
//@if relative
        && knows_all(sensor)
//@end
    ) {
        status = TAXEL_MODEL_OVERFLOW;
    }
//@if place
    if (status == TAXEL_MODEL_DECODED && strength < touch@OF@[LEAST]) {
        give_up(outputs, NETWORK_OUTPUTS, &status, TAXEL_MODEL_NO_TOUCH);
    }
//@end
//@if amount
    if (status == TAXEL_MODEL_DECODED) {
        for (unsigned j = 0; j < NETWORK_OUTPUTS; j++) {
            outputs[j] *= strength > touch@OF@[MOST] ? touch@OF@[MOST] : strength;
        }
//@if f32
        if (!all_finite(outputs, NETWORK_OUTPUTS)) {
            give_up(outputs, NETWORK_OUTPUTS, &status, TAXEL_MODEL_OVERFLOW);
        }
//@end
    }
//@end
    if (severity[status] > severity[*worst]) {
        *worst = status;
    }
    return clamped;
}

#undef INPUTS
#undef NETWORK_OUTPUTS
#undef SEEN
#undef PROJECTED
#undef SQUARE_SHIFT

//@end
