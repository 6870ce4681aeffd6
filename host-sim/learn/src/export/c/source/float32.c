
//@if first
/* A network in f32. */
struct float32 {
    const float *minimum, *per_span; /* of each input in training */
    const float *centres;            /* inputs of one centre after the other */
    const float *decay;              /* 1/(2 width^2) of each centre */
    unsigned count;                  /* centres */
    const float *weights;            /* outputs of one centre after the other */
    const float *bias;
//@if affine
    const float *affine; /* outputs of one input after the other, or null */
//@end
};
//@end

/* Adds the weights of one centre, or of one input, times a factor. */
static void accumulate@OF@(float *sums, float factor, const float *weights)
{
    for (unsigned j = 0; j < NETWORK_OUTPUTS; j++) {
        sums[j] += factor * weights[j];
    }
}

/* Adds the weights of four centres, one after the other: sums are loaded once for four. */
static void accumulate_four@OF@(float *sums, const float *factors, const float *weights)
{
    const float f0 = factors[0], f1 = factors[1], f2 = factors[2], f3 = factors[3];
    for (unsigned j = 0; j < NETWORK_OUTPUTS; j++) {
        float sum = sums[j];
        sum += f0 * weights[j];
        sum += f1 * weights[NETWORK_OUTPUTS + j];
        sum += f2 * weights[2 * NETWORK_OUTPUTS + j];
        sum += f3 * weights[3 * NETWORK_OUTPUTS + j];
        sums[j] = sum;
    }
}

/* Squared distance, in four partial sums. */
static float squared_distance@OF@(const float *a, const float *b)
{
    float sum[4] = {0.0f, 0.0f, 0.0f, 0.0f};
    unsigned i = 0;
    UNROLL
    for (; i + 4 <= INPUTS; i += 4) {
        const float d0 = a[i] - b[i], d1 = a[i + 1] - b[i + 1];
        const float d2 = a[i + 2] - b[i + 2], d3 = a[i + 3] - b[i + 3];
        sum[0] += d0 * d0;
        sum[1] += d1 * d1;
        sum[2] += d2 * d2;
        sum[3] += d3 * d3;
    }
    for (; i < INPUTS; i++) {
        const float d = a[i] - b[i];
        sum[i % 4] += d * d;
    }
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

static float activation_of@OF@(const struct float32 *network, unsigned centre, const float *scaled)
{
    const float square = squared_distance@OF@(scaled, network->centres + centre * INPUTS);
    return exponential(-network->decay[centre] * square);
}

/* Infers outputs; `scaled` is room for the inputs. Returns whether one was clamped, or is not finite. */
static int infer_float32@OF@(const struct float32 *network, const float *inputs, float *scaled, float *outputs)
{
    int clamped = 0;
    for (unsigned i = 0; i < INPUTS; i++) {
        const float x = (inputs[i] - network->minimum[i]) * network->per_span[i];
        clamped |= !(x >= -0.125f && x < 1.125f);
        scaled[i] = x < -0.125f ? -0.125f : x > 1.125f ? 1.125f : x;
    }
    fill_with(outputs, NETWORK_OUTPUTS, 0.0f);
//@if affine
    for (unsigned i = 0; network->affine && i < INPUTS; i++) {
        accumulate@OF@(outputs, scaled[i], network->affine + i * NETWORK_OUTPUTS);
    }
//@end
    for (unsigned k = 0; k + 4 <= network->count; k += 4) {
        float activations[4];
        for (unsigned of_four = 0; of_four < 4; of_four++) {
            activations[of_four] = activation_of@OF@(network, k + of_four, scaled);
        }
        accumulate_four@OF@(outputs, activations, network->weights + k * NETWORK_OUTPUTS);
    }
    for (unsigned k = network->count / 4 * 4; k < network->count; k++) {
        accumulate@OF@(outputs, activation_of@OF@(network, k, scaled), network->weights + k * NETWORK_OUTPUTS);
    }
    for (unsigned j = 0; j < NETWORK_OUTPUTS; j++) {
        outputs[j] += network->bias[j];
    }
    return clamped;
}

