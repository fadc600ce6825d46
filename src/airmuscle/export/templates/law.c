@provenance@
#include "@file@.h"

#include <math.h>

@constants@
@functions@
