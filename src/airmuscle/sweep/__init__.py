"""Many runs of one scenario: what varies, how it is sampled, what is kept, and which input it comes from."""

from .executors import dask_cluster as dask_cluster
from .executors import processes as processes
from .result import StudyResult as StudyResult
from .run import run_study as run_study
from .study import Study as Study
from .study import load_study as load_study
