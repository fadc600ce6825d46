from ..identifiability import analyse_identifiability as analyse_identifiability
from .dynamic_chapter import dynamic_chapters as dynamic_chapters
from .experiment import CommandInstants as CommandInstants
from .experiment import Experiment as Experiment
from .experiment import InitialValue as InitialValue
from .experiment import StartTime as StartTime
from .experiment import stated_ambient as stated_ambient
from .fit import CrossPrediction as CrossPrediction
from .fit import cross_predict as cross_predict
from .fit import describe_cross_predictions as describe_cross_predictions
from .fit import fit_dynamic as fit_dynamic
from .fit import fit_tube as fit_tube
from .initial_conditions import InitialConditions as InitialConditions
from .levenberg_marquardt import LevenbergMarquardt as LevenbergMarquardt
from .levenberg_marquardt import bounded_step as bounded_step
from .problem import DynamicProfile as DynamicProfile
from .record_model import commands_at as commands_at
from .record_ranking import RecordRanking as RecordRanking
from .record_ranking import rank_records as rank_records
from .regulator_fit import RegulatorFit as RegulatorFit
from .regulator_fit import fit_regulator as fit_regulator
from .reliability import describe_bounds as describe_bounds
from .reliability import describe_flatness as describe_flatness
from .reliability import describe_optima as describe_optima
from .reliability import distinct_optima as distinct_optima
from .reliability import searches_at_lowest as searches_at_lowest
from .result import DynamicFit as DynamicFit
from .result import SensorLocation as SensorLocation
from .result import locate_pressure_sensor as locate_pressure_sensor

# isort: split
# For the other packages, not in __all__
from .experiment import ParameterPaths as ParameterPaths
from .experiment import RecordUnknown as RecordUnknown
