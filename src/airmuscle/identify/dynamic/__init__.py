"""Dynamic identification: plant parameters from transient records (fill, discharge, release)."""

from ..identifiability import analyse_identifiability
from .experiment import Experiment, InitialValue, StartTime
from .fit import fit_dynamic
from .initial_conditions import InitialConditions
from .result import DynamicFit
from .sensing import locate_pressure_sensor

__all__ = [
    "DynamicFit",
    "Experiment",
    "InitialConditions",
    "InitialValue",
    "StartTime",
    "analyse_identifiability",
    "fit_dynamic",
    "locate_pressure_sensor",
]
