"""Parameters of a plant from records in time: fill, discharge, release; and what such records cannot tell."""

from .experiment import Experiment, StartTime, StartValue
from .fit import fit_dynamic
from .identifiable import identifiable
from .result import DynamicFit
from .sensing import where_sensed
from .start import Start

__all__ = [
    "DynamicFit",
    "Experiment",
    "Start",
    "StartTime",
    "StartValue",
    "fit_dynamic",
    "identifiable",
    "where_sensed",
]
