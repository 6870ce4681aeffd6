/* @TITLE@. taxel_model.h tells what it does.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * Sums are added up in a fixed order, which is part of the model: do not reorder them.
 */
#include "taxel_model.h"

#include <float.h>
#include <limits.h>
#include <string.h>

/* Each product and each sum is rounded by itself. A fused multiply-add rounds once, and gives other bits. GCC ignores
 * the standard's pragma FP_CONTRACT, hence its own.
 */
#if defined(__clang__)
#pragma clang fp contract(off)
#elif defined(__GNUC__)
#pragma GCC optimize("fp-contract=off")
#endif

#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ > 0)
#error "compile this file without -ffast-math: a missing reading is NaN, and the order of sums matters"
#endif
#if UINT_MAX < 0xffffffff
#error "this file needs an int of 32 bits"
#endif
#if FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 16
#error "compile this file so that float is computed as float, for instance with -msse2 -mfpmath=sse"
#endif

/* Loops over the inputs of a network are short, and fastest without counting. */
#if defined(__GNUC__) && __GNUC__ >= 8 && !defined(__clang__)
#define UNROLL _Pragma("GCC unroll 16")
#else
#define UNROLL
#endif

@SIZES@
//@if bits
/* The bits of a float: a copy, because C forbids to look at a float as at an integer. */
static uint32_t bits_of(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

//@end
/* The float of these bits. */
static float float_of(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static float not_a_number(void)
{
    return float_of(0x7fc00000u);
}

static void fill_with(float *values, unsigned count, float value)
{
    for (unsigned i = 0; i < count; i++) {
        values[i] = value;
    }
}

static int is_finite(float value)
{
    return value >= -FLT_MAX && value <= FLT_MAX;
}

static int all_finite(const float *values, unsigned count)
{
    for (unsigned i = 0; i < count; i++) {
        if (!is_finite(values[i])) {
            return 0;
        }
    }
    return 1;
}

/* Writes NaN where outputs cannot be told, and why. */
static void give_up(float *outputs, unsigned count, uint8_t *status, uint8_t why)
{
    fill_with(outputs, count, not_a_number());
    *status = why;
}

//@if project
/* Sums of `width` numbers that start `block`, and of as many for each value times that value. */
static void project(const float *block, const float *values, unsigned count, float *sums, unsigned width)
{
    unsigned j = 0;
    /* Four sums at a time stay in registers. Each still grows value by value. */
    for (; j + 4 <= width; j += 4) {
        const float *part = block + j;
        float a = part[0], b = part[1], c = part[2], d = part[3];
        for (unsigned i = 0; i < count; i++) {
            const float value = values[i];
            part += width;
            a += part[0] * value;
            b += part[1] * value;
            c += part[2] * value;
            d += part[3] * value;
        }
        sums[j] = a;
        sums[j + 1] = b;
        sums[j + 2] = c;
        sums[j + 3] = d;
    }
    for (; j < width; j++) {
        const float *part = block + j;
        float sum = *part;
        for (unsigned i = 0; i < count; i++) {
            part += width;
            sum += *part * values[i];
        }
        sums[j] = sum;
    }
}

//@end
//@if root
/* Square root of a number that is not negative, rounded correctly: what hardware gives, without libm. */
static float square_root(float value)
{
#if defined(__GNUC__) && defined(__arm__) && defined(__ARM_FP) && (__ARM_FP & 4)
    float root;
    __asm__("vsqrt.f32 %0, %1" : "=t"(root) : "t"(value));
    return root;
#else
    uint32_t bits, root = 0, rest = 0;
    int exponent;
    memcpy(&bits, &value, sizeof bits);
    exponent = (int)(bits >> 23);
    if (!(value > 0.0f) || exponent == 0xff) {
        return value;
    }
    bits &= 0x7fffffu;
    if (exponent == 0) {
        /* Subnormal: move the first digit to its place. */
        for (exponent = 1; bits < 0x800000u; exponent--) {
            bits <<= 1;
        }
    }
    bits |= 0x800000u;
    /* An even exponent of 2, and two digits of the square for each of 25 digits of the root. The last one rounds. */
    exponent -= 127;
    if (exponent % 2 != 0) {
        bits <<= 1;
        exponent -= 1;
    }
    {
        uint64_t square = (uint64_t)bits << 39;
        for (int digit = 0; digit < 25; digit++) {
            uint32_t trial = root << 2 | 1u;
            rest = rest << 2 | (uint32_t)(square >> 62);
            square <<= 2;
            root <<= 1;
            if (rest >= trial) {
                rest -= trial;
                root |= 1u;
            }
        }
    }
    /* The root of 24 digits is never halfway between two floats. */
    root = (root + 1u) >> 1;
    return float_of(((uint32_t)(exponent / 2 + 127) << 23) + (root - 0x800000u));
#endif
}

//@end
//@if exp
/* e^x for x <= 0, by x = n ln 2 + r. Below -87 it is 0, so that no subnormal comes about. */
static float exponential(float x)
{
    if (x >= -87.0f) {
        const float n = (x * 0x1.715476p+0f + 0x1.8p+23f) - 0x1.8p+23f;
        const float r = (x - n * @LN_2_HIGH@) - n * (@LN_2_LOW@);
        const float p = ((((((@EXP_6@) * r + @EXP_5@) * r + @EXP_4@) * r + @EXP_3@) * r
                          + @EXP_2@) * r + @EXP_1@) * r + @EXP_0@;
        return p * float_of((uint32_t)((int32_t)n + 127) << 23);
    }
    return 0.0f;
}

//@end
