/* A network in f32 with distances from products: 2^(b + a.x - g x.x), with inputs in units from the middle of their
 * range. 2^31 units are half the range that inputs are clamped to.
 */
struct expanded {
    const float *midpoint, *per_unit; /* of each input */
    float decay;                      /* g */
    unsigned count;                   /* centres, a multiple of four; some may have no weight */
    const float *exponents;           /* b and a of one centre after the other */
    const float *weights;             /* outputs of one centre after the other */
    const float *bias;
//@if affine
    const float *affine; /* outputs of one input after the other, or null */
//@end
};

/* Sum of first, second and products, in four partial sums. */
static float sum_of_products(float first, float second, const float *a, const float *b)
{
    float sum[4] = {first, second, 0.0f, 0.0f};
    unsigned i = 0;
    UNROLL
    for (; i + 4 <= INPUTS; i += 4) {
        sum[0] += a[i] * b[i];
        sum[1] += a[i + 1] * b[i + 1];
        sum[2] += a[i + 2] * b[i + 2];
        sum[3] += a[i + 3] * b[i + 3];
    }
    for (; i < INPUTS; i++) {
        sum[i % 4] += a[i] * b[i];
    }
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

/* 2^u. The low bits of the rounded number are the power of two, which goes straight into the exponent's bits. */
static float power_of_two(float u)
{
    const float rounded = u + 0x1.8p+23f;
    const float f = u - (rounded - 0x1.8p+23f);
    const float p = (((((@EXP2_5@) * f + @EXP2_4@) * f + @EXP2_3@) * f + @EXP2_2@) * f + @EXP2_1@) * f + @EXP2_0@;
    return float_of(bits_of(p) + (bits_of(rounded) << 23));
}

/* Infers outputs; `x` is room for the inputs. Returns whether one was clamped, or is not finite. */
static int infer_f32(const struct expanded *network, const float *inputs, float *x, float *outputs)
{
    int clamped = 0;
    float shared;
    for (unsigned i = 0; i < INPUTS; i++) {
        x[i] = (float)whole_units((inputs[i] - network->midpoint[i]) * network->per_unit[i], &clamped);
    }
    fill_with(outputs, NETWORK_OUTPUTS, 0.0f);
//@if affine
    for (unsigned i = 0; network->affine && i < INPUTS; i++) {
        accumulate(outputs, x[i], network->affine + i * NETWORK_OUTPUTS);
    }
//@end
    shared = -(network->decay * sum_of_products(0.0f, 0.0f, x, x));
    for (unsigned k = 0; k < network->count; k += 4) {
        const float *exponents = network->exponents + k * (1 + INPUTS);
        float activations[4];
        for (unsigned of_four = 0; of_four < 4; of_four++) {
            activations[of_four] = power_of_two(sum_of_products(exponents[0], shared, x, exponents + 1));
            exponents += 1 + INPUTS;
        }
        accumulate_four(outputs, activations, network->weights + k * NETWORK_OUTPUTS);
    }
    for (unsigned j = 0; j < NETWORK_OUTPUTS; j++) {
        outputs[j] += network->bias[j];
    }
    return clamped;
}

