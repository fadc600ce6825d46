"""Segmentation of recordings: runs, branches, plateaus, transients, outliers and sensor properties."""

from .branches import Branch, branch_directions, find_branches, motion_direction
from .findings import Finding, check_swept
from .inspection import Inspection, check_contents, inspect, inspect_all
from .interval import Interval
from .outliers import Outlier, find_outliers, without_outliers
from .plateaus import Plateau, find_plateaus, plateau_points
from .quasi_static import quasi_static_rows
from .rates import maximum_rate, rate_of_change
from .runs import AT_REST, FREE, ISOBARIC, ISOMETRIC, ISOTONIC, Run, find_runs
from .sampling import Sampling, analyse_sampling
from .sensor import Sensor, estimate_sensors

__all__ = [
    "AT_REST",
    "FREE",
    "ISOBARIC",
    "ISOMETRIC",
    "ISOTONIC",
    "Branch",
    "Finding",
    "Inspection",
    "Interval",
    "Outlier",
    "Plateau",
    "Run",
    "Sampling",
    "Sensor",
    "analyse_sampling",
    "branch_directions",
    "check_contents",
    "check_swept",
    "estimate_sensors",
    "find_branches",
    "find_outliers",
    "find_plateaus",
    "find_runs",
    "inspect",
    "inspect_all",
    "maximum_rate",
    "motion_direction",
    "plateau_points",
    "quasi_static_rows",
    "rate_of_change",
    "without_outliers",
]
