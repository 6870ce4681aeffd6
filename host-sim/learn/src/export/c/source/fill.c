/* Filling of missing readings, by factor analysis: with z = (r - mean) scale and parts V of each reading in the factors,
 * E[z of those missing] = V_M x, with (I - V_M' V_M) x = V_O' z_O.
 */
static float plain_product(const float *a, const float *b, unsigned length)
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
            row[j] = (row[j] - plain_product(row, other, j)) / other[j];
            other += j + 1;
        }
        left = row[i] - plain_product(row, row, i);
        if (!(left > 0.0f)) {
            return 0;
        }
        row[i] = square_root(left);
        x[i] = (x[i] - plain_product(row, x, i)) / row[i];
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

int taxel_model_fill(float *readings, float *scratch)
{
    float *const matrix = scratch, *const factors = scratch + FACTORS * (FACTORS + 1u) / 2u;
    unsigned missing = 0;
    for (unsigned i = 0; i < READINGS; i++) {
        missing += is_finite(readings[i]) ? 0u : 1u;
    }
    if (missing == 0 || missing * 4 > READINGS) {
        return 0;
    }
    fill_with(matrix, FACTORS * (FACTORS + 1u) / 2u, 0.0f);
    fill_with(factors, FACTORS, 0.0f);
    for (unsigned i = 0; i < FACTORS; i++) {
        matrix[i * (i + 1) / 2 + i] = 1.0f;
    }
    for (unsigned i = 0; i < READINGS; i++) {
        const float *parts = fill_parts + i * FACTORS;
        if (is_finite(readings[i])) {
            const float z = (readings[i] - fill_mean[i]) * fill_scale[i];
            for (unsigned j = 0; j < FACTORS; j++) {
                factors[j] += z * parts[j];
            }
        } else {
            float *place = matrix;
            for (unsigned j = 0; j < FACTORS; j++) {
                for (unsigned k = 0; k <= j; k++) {
                    *place++ -= parts[j] * parts[k];
                }
            }
        }
    }
    if (!solve(matrix, factors)) {
        return 0;
    }
    for (unsigned i = 0; i < READINGS; i++) {
        if (!is_finite(readings[i])) {
            const float moved = plain_product(fill_parts + i * FACTORS, factors, FACTORS);
            readings[i] = fill_mean[i] + (fill_scale[i] > 0.0f ? moved / fill_scale[i] : 0.0f);
        }
    }
    return (int)missing;
}

