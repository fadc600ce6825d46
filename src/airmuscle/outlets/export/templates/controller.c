@provenance@
#include "@file@.h"

#include <math.h>

#ifdef __cplusplus
#define restrict
#endif

const @number@ model_initial_memory[MODEL_MEMORY + 1] = {@initial_memory@};
@number@ model_parameters[MODEL_PARAMETERS + 1] = {@parameter_values@};
const @number@ model_parameter_minimum[MODEL_PARAMETERS + 1] = {@parameter_minimum@};
const @number@ model_parameter_maximum[MODEL_PARAMETERS + 1] = {@parameter_maximum@};
const char *const model_parameter_names[MODEL_PARAMETERS + 1] = {@parameter_names@};

@check_parameters@
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
