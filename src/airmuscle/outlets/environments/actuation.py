"""Actuation: the inputs of a plant from actions between -1 and 1, one for each valve or pair of valves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from ...core import ops
from ...core.errors import ParameterError
from ...core.ops import Value
from ...core.system import Input
from ...physics.plant import Plant

_FILL, _DISCHARGE = "fill", "discharge"
INFINITY = float("inf")


class Action(NamedTuple):
    """An action: its name, its meaning, and the inputs that it determines.

    With a fill and a discharge valve, the positive part is the opening of the first, the negative part that of the
    second. Any other input covers its range, from its minimum at -1 to its maximum at 1.
    """

    name: str
    meaning: str
    inputs: tuple[Input, ...]

    def commands(self, action: Value) -> dict[str, Value]:
        """The inputs of the plant at an action."""
        if len(self.inputs) == 2:
            fill, discharge = self.inputs
            return {fill.name: ops.maximum(action, 0.0), discharge.name: ops.maximum(-action, 0.0)}
        (only,) = self.inputs
        middle, half = 0.5 * (only.maximum + only.minimum), 0.5 * (only.maximum - only.minimum)
        return {only.name: middle + half * action}


def actions_of(plant: Plant) -> tuple[Action, ...]:
    """The actions of a plant, in the order of its inputs."""
    known = {i.name: i for i in plant.input_variables}
    actions = []
    for name, variable in known.items():
        prefix, _, own = name.rpartition(".")
        before = f"{prefix}." if prefix else ""
        if own == _DISCHARGE and f"{before}{_FILL}" in known:
            continue
        if own == _FILL and f"{before}{_DISCHARGE}" in known:
            pair = (variable, known[f"{before}{_DISCHARGE}"])
            actions.append(Action(prefix or "valve", "1 fills, -1 discharges, 0 closes both valves", pair))
        else:
            actions.append(Action(name, f"{variable.meaning}; -1 is its minimum, 1 its maximum", (variable,)))
    return tuple(actions)


def check_actions(actions: tuple[Action, ...]) -> None:
    """Raise ParameterError for a plant without inputs, or an input whose range is infinite."""
    if not actions:
        raise ParameterError("the plant of the task has no inputs; an environment needs one action or more.")
    for variable in (i for action in actions for i in action.inputs):
        if not (abs(variable.minimum) < INFINITY and abs(variable.maximum) < INFINITY):
            raise ParameterError(
                f"the input '{variable.name}' has the range {variable.minimum:g} to {variable.maximum:g}; an action "
                "needs a finite range. Give a plant whose inputs are limited."
            )


def all_commands(actions: tuple[Action, ...], inputs: Mapping[str, Value]) -> dict[str, Value]:
    """All inputs of the plant from the actions by name."""
    commands: dict[str, Value] = {}
    for action in actions:
        commands |= action.commands(inputs[f"action.{action.name}"])
    return commands
