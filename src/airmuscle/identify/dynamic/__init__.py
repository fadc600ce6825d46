"""Parameters of a plant from records in time: fill, discharge, release; and what such records cannot tell."""

from .experiment import Experiment as Experiment
from .experiment import StartTime as StartTime
from .experiment import StartValue as StartValue
from .fit import fit_dynamic as fit_dynamic
from .identifiable import identifiable as identifiable
from .result import DynamicFit as DynamicFit
from .sensing import where_sensed as where_sensed
from .start import Start as Start
