@provenance@
#include "@file@.h"

#include <math.h>

#ifdef __cplusplus
#define restrict
#endif

@constants@
/* Printed functions. c holds what they need of the parameters; J the distinct non-zeros of df/dx, A the LU factors of
   d I - J, k the solution of (d I - J) k = f(x, u) + g. */
@functions@
@solver@
