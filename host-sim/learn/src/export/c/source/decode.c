/* Writes NaN where outputs cannot be told, and why. */
static void give_up(float *outputs, uint8_t *status, uint8_t why)
{
    fill_with(outputs, NETWORK_OUTPUTS, not_a_number());
    *status = why;
}

/* Infers the outputs of a network, and their status. Returns whether they were decoded, and an input was clamped. */
static int decode_inputs(unsigned network, const float *inputs, float *scratch, float *outputs, uint8_t *status)
{
    const int clamped = infer(network, inputs, scratch, outputs);
    *status = TAXEL_MODEL_DECODED;
    if (clamped && !all_finite(inputs, INPUTS)) {
        give_up(outputs, status, TAXEL_MODEL_MISSING_READING);
        return 0;
    }
//@if direct
    if (!all_finite(outputs, NETWORK_OUTPUTS)) {
        give_up(outputs, status, TAXEL_MODEL_OVERFLOW);
        return 0;
    }
//@end
    return clamped;
}

//@if relative
/* One over each reading of the sensor at rest; NaN where that is unknown. */
static float reciprocals[READINGS];
static uint8_t baseline_is_known;

int taxel_model_set_baseline(const float *baseline)
{
    int unusable = 0;
    for (unsigned i = 0; i < READINGS; i++) {
        reciprocals[i] = not_a_number();
        /* 1/x overflows for the smallest numbers. */
        if (baseline[i] > 0.0f && is_finite(baseline[i]) && is_finite(1.0f / baseline[i])) {
            reciprocals[i] = 1.0f / baseline[i];
        } else {
            unusable++;
        }
    }
    baseline_is_known = 1;
    return unusable;
}

/* A reading relative to the baseline: a product, whose last bit may differ from that of a quotient. */
static float relative(const float *readings, unsigned index)
{
    return baseline_is_known ? readings[index] * reciprocals[index] : not_a_number();
}

//@end
//@if rows
int taxel_model_decode(const float *readings, float *outputs, uint8_t *status, float *scratch)
{
    int clamped = 0;
    for (unsigned row = 0; row < ROWS; row++) {
        const float *inputs = readings + row * INPUTS;
//@if relative
        for (unsigned i = 0; i < INPUTS; i++) {
            scratch[INPUTS + i] = relative(readings, row * INPUTS + i);
        }
        inputs = scratch + INPUTS;
//@end
        clamped |= decode_inputs(row_network[row], inputs, scratch, outputs + row * NETWORK_OUTPUTS, &status[row]);
    }
    return clamped;
}

//@end
//@if array
/* Decodes all rows of a frame at once, behind a projection of all readings to features. */
int taxel_model_decode(const float *readings, float *outputs, uint8_t *status, float *scratch)
{
    float *const features = scratch + INPUTS;
    uint8_t of_all;
    int clamped;
//@if relative
    {
        float *const ratios = scratch + 2 * INPUTS;
        for (unsigned i = 0; i < READINGS; i++) {
            ratios[i] = relative(readings, i);
        }
        readings = ratios;
    }
//@end
    project(projection, readings, READINGS, features, INPUTS);
    clamped = decode_inputs(0, features, scratch, outputs, &of_all);
    if (of_all == TAXEL_MODEL_MISSING_READING && all_finite(readings, READINGS)) {
        of_all = TAXEL_MODEL_OVERFLOW;
    }
    memset(status, of_all, ROWS);
    return clamped;
}

//@end
