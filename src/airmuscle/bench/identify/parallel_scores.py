"""Scores of all candidates of a comparison, in this process or in several."""

from __future__ import annotations

import dataclasses
import functools
import pickle
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor, as_completed

from ...core import tree
from ...engine.processes import check_running, process_pool
from ...physics.muscle.characteristic import PooledLengthLaw
from .candidate_scores import MAX_EXCESS, RankedModel, Score, score_candidate
from .candidates import Candidate
from .compared_points import ComparedPoints
from .loss import Loss
from .recommendation import MAX_EXCESS as RECOMMENDED_EXCESS
from .variable_projection import linear_fields

Progress = Callable[[str, float], None]
Scores = list[tuple[Score, ...]]


def score_candidates(
    candidates: Sequence[Candidate],
    splits: Sequence[ComparedPoints],
    loss: Loss,
    workers: int,
    progress: Progress | None,
    *,
    can_exclude: bool,
) -> Scores:
    """The scores of each candidate for each split, in the order of the candidates.

    With `can_exclude` the laws that are not linear in all parameters, whose fits take longest, are scored last, and not
    cross-validated further where they cannot be recommended. The scores do not depend on the number of workers.
    """
    late = [i for i, each in enumerate(candidates) if can_exclude and max_excess(each) < float("inf")]
    early = [i for i in range(len(candidates)) if i not in late]
    scores_of: dict[int, tuple[Score, ...]] = {}
    with process_pool(workers, one_thread_each=True) as pool:
        for indices in (early, late):
            lowest = _lowest_errors(scores_of.values(), len(splits)) if indices is late else ()
            tasks = [_Task(candidates[i], tuple(max_excess(candidates[i]) * each for each in lowest)) for i in indices]
            for position, scores in _results(pool, splits, loss, tasks):
                scores_of[indices[position]] = scores
                if progress is not None:
                    progress(candidates[indices[position]].name, (len(scores_of) - 1) / len(candidates))
    if progress is not None:
        progress("", 1.0)
    return [scores_of[i] for i in range(len(candidates))]


def max_excess(candidate: Candidate) -> float:
    """The ratio to the lowest error of other laws above which a law is not cross-validated further.

    That of a recommended law for those whose fits take longest, a greater one for other laws that are not linear.
    """
    if is_fitted_by_projection(candidate):
        return 1.0 + RECOMMENDED_EXCESS
    return float("inf") if linear_fields(candidate.law) or isinstance(candidate.law, PooledLengthLaw) else MAX_EXCESS


def is_fitted_by_projection(candidate: Candidate) -> bool:
    """Whether a law is linear in some of its fitted parameters only."""
    fields = linear_fields(candidate.law)
    names = [leaf.path.partition("[")[0] for leaf in tree.leaves(candidate.law) if leaf.declared.fitted]
    return bool(fields) and not isinstance(candidate.law, PooledLengthLaw) and any(name not in fields for name in names)


@dataclasses.dataclass(frozen=True)
class _Task:
    """A candidate with the errors [N] above which it is not cross-validated further."""

    candidate: Candidate
    limits: Sequence[float]


def _results(
    pool: Executor | None, splits: Sequence[ComparedPoints], loss: Loss, tasks: Sequence[_Task]
) -> Iterator[tuple[int, tuple[Score, ...]]]:
    """The position of each task with its scores, as they are completed."""
    if pool is None:
        for position, task in enumerate(tasks):
            yield position, score_candidate(task.candidate, splits, loss, task.limits)
        return
    for each in splits:
        each.points.prepare()
    shared = pickle.dumps((tuple(splits), loss))
    largest_first = sorted(range(len(tasks)), key=lambda i: -sum(1 for _ in tree.leaves(tasks[i].candidate.law)))
    futures = {pool.submit(_score_in_worker, shared, tasks[i]): i for i in largest_first}
    for future in as_completed(futures):
        yield futures[future], future.result()


def _score_in_worker(shared: bytes, task: _Task) -> tuple[Score, ...]:
    check_running()
    splits, loss = _load(shared)
    return score_candidate(task.candidate, splits, loss, task.limits)


@functools.lru_cache(maxsize=1)
def _load(shared: bytes) -> tuple[tuple[ComparedPoints, ...], Loss]:
    """The points and the loss; a worker loads them once, with what is derived from them."""
    loaded: tuple[tuple[ComparedPoints, ...], Loss] = pickle.loads(shared)
    return loaded


def _lowest_errors(scores: Iterable[tuple[Score, ...]], count: int) -> tuple[float, ...]:
    """The lowest cross-validated error [N] for each split; infinite where no law is ranked."""
    rows = list(scores)
    ranked = [[s[i] for s in rows] for i in range(count)]
    return tuple(
        min((s.cross_validated_rmse for s in each if isinstance(s, RankedModel)), default=float("inf"))
        for each in ranked
    )
