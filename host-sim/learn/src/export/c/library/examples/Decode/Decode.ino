// Decodes frame after frame and prints the outputs, for the Arduino IDE's serial plotter.
#include <taxel_model.h>

static float readings[TAXEL_MODEL_READINGS];
static float outputs[TAXEL_MODEL_OUTPUTS];
static float scratch[TAXEL_MODEL_SCRATCH];
static uint8_t status[TAXEL_MODEL_ROWS];
//@if relative
static taxel_model_t sensor;
//@end

// Replace this by your own scan: @WHAT_READINGS@, row after row; NAN where one is missing.
static void scan() {
  for (unsigned i = 0; i < TAXEL_MODEL_READINGS; i++) {
    readings[i] = NAN;
  }
}

void setup() {
  Serial.begin(115200);
  if (taxel_model_selftest() != 0) {
    Serial.println("taxel_model: this compiler's options change results");
  }
//@if relative
  // Nothing may touch the sensor now. A mean of some frames is better than one.
  scan();
  taxel_model_set_baseline(&sensor, readings);
//@end
}

void loop() {
  scan();
//@if fill
  taxel_model_fill(@GIVE@readings, scratch);
//@end
  taxel_model_decode(@GIVE@readings, outputs, status, scratch);
  for (unsigned i = 0; i < TAXEL_MODEL_OUTPUTS; i++) {
    Serial.print(taxel_model_output_name(i));
    Serial.print(':');
    Serial.print(outputs[i], 4);
    Serial.print(i + 1 < TAXEL_MODEL_OUTPUTS ? ',' : '\n');
  }
}
