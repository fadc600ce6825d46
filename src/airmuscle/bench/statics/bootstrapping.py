"""Bootstrap of a fit: refits to resampled groups of rows (runs, levels or specimens)."""

from collections.abc import Callable, Sequence

import numpy as np

from ...core import Hint, IdentificationError, check_whole
from ...engine.processes import Workers
from ...recording import Recording
from ..estimation import GroupSplit, LevelSplit, default_split, resampled_values
from .fit_points import FitPoints
from .static_fit_result import Fit
from .uncertainty import MIN_GROUPS, RELIABLE_GROUPS, Bootstrap


def bootstrap(
    fit: Fit,
    recordings: Recording | Sequence[Recording],
    *,
    refits: int = 1000,
    by: GroupSplit | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    workers: Workers = 1,
) -> Bootstrap:
    """Refit a law to groups of its data drawn with replacement (Efron and Tibshirani (1993), An
    Introduction to the Bootstrap, chapter 9).

    recordings  those that were fitted
    by          the groups: RunSplit(), LevelSplit(...) or SpecimenSplit(); by default the first of
                these that has at least `MIN_GROUPS` groups
    progress    called with the completed fraction
    workers     number of processes, as in `compare`; the result does not depend on it

    Censored rows are active where the original fit violates their bound. A law that is linear in
    its parameters is refitted by one matrix product; any other law is refitted iteratively from the
    parameters of the original fit, or from those of an earlier refit with a smaller sum of squares
    in this sample, one of the first `REFITS_OF_A_TASK` or of its own block of as many. Raises
    IdentificationError.
    """
    check_whole("bootstrap", "refits", refits, 1)
    check_whole("bootstrap", "seed", seed, 0)
    runs = [recordings] if isinstance(recordings, Recording) else list(recordings)
    by = by or default_split(runs, MIN_GROUPS)
    labels = np.concatenate(by.labels(runs))[~FitPoints.from_recordings(runs).missing]
    if labels.size != len(fit.recording):
        raise IdentificationError(
            f"the fit has {len(fit.recording)} rows, but the recordings have {labels.size}. Give"
            " the recordings that were fitted."
        )
    names, group = np.unique(labels, return_inverse=True)
    count = int(names.size)
    if count < MIN_GROUPS:
        raise IdentificationError(
            f"a bootstrap needs {MIN_GROUPS} {by.group_name}s or more, but the data have {count},"
            f" whose few different samples do not give an interval; {RELIABLE_GROUPS} or more are"
            " recommended. Give more runs, or use the standard errors of the fit.",
            hint=Hint("To resample by levels of contraction", "by", LevelSplit("contraction")),
        )
    draws = (
        np.random.default_rng(seed)
        .multinomial(count, np.full(count, 1.0 / count), size=refits)
        .astype(float)
    )
    values = resampled_values(
        fit.problem, fit.values, fit.loss, group, draws, progress=progress, workers=workers
    )
    return Bootstrap(fit, values, count, seed)
