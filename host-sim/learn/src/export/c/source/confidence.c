/* Confidence: a mixture of Gaussians over features of a frame. A component has c, o of each feature, and the rows of a
 * lower triangle W; its log density is c - |W f - o|^2 / 2.
 */
#define FEATURES (DIRECTIONS + 1u)
#define COMPONENT (1u + FEATURES + FEATURES * (FEATURES + 1u) / 2u)

/* Natural logarithm of a number from 1 on, by FreeBSD's e_logf.c:
 *
 * Copyright (C) 1993 by Sun Microsystems, Inc. All rights reserved. Developed at SunPro, a Sun Microsystems, Inc.
 * business. Permission to use, copy, modify, and distribute this software is freely granted, provided that this notice
 * is preserved.
 */
static float logarithm(float x)
{
    const uint32_t bits = bits_of(x) + (0x3f800000u - 0x3f3504f3u);
    const float k = (float)((int32_t)(bits >> 23) - 0x7f);
    const float f = float_of((bits & 0x7fffffu) + 0x3f3504f3u) - 1.0f;
    const float s = f / (2.0f + f);
    const float z = s * s;
    const float w = z * z;
    const float t1 = w * (0x1.999c26p-2f + w * 0x1.f13c4cp-3f);
    const float t2 = z * (0x1.555554p-1f + w * 0x1.23d3dcp-2f);
    const float r = t2 + t1;
    const float half_square = 0.5f * f * f;
    return s * (half_square + r) + k * 0x1.2fefa2p-17f - half_square + f + k * 0x1.62e3p-1f;
}

/* Product of a row of the triangle with as many features, in groups of four. */
static float product_of(const float *row, const float *features, unsigned length)
{
    float sum = 0.0f;
    unsigned i = 0;
    for (; i + 4 <= length; i += 4) {
        sum += (row[i] * features[i] + row[i + 1] * features[i + 1])
            + (row[i + 2] * features[i + 2] + row[i + 3] * features[i + 3]);
    }
    for (; i < length; i++) {
        sum += row[i] * features[i];
    }
    return sum;
}

/* Log density of a component; any number below the floor if it is below that. */
static float density_of(const float *component, const float *features, float floor)
{
    const float *row = component + 1 + FEATURES;
    float density = component[0];
    for (unsigned length = 1; length <= FEATURES; length++) {
        const float whitened = product_of(row, features, length) - component[length];
        density -= 0.5f * (whitened * whitened);
        if (density < floor) {
            break; /* It only falls. */
        }
        row += length;
    }
    return density;
}

/* Writes the root of the mean variance of each output over the four most probable components. */
static void set_deviations(const float *probabilities, float *deviations)
{
    unsigned chosen[4] = {0, 0, 0, 0};
    float share[4] = {0.0f, 0.0f, 0.0f, 0.0f};
    float per_sum;
    for (unsigned k = 0; k < COMPONENTS; k++) {
        unsigned next = k;
        float probability = probabilities[k];
        for (unsigned place = 0; place < 4; place++) {
            if (probability > share[place]) {
                const unsigned index = chosen[place];
                const float other = share[place];
                chosen[place] = next;
                share[place] = probability;
                next = index;
                probability = other;
            }
        }
    }
    per_sum = 1.0f / (share[0] + share[1] + share[2] + share[3]);
    for (unsigned place = 0; place < 4; place++) {
        share[place] *= per_sum;
    }
    for (unsigned j = 0; j < OUTPUTS; j++) {
        const float *of_output = variances + j;
        deviations[j] = square_root((share[0] * of_output[chosen[0] * OUTPUTS] + share[1] * of_output[chosen[1] * OUTPUTS])
                                    + (share[2] * of_output[chosen[2] * OUTPUTS] + share[3] * of_output[chosen[3] * OUTPUTS]));
    }
}

float taxel_model_assess(const float *readings, float *deviations, float *scratch)
{
    float *const z = scratch, *const features = z + READINGS, *const densities = features + FEATURES;
    float square = 0.0f, along = 0.0f, sum = 0.0f, novelty;
    float best = float_of(0xff800000u); /* less than any number */
    for (unsigned i = 0; i < READINGS; i++) {
        z[i] = (READING(i) - reading_mean[i]) * reading_scale[i];
        square += z[i] * z[i];
    }
    if (square != square) {
        fill_with(deviations, OUTPUTS, not_a_number());
        return not_a_number();
    }
    project(directions, z, READINGS, features, DIRECTIONS);
    for (unsigned i = 0; i < DIRECTIONS; i++) {
        along += features[i] * features[i];
    }
    features[DIRECTIONS] = square - along > 0.0f ? square_root(square - along) : 0.0f;
    for (unsigned k = 0; k < COMPONENTS; k++) {
        /* Below 24 nats less than the best, nothing counts. */
        densities[k] = density_of(mixture + k * COMPONENT, features, best - 24.0f);
        if (densities[k] != densities[k] || densities[k] > best) {
            best = densities[k];
        }
    }
    if (!is_finite(best)) {
        fill_with(deviations, OUTPUTS, not_a_number());
        return FLT_MAX;
    }
    for (unsigned k = 0; k < COMPONENTS; k++) {
        densities[k] = exponential(densities[k] - best);
        sum += densities[k];
    }
    set_deviations(densities, deviations);
    novelty = -(best + logarithm(sum)) - NOVELTY_THRESHOLD;
    return novelty < -FLT_MAX ? -FLT_MAX : novelty > FLT_MAX ? FLT_MAX : novelty;
}

