"""Studies of a scenario: designs of experiments, metrics and sensitivities; tuning of a controller's gains."""

from ...engine.processes import process_pool
from .executors import dask_cluster
from .result import StudyResult
from .run import run_study
from .study import Study, load_study

__all__ = [
    "Study",
    "StudyResult",
    "dask_cluster",
    "load_study",
    "process_pool",
    "run_study",
]
