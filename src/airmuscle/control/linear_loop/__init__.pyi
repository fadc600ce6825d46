from .linear_law import LinearLaw as LinearLaw
from .linear_loop import LinearLoop as LinearLoop
from .linear_loop import Margins as Margins
from .linear_loop import linearise_loop as linearise_loop
from .linear_loop import loop_margins as loop_margins
