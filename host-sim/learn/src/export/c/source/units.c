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

