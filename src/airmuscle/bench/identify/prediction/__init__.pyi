from .predict import PlantUncertainty as PlantUncertainty
from .predict import predict_dynamic as predict_dynamic
from .predict import predict_static as predict_static
from .result import QuantityPrediction as QuantityPrediction
from .result import RecordPrediction as RecordPrediction
from .result import prediction_chapters as prediction_chapters
