@provenance@
#include "@file@.h"

#include <math.h>

#ifdef __cplusplus
#define restrict
#endif

const double model_defaults[MODEL_PARAMETERS + 1] = {@defaults@};
const char *const model_parameter_names[MODEL_PARAMETERS + 1] = {@parameter_names@};

@functions@
