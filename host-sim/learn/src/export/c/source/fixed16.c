
//@if first
/* An input in units, as far as 32 bits hold it, without its fraction; 0 for what is not a number. Sets *clamped if it is
 * not held. Most inputs are, which the exponent's bits tell; C leaves the conversion of others open.
 */
static int32_t whole_units(float units, int *clamped)
{
    uint32_t bits;
    memcpy(&bits, &units, sizeof bits);
    if ((bits & 0x7fffffffu) < 0x4f000000u) {
        return (int32_t)units;
    }
    *clamped |= !(units == -0x1p+31f);
    return units > 0.0f ? INT32_MAX : units < 0.0f ? INT32_MIN : 0;
}

/* A network in 16-bit fixed point: 2^-v with v = b + a.x + g x.x, all in integers. A pair is a word of two numbers of
 * 16 bits, the first in its low half; a last odd input has 0 beside it.
 */
struct fixed16 {
    const float *midpoint, *per_unit; /* of each input */
    uint32_t decay;                   /* g */
    unsigned groups;                  /* of sixteen centres, some of which may have no weight */
    const uint32_t *centres;          /* of a group: b and the pairs of a, sixteen times; weights, 8 pairs an output */
    const uint32_t *bias;             /* what sums start with */
    const float *scale;               /* what one unit of a sum is worth */
//@if affine
    const uint32_t *affine; /* pairs of inputs of one output after the other, or null */
//@end
};

#define PAIRS ((INPUTS + 1u) / 2u)

/* A function of its own has all registers. */
#if defined(__GNUC__)
#define NOT_INLINE __attribute__((noinline))
#else
#define NOT_INLINE
#endif

/* Words in an array of floats, which is where integers are kept between steps. */
static uint32_t word(const float *words, unsigned index)
{
    uint32_t bits;
    memcpy(&bits, &words[index], sizeof bits);
    return bits;
}

static void set_word(float *words, unsigned index, uint32_t bits)
{
    memcpy(&words[index], &bits, sizeof bits);
}

