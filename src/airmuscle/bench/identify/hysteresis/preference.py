"""Preference among justified friction laws: the lowest AICc, or fewer parameters where those of the best are open."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from ....core.tree import leaves
from .joint_result import JointFit
from .result import HysteresisFit
from .search import free_parameters

SIMILAR_RMSE = 1.02
"""Maximum ratio of the rms errors of two laws that describe the data equally well (chosen)."""
AnyFit = TypeVar("AnyFit", HysteresisFit, JointFit)


def preferred_fit(fits: Sequence[AnyFit]) -> AnyFit | None:
    """The fit to use of several laws, lowest AICc first; None where the data justify none.

    It is the justified one with the lowest AICc. Where the data do not determine all of its parameters, or do not judge
    them one by one because it consists of elements, it is the one with the fewest parameters among those whose rms
    error is at most 2 % greater.
    """
    justified = [fit for fit in fits if fit.justified]
    if not justified or not _is_open(justified[0]):
        return justified[0] if justified else None
    similar = [fit for fit in justified if fit.rmse <= SIMILAR_RMSE * justified[0].rmse]
    return min(similar, key=lambda fit: free_parameters(fit.friction))


def _is_open(fit: HysteresisFit | JointFit) -> bool:
    return bool(fit.undetermined) or any("[" in leaf.path for leaf in leaves(fit.friction))
