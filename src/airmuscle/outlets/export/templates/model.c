@provenance@
#include "@file@.h"

#include <math.h>

#ifdef __cplusplus
#define restrict
#endif

const char *const model_state_names[MODEL_STATES + 1] = {@state_names@};
const char *const model_state_units[MODEL_STATES + 1] = {@state_units@};
const char *const model_input_names[MODEL_INPUTS + 1] = {@input_names@};
const char *const model_input_units[MODEL_INPUTS + 1] = {@input_units@};
const char *const model_output_names[MODEL_OUTPUTS + 1] = {@output_names@};
const char *const model_output_units[MODEL_OUTPUTS + 1] = {@output_units@};
const char *const model_parameter_names[MODEL_PARAMETERS + 1] = {@parameter_names@};
const char *const model_parameter_units[MODEL_PARAMETERS + 1] = {@parameter_units@};
const double model_defaults[MODEL_PARAMETERS + 1] = {@defaults@};
const double model_parameter_minimum[MODEL_PARAMETERS + 1] = {@parameter_minimum@};
const double model_parameter_maximum[MODEL_PARAMETERS + 1] = {@parameter_maximum@};
const double model_nominal[MODEL_STATES] = {@nominal@};
const double model_state_minimum[MODEL_STATES] = {@state_minimum@};
const double model_input_minimum[MODEL_INPUTS + 1] = {@input_minimum@};
const double model_input_maximum[MODEL_INPUTS + 1] = {@input_maximum@};

@check_parameters@
/* Printed functions. c holds what they need of the parameters; J the distinct non-zeros of df/dx, A the LU factors of
   d I - J, k the solution of (d I - J) k = f(x, u) + g. */
@functions@
@solver@