static int32_t as_signed(uint32_t bits)
{
    int32_t value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* `sum` and the two products of two pairs, modulo 2^32. */
static uint32_t add_products(uint32_t sum, uint32_t a, uint32_t b)
{
#if defined(__GNUC__) && defined(__ARM_FEATURE_DSP)
    /* One instruction, with the same bits. */
    __asm__("smlad %0, %1, %2, %3" : "=r"(sum) : "r"(a), "r"(b), "r"(sum));
    return sum;
#else
    /* Flipping the sign's bit and subtracting it extends the sign. */
    const int32_t a_low = (int32_t)((a & 0xffffu) ^ 0x8000u) - 0x8000, a_high = (int32_t)((a >> 16) ^ 0x8000u) - 0x8000;
    const int32_t b_low = (int32_t)((b & 0xffffu) ^ 0x8000u) - 0x8000, b_high = (int32_t)((b >> 16) ^ 0x8000u) - 0x8000;
    return sum + (uint32_t)(a_low * b_low) + (uint32_t)(a_high * b_high);
#endif
}

/* `sum` and the upper half of a product. Shifting a negative number keeps its sign with every known compiler. */
static int32_t add_upper_product(int32_t sum, int32_t a, int32_t b)
{
#if defined(__GNUC__) && defined(__ARM_FEATURE_DSP)
    __asm__("smmla %0, %1, %2, %3" : "=r"(sum) : "r"(a), "r"(b), "r"(sum));
    return sum;
#else
    return sum + (int32_t)(((int64_t)a * b) >> 32);
#endif
}

/* The activation 2^-v in Q15: a cubic for the fraction of v, and a shift for the rest. */
static uint32_t activation(uint32_t v)
{
    const int32_t fraction = (int32_t)(v & 0x3ffffffu);
    uint32_t shift = v >> 26;
    uint32_t p;
    int32_t cubic = add_upper_product(@CUBIC_2@, fraction, @CUBIC_3@);
    cubic = add_upper_product(@CUBIC_1@, fraction, cubic);
    p = (uint32_t)add_upper_product(@CUBIC_0@, fraction, cubic);
#if defined(__GNUC__) && defined(__ARM_FEATURE_DSP)
    /* Here a shift by 32 and more gives 0. */
    __asm__("lsr %0, %1, %2" : "=r"(p) : "r"(p), "r"(shift));
    return p;
#else
    return p >> (shift < 31 ? shift : 31);
#endif
}

/* An input in steps of 2^16 units, in the low half of a word. */
static uint32_t step_of(const struct fixed16 *network, const float *inputs, unsigned i, int *clamped)
{
    return (uint32_t)whole_units((inputs[i] - network->midpoint[i]) * network->per_unit[i], clamped) >> 16;
}

//@end
/* Adds the weights of a group for its activations, which are in eight pairs. */
NOT_INLINE static void add_weights@OF@(const uint32_t *weights, const uint32_t *pairs, float *sums)
{
    /* Activations stay in registers while weights pass. */
    const uint32_t p0 = pairs[0], p1 = pairs[1], p2 = pairs[2], p3 = pairs[3];
    const uint32_t p4 = pairs[4], p5 = pairs[5], p6 = pairs[6], p7 = pairs[7];
    for (unsigned j = 0; j < NETWORK_OUTPUTS; j++) {
        uint32_t sum = word(sums, j);
        sum = add_products(sum, weights[0], p0);
        sum = add_products(sum, weights[1], p1);
        sum = add_products(sum, weights[2], p2);
        sum = add_products(sum, weights[3], p3);
        sum = add_products(sum, weights[4], p4);
        sum = add_products(sum, weights[5], p5);
        sum = add_products(sum, weights[6], p6);
        sum = add_products(sum, weights[7], p7);
        set_word(sums, j, sum);
        weights += 8;
    }
}

/* Infers outputs; `x` is room for the inputs. Returns whether one was clamped, or is not finite. */
static int infer_fixed16@OF@(const struct fixed16 *network, const float *inputs, float *x, float *outputs)
{
    int clamped = 0;
    uint64_t square = 0;
    uint32_t shared;
    const uint32_t *line = network->centres;
    for (unsigned i = 0; i < PAIRS; i++) {
        uint32_t pair = step_of(network, inputs, 2 * i, &clamped);
        if (2 * i + 1 < INPUTS) {
            pair |= step_of(network, inputs, 2 * i + 1, &clamped) << 16;
        }
        square += add_products(0, pair, pair);
        set_word(x, i, pair);
    }
    shared = (uint32_t)(((square >> SQUARE_SHIFT) * network->decay) >> (34 - SQUARE_SHIFT));
    for (unsigned j = 0; j < NETWORK_OUTPUTS; j++) {
        uint32_t sum = network->bias[j];
//@if affine
        if (network->affine) {
            UNROLL
            for (unsigned i = 0; i < PAIRS; i++) {
                sum = add_products(sum, network->affine[j * PAIRS + i], word(x, i));
            }
        }
//@end
        set_word(outputs, j, sum);
    }
    for (unsigned group = 0; group < network->groups; group++) {
        uint32_t pairs[8];
        /* Four centres at a time: each pair of inputs is loaded once for four. */
        for (unsigned k = 0; k < 8; k += 2) {
            const uint32_t *a = line, *b = a + 1 + PAIRS, *c = b + 1 + PAIRS, *d = c + 1 + PAIRS;
            uint32_t va = *a + shared, vb = *b + shared, vc = *c + shared, vd = *d + shared;
            UNROLL
            for (unsigned i = 0; i < PAIRS; i++) {
                const uint32_t pair = word(x, i);
                va = add_products(va, *++a, pair);
                vb = add_products(vb, *++b, pair);
                vc = add_products(vc, *++c, pair);
                vd = add_products(vd, *++d, pair);
            }
            pairs[k] = activation(va) | activation(vb) << 16;
            pairs[k + 1] = activation(vc) | activation(vd) << 16;
            line = d + 1;
        }
        add_weights@OF@(line, pairs, outputs);
        line += 8 * NETWORK_OUTPUTS;
    }
    for (unsigned j = 0; j < NETWORK_OUTPUTS; j++) {
        outputs[j] = (float)as_signed(word(outputs, j)) * network->scale[j];
    }
    return clamped;
}

