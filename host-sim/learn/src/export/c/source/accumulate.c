static void accumulate(float *sums, float factor, const float *weights)
{
    for (unsigned j = 0; j < NETWORK_OUTPUTS; j++) {
        sums[j] += factor * weights[j];
    }
}

