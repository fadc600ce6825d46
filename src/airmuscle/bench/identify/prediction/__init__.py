"""Prediction of further records by an identified law or plant, with the stated 95 % band."""

from .dynamic import PlantUncertainty, predict_dynamic
from .result import QuantityPrediction, RecordPrediction
from .static import predict_static

__all__ = ["PlantUncertainty", "QuantityPrediction", "RecordPrediction", "predict_dynamic", "predict_static"]
