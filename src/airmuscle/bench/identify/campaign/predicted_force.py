"""Predicted force of a record: static law minus friction and creep along the recorded motion."""

from __future__ import annotations

from typing import Any

from ....core.arrays import Array
from ....physics.muscle import CreepElements
from ....physics.muscle.friction import Friction
from ....recording import Recording
from ..force_evaluation import evaluate_force
from .creep_stage import creep_force
from .friction_stage import friction_along


def predicted_force(
    law: Any, recording: Recording, friction: Friction, creep: CreepElements, max_force: float
) -> Array:
    """The force [N] along the pressure and the motion of a recording, negative where the muscle is slack; shape (N,).

    Friction and creep are relaxed at the first row; they need the constant `resting_length`, and are left out without
    it. `max_force` [N] limits the force of laws that give contraction or pressure. Raises ColumnError.
    """
    force = evaluate_force(law, recording["pressure"], recording["contraction"], max_force)
    if recording.constants.get("resting_length") is None:
        return force
    return force - friction_along(friction, recording) - creep_force(creep, recording)
