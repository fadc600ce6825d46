"""Tasks of learning environments: observations, reward, and actions as inputs of the plant."""

import abc
import dataclasses
import functools
import itertools
import math
from collections.abc import Mapping, Sequence
from typing import ClassVar, NamedTuple

from ...core import Input, ParameterError, StateVariable, System, Value, check_field_types, ops
from ...physics.plant import Plant

_FILL = "fill"
_DISCHARGE = "discharge"


class Action(NamedTuple):
    """An action: its name, its meaning, and the inputs that it determines.

    With a fill and a discharge valve, the positive part is the opening of the first, the negative
    part that of the second. Any other input covers its range, from its minimum at -1 to its maximum
    at 1.
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
        middle = 0.5 * (only.maximum + only.minimum)
        half = 0.5 * (only.maximum - only.minimum)
        return {only.name: middle + half * action}


def check_actions(actions: tuple[Action, ...]) -> None:
    """Raise ParameterError for a plant without inputs, or an input whose range is infinite."""
    if not actions:
        raise ParameterError(
            "the plant of the task has no inputs; an environment needs one action or more."
        )
    for variable in (i for action in actions for i in action.inputs):
        if not (math.isfinite(variable.minimum) and math.isfinite(variable.maximum)):
            raise ParameterError(
                f"the input '{variable.name}' has the range {variable.minimum:g} to"
                f" {variable.maximum:g}; an action needs a finite range. Give a plant whose inputs"
                " are limited."
            )


TIME = "time"
"""The input that holds the time of an episode [s] at the end of the present period."""


@dataclasses.dataclass(frozen=True)
class Observation:
    """One observed quantity: name, unit, and the limits [unit] to which it is clipped."""

    name: str
    unit: str
    low: float
    high: float
    meaning: str = ""

    def __post_init__(self) -> None:
        check_field_types(self)


class EnvironmentTask(System):
    """A plant with a task, whose outputs are the observations, the reward and whether an episode
    ends.

        reward = exp(-e_1^2 - e_2^2 - ...) - w (a_1^2 + ... + a_m^2)/m

    e_i control errors divided by their scale, a_j actions from -1 to 1, w weight of the effort. The
    reward is at most 1 per period; an error of one scale gives 0.37. An episode is terminated where
    `ends` holds.

    Its parameters are those of the plant (`plant.mechanism.inertia`) and its own
    (`target_frequency`); a randomisation may vary all of them. Written over `ops`, so that it is
    compiled together with the plant, also in lanes.
    """

    from_file: ClassVar[bool] = False

    plant: Plant
    effort_weight: float
    period: float

    @property
    @abc.abstractmethod
    def observations(self) -> tuple[Observation, ...]:
        """The observed quantities, in order."""

    @property
    @abc.abstractmethod
    def initial_ranges(self) -> Mapping[str, tuple[float, float]]:
        """Ranges of the initial gauge pressure of every muscle ('left.pressure' [Pa]) and
        coordinate; speeds are 0.
        """

    @abc.abstractmethod
    def observe(
        self, state: Mapping[str, Value], outputs: Mapping[str, Value], time: Value
    ) -> tuple[Value, ...]:
        """The observations at a state, in the units of `observations`; `outputs` are those of the
        plant.
        """

    @abc.abstractmethod
    def errors(self, state: Mapping[str, Value], time: Value) -> tuple[Value, ...]:
        """Control errors divided by their scale [1]."""

    @abc.abstractmethod
    def ends(self, state: Mapping[str, Value]) -> Value:
        """Whether an episode ends at this state: a condition."""

    @functools.cached_property
    def actions(self) -> tuple[Action, ...]:
        """The actions, in the order of the inputs of the plant; each is between -1 and 1."""
        known = {i.name: i for i in self.plant.input_variables}
        actions = []
        for name, variable in known.items():
            prefix, dot, valve_name = name.rpartition(".")
            fill, discharge = (known.get(f"{prefix}{dot}{valve}") for valve in (_FILL, _DISCHARGE))
            if valve_name not in (_FILL, _DISCHARGE) or fill is None or discharge is None:
                actions.append(
                    Action(
                        name, f"{variable.meaning}; -1 is its minimum, 1 its maximum", (variable,)
                    )
                )
            elif variable is fill:
                meaning = "1 fills, -1 discharges, 0 closes both valves"
                actions.append(Action(prefix or "valve", meaning, (fill, discharge)))
        return tuple(actions)

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """The states of the plant."""
        return self.plant.states

    @property
    def state_lower_bounds(self) -> Sequence[float]:
        """Those of the plant."""
        return self.plant.state_lower_bounds

    @property
    def input_variables(self) -> tuple[Input, ...]:
        """The actions, then the time."""
        actions = (Input(f"action.{a.name}", "1", -1.0, 1.0, a.meaning) for a in self.actions)
        return (*actions, Input(TIME, "s", 0.0, math.inf, "time of the episode"))

    @property
    def inputs(self) -> tuple[str, ...]:
        """The names of the actions and of the time."""
        return tuple(i.name for i in self.input_variables)

    def rates(self, state: Mapping[str, Value], inputs: Mapping[str, Value]) -> Mapping[str, Value]:
        """The rates of the plant under the actions."""
        return self.plant.rates(state, self._commands(inputs))

    def _commands(self, inputs: Mapping[str, Value]) -> dict[str, Value]:
        """All inputs of the plant from the actions by name."""
        commands = (action.commands(inputs[f"action.{action.name}"]) for action in self.actions)
        return dict(itertools.chain.from_iterable(command.items() for command in commands))

    def outputs(self, state: Mapping[str, Value], inputs: Mapping[str, Value]) -> dict[str, Value]:
        """The observations by name, clipped, then the reward, then 1 where the episode ends, else
        0.
        """
        time = inputs[TIME]
        outputs = self.plant.outputs(state, self._commands(inputs))
        values = self.observe(state, outputs, time)
        observed = {
            o.name: ops.clip(v, o.low, o.high)
            for o, v in zip(self.observations, values, strict=True)
        }
        efforts = [inputs[f"action.{a.name}"] ** 2 for a in self.actions]
        distance = sum(error**2 for error in self.errors(state, time))
        closeness = ops.exp(-distance)
        reward = closeness - self.effort_weight * sum(efforts) / len(efforts)
        terminated = ops.where(self.ends(state), 1.0, 0.0)
        return {**observed, "reward": reward, "terminated": terminated}
