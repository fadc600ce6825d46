@provenance@
#include "@file@.h"

#include <math.h>

const @number@ model_initial_memory[MODEL_MEMORY + 1] = {@initial_memory@};
@number@ model_parameters[MODEL_PARAMETERS + 1] = {@parameter_values@};
const char *const model_parameter_names[MODEL_PARAMETERS + 1] = {@parameter_names@};

/* Constants of the sample; deviations from the operating point, scaled. */
@tables@
@functions@
int model_step(@number@ *memory, const @number@ *measurement, const @number@ *setpoint, @number@ *command)
{
@work@
  @number@ y[@measured@], r[@controlled@];
  @number@ *predicted = memory + @predicted_at@, *plan = memory + @plan_at@, *inputs = memory + @inputs_at@;
  @number@ *active = memory + @active_at@;
  int counts[2], i;
  for (i = 0; i < @measured@; i++) {
    if (!isfinite(measurement[i])) return 1;
    y[i] = measurement[i] - model_at_measured[i];
  }
  for (i = 0; i < @controlled@; i++) {
    if (!isfinite(setpoint[i])) return 1;
    r[i] = setpoint[i] - model_at_controlled[i];
  }
  for (i = 0; i < 2; i++) counts[i] = (int)memory[@counts_at@ + i];
  predictive_sample(@arguments@);
  for (i = 0; i < 2; i++) memory[@counts_at@ + i] = (@number@)counts[i];
  for (i = 0; i < MODEL_COMMANDS; i++) command[i] = model_operating[i] + model_sizes[i] * inputs[i];
  return 0;
}
