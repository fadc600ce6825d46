"""Units of the columns of a run."""

from __future__ import annotations

from collections.abc import Sequence

from ..compile import System
from ..recording.columns import quantity_of
from .plant import Plant


def units_of(plant: System, outputs: Sequence[str]) -> dict[str, str]:
    """The unit of every state, input and output; '' where none is known."""
    units = {name: getattr(quantity_of(name), "unit", "") for name in outputs}
    units |= dict.fromkeys(plant.inputs, "")
    if isinstance(plant, Plant):
        units |= {i.name: i.unit for i in plant.commands}
        units |= {c.acceleration: f"{c.unit}/s^2" for c in plant.mechanism.coordinates}
    return units | {s.name: s.unit for s in plant.states}
