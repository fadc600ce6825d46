"""Studies of a scenario: designs of experiments, metrics and sensitivities; tuning of a controller's gains."""

from ..core.processes import process_pool
from .executors import dask_cluster
from .result import StudyResult
from .run import run_study
from .study import Study, load_study
from .tuning import (
    CaseMetrics,
    IntegralAbsoluteError,
    IntegralTimeAbsoluteError,
    LoopCase,
    RobustObjective,
    RootMeanSquareError,
    TrackingIndex,
    Tuning,
    TuningHistory,
    tune,
)

__all__ = [
    "CaseMetrics",
    "IntegralAbsoluteError",
    "IntegralTimeAbsoluteError",
    "LoopCase",
    "RobustObjective",
    "RootMeanSquareError",
    "Study",
    "StudyResult",
    "TrackingIndex",
    "Tuning",
    "TuningHistory",
    "dask_cluster",
    "load_study",
    "process_pool",
    "run_study",
    "tune",
]
