"""Dynamic identification: plant parameters from transient records (fill, discharge, release)."""

from ..identifiability import analyse_identifiability
from .cross_prediction import CrossPrediction, cross_predict, describe_cross_predictions
from .experiment import Experiment, InitialValue, StartTime
from .fit import fit_dynamic
from .initial_conditions import InitialConditions
from .record_ranking import RecordRanking, rank_records
from .result import DynamicFit
from .sensing import locate_pressure_sensor

__all__ = [
    "CrossPrediction",
    "DynamicFit",
    "Experiment",
    "InitialConditions",
    "InitialValue",
    "RecordRanking",
    "StartTime",
    "analyse_identifiability",
    "cross_predict",
    "describe_cross_predictions",
    "fit_dynamic",
    "locate_pressure_sensor",
    "rank_records",
]
