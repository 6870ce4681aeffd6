/* Whether an input in units leaves 32 bits, or is not a number. */
static int saturates(float units)
{
    return !(units >= -0x1p+31f && units < 0x1p+31f);
}

/* Limit to which an input that saturates is clamped; 0 for what is not a number. C leaves such a conversion open. */
static float limit_of(float units)
{
    return units >= 0x1p+31f ? 0x1p+31f : units < 0.0f ? -0x1p+31f : 0.0f;
}

