
//@if ohm
//@if mixed
/* Whether each reading is a resistance: others have no limits. */
@IN_OHM@
//@end
/* Whether the sensor can have this reading: wires are neither shorted nor open. */
static int is_sound(unsigned reading, float value)
{
//@if mixed
    if (!in_ohm[reading]) {
        return 1;
    }
//@end
    (void)reading;
    return value >= TAXEL_MODEL_SHORTED_BELOW_OHM && value <= TAXEL_MODEL_OPEN_ABOVE_OHM;
}

static void drop_faulty(float *readings)
{
    for (unsigned i = 0; i < READINGS; i++) {
        if (!is_sound(i, readings[i])) {
            readings[i] = not_a_number();
        }
    }
}

//@end
//@if relative
int taxel_model_set_baseline(taxel_model_t *sensor, const float *baseline)
{
    int unusable = 0;
    for (unsigned i = 0; i < READINGS; i++) {
        /* 1/x overflows for the smallest numbers. */
        const int usable = baseline[i] > 0.0f && is_finite(baseline[i]) && is_finite(1.0f / baseline[i])
//@if ohm
            && is_sound(i, baseline[i])
//@end
            ;
        sensor->reciprocals[i] = usable ? 1.0f / baseline[i] : 0.0f;
        unusable += !usable;
    }
    return unusable;
}

/* A reading relative to the baseline: a product, whose last bit may differ from that of a quotient. */
static float relative(const taxel_model_t *sensor, const float *readings, unsigned index)
{
    const float reciprocal = sensor->reciprocals[index];
    return reciprocal > 0.0f ? readings[index] * reciprocal : not_a_number();
}

//@if array
static int knows_all(const taxel_model_t *sensor)
{
    for (unsigned i = 0; i < READINGS; i++) {
        if (!(sensor->reciprocals[i] > 0.0f)) {
            return 0;
        }
    }
    return 1;
}

//@end
//@end
//@if reading
//@if relative
#define READING(i) relative(sensor, readings, i)
//@end
//@if !relative
#define READING(i) readings[i]
//@end

//@end
//@if array
/* How bad each status is: that of a frame is the worst of its networks. */
static const uint8_t severity[] = {
    [TAXEL_MODEL_DECODED] = 0, [TAXEL_MODEL_NO_TOUCH] = 1, [TAXEL_MODEL_OVERFLOW] = 2, [TAXEL_MODEL_MISSING_READING] = 3
};

//@end
//@if touches
static float magnitude(float value)
{
#if defined(__GNUC__)
    return __builtin_fabsf(value);
#else
    return float_of(bits_of(value) & 0x7fffffffu);
#endif
}

/* Twice the positive part of a number. Without a comparison, so that what is not a number stays so. */
static float twice_positive(float x)
{
    return x + magnitude(x);
}

/* Binary logarithm of a positive number within 0.008: the exponent's bits, and a parabola for the fraction. */
static float binary_logarithm(float x)
{
    const uint32_t bits = bits_of(x);
    const float exponent = (float)(bits >> 23) - 127.0f;
    const float fraction = float_of((bits & 0x7fffffu) | 0x3f800000u) - 1.0f;
    /* What is not a number has an exponent as well. */
    return exponent + fraction + 0.3447f * fraction * (1.0f - fraction) + (x - x);
}

/* Numbers of a touch: what is added to its strength, and to that before its logarithm; the strength from which it has a
 * place, and up to which amounts grow; 1 or -1 if it moves readings up or down, 0 if either way; and then level at rest
 * and threshold of each reading.
 */
enum { FLOOR, LOGARITHM_FLOOR, LEAST, MOST, SIDE, OF_READINGS };

/* Writes the shape of a touch and the logarithm of its strength to inputs [READINGS + 1], and returns the strength. */
static float shape_and_strength(@SENSOR@const float *touch, const float *readings, float *inputs)
{
    const float *const of_readings = touch + OF_READINGS, side = touch[SIDE];
    const int either = side == 0.0f;
    float sum = 0.0f, strength, scale;
    for (unsigned i = 0; i < READINGS; i++) {
        const float change = READING(i) - of_readings[2 * i], threshold = of_readings[2 * i + 1];
        const float above = twice_positive((either ? change : side * change) - threshold);
        const float below = either ? twice_positive(-(change + threshold)) : 0.0f;
        inputs[i] = above - below;
        sum += above + below;
    }
    strength = 0.5f * sum + touch[FLOOR];
    scale = 0.5f / strength;
    for (unsigned i = 0; i < READINGS; i++) {
        inputs[i] *= scale;
    }
    inputs[READINGS] = binary_logarithm(strength + touch[LOGARITHM_FLOOR]);
    return strength;
}

//@end
