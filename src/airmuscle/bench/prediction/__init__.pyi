from .predict import PlantUncertainty as PlantUncertainty
from .predict import predict_dynamic as predict_dynamic
from .predict import predict_static as predict_static
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
from .predict import length_notes as length_notes
