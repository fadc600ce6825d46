from .dynamic import PlantUncertainty as PlantUncertainty
from .dynamic import predict_dynamic as predict_dynamic
from .result import QuantityPrediction as QuantityPrediction
from .result import RecordPrediction as RecordPrediction
from .result import predict_static as predict_static
