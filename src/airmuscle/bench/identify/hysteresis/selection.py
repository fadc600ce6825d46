"""Selection of the friction that is written: of all runs together, or of the only run that a plant can use."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ....physics.muscle.friction import Friction
from .joint import identified_friction
from .joint_result import JointFit
from .loops import LoopFit
from .preference import preferred_fit


class SelectedFriction(NamedTuple):
    """The friction to write, with the range of its data, the file or files it is from, and its verdict."""

    friction: Friction
    origin: str
    verdict: str


def select_friction(fits: Sequence[LoopFit], joint: Sequence[JointFit]) -> SelectedFriction | None:
    """The friction to write: of all runs together or, if they are not several, of the only run a plant can use."""
    if joint:
        best = preferred_fit(joint)
        if best is None:
            return None
        origin = f"{len(best.series)} runs"
        return SelectedFriction(identified_friction(best.friction, best.series), origin, best.verdict)
    usable = [fit.recommended for fit in fits if fit.recommended is not None and fit.usable_in_plant]
    if not usable:
        return None
    only = max(usable, key=lambda fit: fit.effective_sample_size)
    return SelectedFriction(identified_friction(only.friction, (only.series,)), only.series.origin, only.verdict)
