//@if accumulate
/* Adds the weights of one centre, or of one input, times a factor. */
static void accumulate(float *sums, float factor, const float *weights)
{
    for (unsigned j = 0; j < NETWORK_OUTPUTS; j++) {
        sums[j] += factor * weights[j];
    }
}

//@end
/* Adds the weights of four centres, one after the other: sums are loaded once for four. */
static void accumulate_four(float *sums, const float *factors, const float *weights)
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

