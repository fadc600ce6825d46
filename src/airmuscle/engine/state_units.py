"""Units of the columns of a run."""

from __future__ import annotations

from collections.abc import Sequence

from ..core.system import System
from ..recording.columns import quantity_of


def column_units(system: System, outputs: Sequence[str]) -> dict[str, str]:
    """The unit of every state, input and output; empty where none is known."""
    units = {name: getattr(quantity_of(name), "unit", "") for name in outputs}
    units |= {i.name: i.unit for i in system.input_variables}
    return {**units, **system.output_units, **{s.name: s.unit for s in system.states}}
