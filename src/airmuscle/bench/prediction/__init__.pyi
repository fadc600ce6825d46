from .force_along_motion import creep_force as creep_force
from .force_along_motion import creep_stretches as creep_stretches
from .force_along_motion import friction_along as friction_along
from .force_along_motion import held_steady as held_steady
from .predict import PlantUncertainty as PlantUncertainty
from .predict import predict_dynamic as predict_dynamic
from .predict import predict_static as predict_static
from .result import PREDICTION_RULES as PREDICTION_RULES
from .result import QuantityPrediction as QuantityPrediction
from .result import RecordPrediction as RecordPrediction
from .result import prediction_chapters as prediction_chapters

# isort: split
# For the other rooms, not in __all__
from .baselines import ARX as ARX
from .baselines import DEPTH as DEPTH
from .baselines import PERSISTENCE as PERSISTENCE
from .baselines import TimedRecord as TimedRecord
from .baselines import baseline_errors as baseline_errors
from .baselines import fit_arx as fit_arx
from .baselines import skill as skill
from .force_along_motion import displacement as displacement
from .force_along_motion import has_path as has_path
from .force_along_motion import path_rows as path_rows
from .force_along_motion import predicted_force as predicted_force
from .force_along_motion import thinned_rows as thinned_rows
from .predict import length_notes as length_notes
