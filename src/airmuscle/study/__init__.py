"""Parameter studies: varied parameters, designs of experiments, metrics and sensitivities of a scenario."""

from .executors import dask_cluster, process_pool
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
