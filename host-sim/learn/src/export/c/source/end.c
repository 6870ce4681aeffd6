const char *taxel_model_output_name(unsigned output)
{
    static const char *const names[OUTPUTS] = {
@NAMES@    };
    return output < OUTPUTS ? names[output] : 0;
}

const char *taxel_model_reading_name(unsigned reading)
{
    static const char *const names[READINGS] = {
@READING_NAMES@    };
    return reading < READINGS ? names[reading] : 0;
}

uint32_t taxel_model_crc(void)
{
    return 0x@CRC@u;
}

/* Frames of the self-test and what comes of them, as bits: a reading may be NaN. */
@TESTS@
int taxel_model_selftest(void)
{
    /* Not on the stack, which is small on a device. A linker leaves them out if nobody calls this function. */
    static float readings[READINGS], outputs[OUTPUTS], scratch[TAXEL_MODEL_SCRATCH];
    static uint8_t status[ROWS];
//@if relative
    static taxel_model_t sensor_at_rest, *const sensor = &sensor_at_rest;
//@end
    int wrong = 0;
//@if relative
    memcpy(readings, test_baseline, sizeof readings);
    taxel_model_set_baseline(sensor, readings);
//@end
    for (int test = TESTS; test-- > 0;) {
        int differs;
        memcpy(readings, test_readings[test], sizeof readings);
        differs = taxel_model_decode(@GIVEN@readings, outputs, status, scratch) != test_clamped[test];
        differs |= memcmp(outputs, test_outputs[test], sizeof outputs) != 0;
        differs |= memcmp(status, test_status[test], sizeof status) != 0;
//@if assess
        differs |= bits_of(taxel_model_assess(@GIVEN@readings, outputs, scratch)) != test_novelty[test];
        differs |= memcmp(outputs, test_deviations[test], sizeof outputs) != 0;
//@end
//@if fill
        taxel_model_fill(@GIVEN@readings, scratch);
        differs |= memcmp(readings, test_filled[test], sizeof readings) != 0;
//@end
        wrong = differs ? test + 1 : wrong;
    }
    return wrong;
}
