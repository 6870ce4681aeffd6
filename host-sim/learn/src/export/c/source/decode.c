//@if rows
int taxel_model_decode(@SENSOR@float *readings, float *outputs, uint8_t *status, float *scratch)
{
    int clamped = 0;
//@if ohm
    drop_faulty(readings);
//@end
    for (unsigned row = 0; row < ROWS; row++) {
        const float *inputs = readings + row * INPUTS;
//@if relative
        for (unsigned i = 0; i < INPUTS; i++) {
            scratch[INPUTS + i] = relative(sensor, readings, row * INPUTS + i);
        }
        inputs = scratch + INPUTS;
//@end
        clamped |= decode_inputs(row_network[row], inputs, scratch, outputs + row * NETWORK_OUTPUTS, &status[row]);
    }
    return clamped;
}

//@end
//@if array
int taxel_model_decode(@SENSOR@float *readings, float *outputs, uint8_t *status, float *scratch)
{
    uint8_t worst = TAXEL_MODEL_DECODED;
    int clamped = 0;
//@if ohm
    drop_faulty(readings);
//@end
@PARTS@    memset(status, worst, ROWS);
    return clamped && severity[worst] < severity[TAXEL_MODEL_OVERFLOW];
}

//@end
