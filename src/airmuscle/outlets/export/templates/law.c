@provenance@
#include "@file@.h"

#include <math.h>

#ifdef __cplusplus
#define restrict
#endif

const double model_defaults[MODEL_PARAMETERS + 1] = {@defaults@};
const double model_parameter_minimum[MODEL_PARAMETERS + 1] = {@parameter_minimum@};
const double model_parameter_maximum[MODEL_PARAMETERS + 1] = {@parameter_maximum@};
const char *const model_parameter_names[MODEL_PARAMETERS + 1] = {@parameter_names@};

@check_parameters@
@functions@
