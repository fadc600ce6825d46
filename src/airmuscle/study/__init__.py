"""Many runs of one scenario: what varies, how it is sampled, what is kept, and which input it comes from."""

from .executors import dask_cluster, processes
from .result import StudyResult
from .run import run_study
from .study import Study, load_study

__all__ = [
    "Study",
    "StudyResult",
    "dask_cluster",
    "load_study",
    "processes",
    "run_study",
]
