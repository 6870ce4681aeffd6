/* Reading model: factors of all readings, with z = (r - mean) scale and parts V of each reading in the factors. E[z of those
 * missing] = V_M x, with (I - V_M' V_M) x = V_O' z_O.
 */
#define FEATURES (FACTORS + 1u)

/* Writes standardised readings, and returns the sum of their squares. */
static float standardise(@SENSOR@const float *readings, float *z)
{
    float square = 0.0f;
    for (unsigned i = 0; i < READINGS; i++) {
        z[i] = (READING(i) - reading_mean[i]) * reading_scale[i];
        square += z[i] * z[i];
    }
    return square;
}

static float product_of(const float *a, const float *b, unsigned length)
{
    float sum = 0.0f;
    for (unsigned i = 0; i < length; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* Solves the equations of a matrix, given by its lower triangle, by Cholesky's decomposition. Returns whether the
 * matrix is positive definite in f32.
 */
static int solve(float *matrix, float *x)
{
    float *row = matrix;
    for (unsigned i = 0; i < FACTORS; i++) {
        const float *other = matrix;
        float left;
        for (unsigned j = 0; j < i; j++) {
            row[j] = (row[j] - product_of(row, other, j)) / other[j];
            other += j + 1;
        }
        left = row[i] - product_of(row, row, i);
        if (!(left > 0.0f)) {
            return 0;
        }
        row[i] = square_root(left);
        x[i] = (x[i] - product_of(row, x, i)) / row[i];
        row += i + 1;
    }
    for (unsigned i = FACTORS; i-- > 0;) {
        row -= i + 1;
        x[i] /= row[i];
        for (unsigned j = 0; j < i; j++) {
            x[j] -= row[j] * x[i];
        }
    }
    return 1;
}

int taxel_model_fill(@SENSOR@float *readings, float *scratch)
{
    float *const z = scratch, *const factors = z + READINGS, *const matrix = factors + FEATURES;
    unsigned missing = 0;
    int filled = 0;
//@if ohm
    drop_faulty(readings);
//@end
    if (all_finite(readings, READINGS)) {
        return 0;
    }
    standardise(@GIVEN@readings, z);
    fill_with(matrix, FACTORS * (FACTORS + 1u) / 2u, 0.0f);
    for (unsigned i = 0; i < FACTORS; i++) {
        matrix[i * (i + 1) / 2 + i] = 1.0f;
    }
    for (unsigned i = 0; i < READINGS; i++) {
        if (!is_finite(z[i])) {
            const float *parts = reading_parts + FACTORS + i * FACTORS;
            float *place = matrix;
            for (unsigned j = 0; j < FACTORS; j++) {
                for (unsigned k = 0; k <= j; k++) {
                    *place++ -= parts[j] * parts[k];
                }
            }
            z[i] = 0.0f;
            missing++;
        }
    }
    project(reading_parts, z, READINGS, factors, FACTORS);
    if (missing * 4 > READINGS || !solve(matrix, factors)) {
        return 0;
    }
    for (unsigned i = 0; i < READINGS; i++) {
        if (!is_finite(readings[i])) {
            const float moved = product_of(reading_parts + FACTORS + i * FACTORS, factors, FACTORS);
            const float expected = reading_mean[i] + (reading_scale[i] > 0.0f ? moved / reading_scale[i] : 0.0f);
//@if relative
            const float reading = expected / sensor->reciprocals[i];
//@end
//@if !relative
            const float reading = expected;
//@end
            if (is_finite(reading)) {
                readings[i] = reading;
                filled++;
            }
        }
    }
    return filled;
}

//@if assess
/* A mixture of Gaussians over the features of a frame: its scores in the factors, and its distance from what they explain.
 * A component has c, -o of each feature, and the columns of W; its log density is c - |W f - o|^2 / 2.
 */
#define COMPONENT (1u + FEATURES + FEATURES * FEATURES)

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

/* Writes the root of the mean variance of each output over the components that are probable. */
static void set_deviations(const float *probabilities, float *deviations)
{
    float sum = 0.0f;
    fill_with(deviations, OUTPUTS, 0.0f);
    for (unsigned k = 0; k < COMPONENTS; k++) {
        if (probabilities[k] >= 1.0f / 64.0f) {
            sum += probabilities[k];
            for (unsigned j = 0; j < OUTPUTS; j++) {
                deviations[j] += probabilities[k] * variances[k * OUTPUTS + j];
            }
        }
    }
    for (unsigned j = 0; j < OUTPUTS; j++) {
        deviations[j] = square_root(deviations[j] / sum);
    }
}

float taxel_model_assess(@SENSOR@float *readings, float *deviations, float *scratch)
{
    float *const z = scratch, *const features = z + READINGS, *const whitened = features + FEATURES;
    float *const densities = whitened + FEATURES;
    float sum = 0.0f, novelty;
    float best = float_of(0xff800000u); /* less than any number */
    float square, explained = 0.0f;
//@if ohm
    drop_faulty(readings);
//@end
    square = standardise(@GIVEN@readings, z);
    if (square != square) {
        fill_with(deviations, OUTPUTS, not_a_number());
        return not_a_number();
    }
    project(reading_parts, z, READINGS, features, FACTORS);
    for (unsigned i = 0; i < FACTORS; i++) {
        explained += features[i] * features[i];
    }
    features[FACTORS] = square - explained > 0.0f ? square_root(square - explained) : 0.0f;
    for (unsigned k = 0; k < COMPONENTS; k++) {
        const float *const component = mixture + k * COMPONENT;
        float distance = 0.0f;
        project(component + 1, features, FEATURES, whitened, FEATURES);
        for (unsigned i = 0; i < FEATURES; i++) {
            distance += whitened[i] * whitened[i];
        }
        densities[k] = component[0] - 0.5f * distance;
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
//@end
