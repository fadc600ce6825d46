"""Dynamic identification: plant parameters from transient records (fill, discharge, release)."""

from ..identifiability import analyse_identifiability
from .ambient import stated_ambient
from .cross_prediction import CrossPrediction, cross_predict, describe_cross_predictions
from .experiment import CommandInstants, Experiment, InitialValue, StartTime
from .fit import fit_dynamic
from .initial_conditions import InitialConditions
from .record_ranking import RecordRanking, rank_records
from .regulator_fit import RegulatorFit, fit_regulator
from .result import DynamicFit
from .sensing import locate_pressure_sensor

__all__ = [
    "CommandInstants",
    "CrossPrediction",
    "DynamicFit",
    "Experiment",
    "InitialConditions",
    "InitialValue",
    "RecordRanking",
    "RegulatorFit",
    "StartTime",
    "analyse_identifiability",
    "cross_predict",
    "describe_cross_predictions",
    "fit_dynamic",
    "fit_regulator",
    "locate_pressure_sensor",
    "rank_records",
    "stated_ambient",
]
