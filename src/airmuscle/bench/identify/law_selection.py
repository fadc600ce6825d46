"""Selection of a law: one comparison, or one for each of two purposes where the data serve both."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable, Sequence

from ...recording import Recording
from .candidate_scores import RankedModel
from .candidates import MIN_POOLED, Candidate
from .cross_validation import GroupSplit, specimen_name
from .joint_selection import select_for_both
from .loss import LeastSquares, Loss
from .model_selection import Comparison, compare


@dataclasses.dataclass(frozen=True, eq=False)
class LawSelection:
    """The recommended law, with the comparison for one purpose or those for both."""

    comparisons: tuple[Comparison, ...]
    recommended: RankedModel
    reason: str


def select_law(
    recordings: Sequence[Recording],
    candidates: Sequence[Candidate] | None = None,
    *,
    leave_out: GroupSplit | None = None,
    both: bool | None = None,
    loss: Loss = LeastSquares(),
    workers: int = 1,
    progress: Callable[[str, float], None] | None = None,
) -> LawSelection:
    """The law for the purpose of a split, or one law for further runs and for other muscles.

    candidates  as in `compare`
    leave_out   the split of a single purpose, as in `compare`
    both        whether one law must serve both purposes; by default if no split is given and the recordings contain
                three specimens or more, each in several runs
    loss, workers, progress  as in `compare`

    Raises IdentificationError where no candidate is determined.
    """
    if both or (both is None and leave_out is None and serves_both(recordings)):
        joint = select_for_both(recordings, candidates, loss=loss, workers=workers, progress=progress)
        return LawSelection(joint.comparisons, joint.recommended[0], str(joint))
    comparison = compare(recordings, candidates, leave_out=leave_out, loss=loss, workers=workers, progress=progress)
    return LawSelection((comparison,), comparison.recommended, comparison.reason)


def serves_both(recordings: Sequence[Recording]) -> bool:
    """Whether there are three specimens or more, each with several runs."""
    counts = Counter(specimen_name(run) for run in recordings)
    return len(counts) >= MIN_POOLED and min(counts.values()) > 1
