"""LawDesign (interface): a control law that is designed from weights, and loops with the designed laws instead."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Mapping
from typing import Any

from ..core.ops import Value
from .control_law import ControlLaw
from .control_loop import ControlLoop
from .controller import Controller, Measurement


class LawDesign(ControlLaw):
    """A control law whose numbers follow from declared weights by a design, such as Riccati equations.

    A design cannot be traced; its result can. A run therefore compiles the designed `law`, and a search for the weights
    designs it anew for each set. Everything else is that of the designed law.
    """

    @property
    @abc.abstractmethod
    def law(self) -> ControlLaw:
        """The designed law."""

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
        return self.law.initial_memory

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[Mapping[str, Value], Mapping[str, Value]]:
        return self.law.step(memory, measurement, dt)


def with_designed_laws(part: Any) -> Any:
    """A controller with the designed law in place of every LawDesign in it; the same object where there is none."""
    if isinstance(part, LawDesign):
        return with_designed_laws(part.law)
    if isinstance(part, tuple):
        items = tuple(with_designed_laws(item) for item in part)
        return part if all(a is b for a, b in zip(items, part, strict=True)) else items
    if not isinstance(part, Controller) or not dataclasses.is_dataclass(part):
        return part
    fields = {field.name: getattr(part, field.name) for field in dataclasses.fields(part) if field.init}
    found = {name: with_designed_laws(value) for name, value in fields.items()}
    changed = {name: value for name, value in found.items() if value is not fields[name]}
    return dataclasses.replace(part, **changed) if changed else part


def designed_loop(loop: ControlLoop) -> ControlLoop:
    """A loop with the designed laws in its controller; the same object where there is no design."""
    controller = with_designed_laws(loop.controller)
    return loop if controller is loop.controller else dataclasses.replace(loop, controller=controller)
