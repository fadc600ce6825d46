"""EnclosingLaw: a control law around another one, with its measurements, set points and inputs."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

from .control_law import ControlLaw


class EnclosingLaw(ControlLaw):
    """A control law that changes the measurements, the commands or the numbers of another one, its `law`."""

    simulated: ClassVar[bool] = False
    """Whether it simulates sensors or a fault of the plant, and is no part of a controller of a real plant."""

    if TYPE_CHECKING:  # a field of a model, or designed

        @property
        def law(self) -> ControlLaw:
            """The law inside."""

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return self.law.measured_columns

    @property
    def setpoints(self) -> tuple[str, ...]:
        return self.law.setpoints

    @property
    def inputs(self) -> tuple[str, ...]:
        return self.law.inputs

    @property
    def initial_memory(self) -> Mapping[str, float]:
        """That of the law, unless the enclosing law stores further values."""
        return self.law.initial_memory


def without_simulated(law: Any) -> Any:
    """A control law without the simulated sensors and faults of the plant, at any depth: that of a real plant."""
    if isinstance(law, EnclosingLaw) and law.simulated:
        return without_simulated(law.law)
    if isinstance(law, tuple):
        return tuple(without_simulated(item) for item in law)
    if not isinstance(law, ControlLaw) or not dataclasses.is_dataclass(law):
        return law
    given = {field.name: getattr(law, field.name) for field in dataclasses.fields(law) if field.init}
    changed = {name: value for name, old in given.items() if (value := without_simulated(old)) != old}
    return dataclasses.replace(law, **changed) if changed else law
