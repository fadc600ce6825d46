@provenance@
#include "@file@.h"

#include <math.h>

#ifdef __cplusplus
#define restrict
#endif

@constants@
@functions@
int model_step(@number@ *memory, const @number@ *measurement, const @number@ *setpoint, @number@ *command)
{
  @number@ later[MODEL_MEMORY + 1], wanted[MODEL_COMMANDS + 1];
  int i;
  for (i = 0; i < MODEL_MEASUREMENTS; i++) {
    if (!isfinite(measurement[i])) return 1;
  }
  for (i = 0; i < MODEL_SETPOINTS; i++) {
    if (!isfinite(setpoint[i])) return 1;
  }
  model_sample(measurement, setpoint, memory, model_parameters, wanted, later);
  for (i = 0; i < MODEL_COMMANDS; i++) {
    if (!isfinite(wanted[i])) return 1;
  }
  for (i = 0; i < MODEL_COMMANDS; i++) command[i] = wanted[i];
  for (i = 0; i < MODEL_MEMORY; i++) memory[i] = later[i];
  return 0;
}
