"""Parameters of a plant from records in time: fill, discharge, release; and what such records cannot tell."""

from .experiment import Experiment, StartTime, StartValue
from .fit import fit_dynamic
from .identifiability import identifiable
from .initial_conditions import InitialConditions
from .result import DynamicFit
from .sensing import where_sensed

__all__ = [
    "DynamicFit",
    "Experiment",
    "InitialConditions",
    "StartTime",
    "StartValue",
    "fit_dynamic",
    "identifiable",
    "where_sensed",
]
