"""Parameter studies: varied parameters, designs of experiments, metrics and sensitivities of a scenario."""

from ..core.processes import process_pool
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
