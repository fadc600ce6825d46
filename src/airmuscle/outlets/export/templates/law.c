@provenance@
#include "@file@.h"

#include <math.h>

#ifdef __cplusplus
#define restrict
#endif

@constants@
@functions@
