"""LawDesign (interface): a control law that is designed from weights, and loops with the designed laws instead."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Mapping
from typing import Any

from ...core.ops import Value
from ...core.system import System
from ...core.tree import Structure, structure, with_ambient
from .control_law import ControlLaw
from .control_loop import ControlLoop
from .controller import Controller, Measurement
from .enclosing_law import EnclosingLaw

_without_design: set[Structure] = set()
"""Structures of control laws that contain no design."""


class LawDesign(EnclosingLaw):
    """A control law whose numbers follow from declared weights by a design, such as Riccati equations.

    A design cannot be traced; its result can. A run therefore compiles the designed `law`, and a search for the weights
    designs it anew for each set. Everything else is that of the designed law.
    """

    @property
    @abc.abstractmethod
    def law(self) -> ControlLaw:
        """The designed law."""

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[Mapping[str, Value], Mapping[str, Value]]:
        return self.law.step(memory, measurement, dt)


def with_designed_laws(law: Controller) -> Controller:
    """A controller with the designed law in place of every LawDesign in it; the same object where there is none.

    A controller that is no ControlLaw remains as it is.
    """
    if not isinstance(law, ControlLaw) or structure(law) in _without_design:
        return law
    designed: Controller = _designed(law)
    if designed is law:
        _without_design.add(structure(law))
    return designed


def _designed(part: Any) -> Any:
    if isinstance(part, LawDesign):
        return _designed(part.law)
    if isinstance(part, tuple):
        items = tuple(_designed(item) for item in part)
        return part if all(a is b for a, b in zip(items, part, strict=True)) else items
    if not isinstance(part, Controller) or not dataclasses.is_dataclass(part):
        return part
    fields = {field.name: getattr(part, field.name) for field in dataclasses.fields(part) if field.init}
    designed_fields = {name: _designed(value) for name, value in fields.items()}
    changed = {name: value for name, value in designed_fields.items() if value is not fields[name]}
    return dataclasses.replace(part, **changed) if changed else part


def designed_loop(loop: ControlLoop, system: System) -> ControlLoop:
    """A loop with the designed laws in its controller; the same object where there is no design.

    Pressures that the controller states as absolute are converted with the ambient pressure of the system.
    """
    controller, ambient = with_designed_laws(loop.controller), system.constants.get("ambient")
    if isinstance(controller, ControlLaw) and isinstance(ambient, float):
        controller = with_ambient(controller, ambient)
    return loop if controller is loop.controller else dataclasses.replace(loop, controller=controller)
