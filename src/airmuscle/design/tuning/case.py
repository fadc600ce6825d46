"""LoopCase: a plant with its control loop and initial state, one of the family for which gains are tuned."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from ...core.annotation import abridged
from ...core.errors import ParameterError, PhysicsError
from ...core.short_repr import ShortRepr
from ...core.tree import leaves, structure, with_parameters
from ...engine.loop.control_loop import ControlLoop
from ...engine.loop.controller import Controller
from ...physics.equilibrium import find_equilibrium
from ...physics.plant.plant import Plant


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LoopCase(ShortRepr):
    """A plant with its control loop and initial state, one of the family for which gains are tuned.

    name             for tables and messages: "nominal", "load x 2"
    plant, loop      any plant, and the loop that closes it
    initial_state    a value for each state [SI]; the equilibrium at ambient pressure unless given
    controller_path  place of the tuned controller within `loop.controller`, such as `law` for a WithSensors around it;
                     empty if it is the controller itself

    Cases with the same loop object and plants of one structure are simulated in one batch.
    """

    name: str
    plant: Plant
    loop: ControlLoop
    initial_state: Mapping[str, float] | None = None
    controller_path: str = ""

    def __post_init__(self) -> None:
        for field, kind in (("name", str), ("plant", Plant), ("loop", ControlLoop), ("controller_path", str)):
            value = getattr(self, field)
            if not isinstance(value, kind):
                raise ParameterError(f"LoopCase.{field} is {abridged(value)}; give a {kind.__name__}.")

    @property
    def controller(self) -> Controller:
        """The tuned controller. Raises ParameterError where `controller_path` leads to none."""
        part: Any = self.loop.controller
        for name in self.controller_path.split(".") if self.controller_path else ():
            part = getattr(part, name, None)
        if not isinstance(part, Controller):
            raise ParameterError(
                f"case '{self.name}': the controller {type(self.loop.controller).__name__} has no controller at "
                f"'{self.controller_path}'; give the field that contains the tuned one, such as law."
            )
        return part

    def full_path(self, path: str) -> str:
        """The path of a parameter of the tuned controller within `loop.controller`."""
        return f"{self.controller_path}.{path}" if self.controller_path else path

    def start(self) -> dict[str, float]:
        """The initial state [SI]. Raises PhysicsError where the plant has no equilibrium."""
        if self.initial_state is not None:
            return dict(self.initial_state)
        try:
            return find_equilibrium(self.plant, pressure=0.0)
        except PhysicsError as error:
            raise error.located(f"case '{self.name}'") from None


def check_cases(cases: Sequence[LoopCase]) -> tuple[LoopCase, ...]:
    """The cases as a tuple. Raises ParameterError if there are none, or their tuned controllers differ."""
    given = tuple(cases) if isinstance(cases, Sequence) else (cases,)
    wrong = [case for case in given if not isinstance(case, LoopCase)]
    if wrong or not given:
        what = f"contain {abridged(wrong[0])}" if wrong else "are empty"
        raise ParameterError(f"tune: the cases {what}; give a list of LoopCase.")
    names = [case.name for case in given]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ParameterError(f"tune: two cases are named '{twice[0]}'; give each its own name.")
    first = given[0].controller
    for case in given[1:]:
        if structure(case.controller) is not structure(first):
            raise ParameterError(
                f"case '{case.name}': its controller is {type(case.controller).__name__}, which is not that of case "
                f"'{given[0].name}', {type(first).__name__}; all cases need the same controller. If it is enclosed by "
                "another law, state controller_path."
            )
    return given


def with_gains(controller: Any, gains: Mapping[str, float]) -> Any:
    """A controller with other values of some parameters, validated like a new one. Raises ParameterError."""
    known = list(leaves(controller))
    unknown = set(gains) - {leaf.path for leaf in known}
    if unknown:
        raise ParameterError(f"{type(controller).__name__} has no parameter '{min(unknown)}'.")
    values = [gains.get(leaf.path, leaf.value) for leaf in known]
    return with_parameters(controller, values)


def loop_with_gains(case: LoopCase, gains: Mapping[str, float]) -> ControlLoop:
    """The loop of a case with other gains of the tuned controller, validated. Raises ParameterError."""
    within = {case.full_path(path): value for path, value in gains.items()}
    return dataclasses.replace(case.loop, controller=with_gains(case.loop.controller, within))
