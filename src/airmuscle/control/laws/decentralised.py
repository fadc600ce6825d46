"""Decentralised: several control laws side by side, each with its own inputs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...core.declaration import model
from ...core.errors import ParameterError
from ...core.ops import Value
from ...core.reference import Reference
from ...core.system import select_prefix, united, with_prefix
from ...engine.loop.control_law import ControlLaw
from ...engine.loop.controller import Measurement

SKOGESTAD_POSTLETHWAITE2005 = Reference(
    key="skogestad-postlethwaite-2005",
    authors="Skogestad, S., Postlethwaite, I.",
    title="Multivariable Feedback Control: Analysis and Design",
    where="2nd edition, Wiley, Chichester, chapter 10",
    year=2005,
    note="decentralised control",
)


@model
class Decentralised(ControlLaw):
    """Decentralised control: independent control laws, such as one pressure controller for each muscle of a joint.

    No input may be commanded by two laws.
    Reference: Skogestad and Postlethwaite (2005), chapter 10.
    """

    references: ClassVar[tuple[Reference, ...]] = (SKOGESTAD_POSTLETHWAITE2005,)

    laws: tuple[ControlLaw, ...]

    def check(self) -> None:
        if not self.laws:
            raise ParameterError("Decentralised: there is no law; give at least one.")
        named = [name for law in self.laws for name in law.inputs]
        twice = [name for name in named if named.count(name) > 1]
        if twice:
            raise ParameterError(f"Decentralised: '{twice[0]}' is commanded by two laws; give each input to one law.")

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return united(*(law.measured_columns for law in self.laws))

    @property
    def setpoints(self) -> tuple[str, ...]:
        return united(*(law.setpoints for law in self.laws))

    @property
    def inputs(self) -> tuple[str, ...]:
        return united(*(law.inputs for law in self.laws))

    @property
    def initial_memory(self) -> dict[str, float]:
        """The values of all laws, with the prefixes `0.`, `1.`, ..."""
        memory: dict[str, float] = {}
        for i, law in enumerate(self.laws):
            memory |= with_prefix(f"{i}.", law.initial_memory)
        return memory

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        commands: dict[str, Value] = {}
        later: dict[str, Value] = {}
        for i, law in enumerate(self.laws):
            own, kept = law.step(select_prefix(f"{i}.", memory), measurement, dt)
            commands |= own
            later |= with_prefix(f"{i}.", kept)
        return commands, later
