"""What a recording consists of: runs, branches, plateaus, transients, glitches, and what its sensors can tell."""

from .branches import Branch, branches, directions, ways_along
from .findings import Finding, refuse_unswept
from .inspection import Inspection, inspect, inspect_all
from .outliers import Outlier, outliers
from .plateaus import Plateau, plateau_points, plateaus
from .quasi_static import quasi_static
from .runs import AT_REST, FREE, ISOBARIC, ISOMETRIC, ISOTONIC, Run, runs
from .sampling import Sampling, sampling
from .sensor import Sensor, sensors
from .stretch import Stretch

__all__ = [
    "AT_REST",
    "FREE",
    "ISOBARIC",
    "ISOMETRIC",
    "ISOTONIC",
    "Branch",
    "Finding",
    "Inspection",
    "Outlier",
    "Plateau",
    "Run",
    "Sampling",
    "Sensor",
    "Stretch",
    "branches",
    "directions",
    "inspect",
    "inspect_all",
    "outliers",
    "plateau_points",
    "plateaus",
    "quasi_static",
    "refuse_unswept",
    "runs",
    "sampling",
    "sensors",
    "ways_along",
]
