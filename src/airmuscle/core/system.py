"""System: ordinary differential equations with named states, inputs and outputs, written over
`ops`.
"""

import abc
import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from .annotation import abridged, one_line
from .arrays import Array
from .declaration import as_float
from .diagnostics import ColumnLimit, Columns, Diagnostic
from .errors import ParameterError, alternatives
from .ops import Values

T = TypeVar("T", "StateVariable", "Input")


@dataclasses.dataclass(frozen=True)
class StateVariable:
    """A state: its name, its unit, and the nominal size below which its relative error does not
    matter.
    """

    name: str
    unit: str
    nominal: float
    meaning: str = ""


@dataclasses.dataclass(frozen=True)
class Input:
    """An input: its name, its unit, and the minimum and maximum command."""

    name: str
    unit: str = "1"
    minimum: float = 0.0
    maximum: float = 1.0
    meaning: str = "opening, 0 closed to 1 open"


def add_prefix(prefix: str, variables: tuple[T, ...]) -> tuple[T, ...]:
    """Return the variables with a prefix before each name."""
    return tuple(
        dataclasses.replace(variable, name=f"{prefix}{variable.name}") for variable in variables
    )


def select_prefix(prefix: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values whose names begin with the prefix, keyed by the remaining names."""
    return {
        name.removeprefix(prefix): value
        for name, value in values.items()
        if name.startswith(prefix)
    }


def with_prefix(prefix: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values with a prefix before each name."""
    return {f"{prefix}{name}": value for name, value in values.items()}


def united(*names: tuple[str, ...]) -> tuple[str, ...]:
    """Return all names, each once, in their order."""
    return tuple(dict.fromkeys(name for group in names for name in group))


class System(abc.ABC):
    """Ordinary differential equations x' = f(x, u, t) of a frozen model; its declared parameters
    are the program's.

    Every mapping is keyed by the names that `states` and `inputs` list. Rates must be continuous in
    the states. A system of your own declares the four abstract members; the others have defaults.
    """

    @property
    @abc.abstractmethod
    def states(self) -> tuple[StateVariable, ...]:
        """The states, in the order of the state vector."""

    @property
    @abc.abstractmethod
    def inputs(self) -> tuple[str, ...]:
        """The names of the inputs, each piecewise linear in time."""

    @abc.abstractmethod
    def rates(self, state: Values, inputs: Values) -> Values:
        """The time derivative of every state."""

    @abc.abstractmethod
    def outputs(self, state: Values, inputs: Values) -> Values:
        """Output quantities at a state."""

    def rates_and_outputs(self, state: Values, inputs: Values) -> tuple[Values, Values]:
        """The rates and the outputs; a system in which they share quantities computes these
        once.
        """
        return self.rates(state, inputs), self.outputs(state, inputs)

    @property
    def input_variables(self) -> tuple[Input, ...]:
        """The inputs with their units and ranges; without bounds by default."""
        infinity = float("inf")
        return tuple(Input(name, "", -infinity, infinity, "") for name in self.inputs)

    @property
    def output_units(self) -> Mapping[str, str]:
        """The units of outputs whose unit does not follow from their name."""
        return {}

    @property
    def state_lower_bounds(self) -> Sequence[float]:
        """The smallest possible value of every state; a run that falls below is aborted."""
        return [-float("inf")] * len(self.states)

    @property
    def positive_outputs(self) -> Sequence[str]:
        """Outputs that must be positive, such as volumes; a run in which one is not is aborted."""
        return ()

    @property
    def column_limits(self) -> Sequence[ColumnLimit]:
        """Limits of states and outputs beyond which the model is not valid, or a component is not
        permitted.
        """
        return ()

    @property
    def constants(self) -> Mapping[str, float | str]:
        """Constants of a recording of this system, such as the resting length [m]."""
        return {}

    def default_state(self) -> Mapping[str, float] | None:
        """The default initial state, a value for each state; None where a run must be given one."""
        return None

    def default_states(self, parameters: Array) -> Array | None:
        """The default initial states (N, n) of systems of this structure with parameters (N, P);
        NaN where there is none, None where a run must be given one."""
        return None

    def affects_default_state(self, path: str) -> bool:
        """Whether the parameter with this path affects the default initial state."""
        return True

    def check_state(self, state: Mapping[str, float]) -> None:  # noqa: B027 - every state is possible by default
        """Raise ParameterError or GeometryLimitError for a state that is impossible; names and
        signs were checked.
        """

    def describe(self) -> tuple[Diagnostic, ...]:
        """Assumptions of the model that limit the use of a result."""
        return ()

    def diagnose(self, columns: Columns) -> list[Diagnostic]:
        """Diagnostics of the rows of a run, columns (N,) by name, in which the model is not
        valid.
        """
        return []

    def failure_hint(self, state: Mapping[str, float]) -> str:
        """Remedy for a run that ended early at this state; empty if there is no specific one."""
        return ""


class SensitivitySystem(System):
    """A system with the states of another one, followed by their derivatives along columns, state
    by state.

    It is a System like any other; its program is generated from the inner one, which costs less
    than its own rates.
    """

    inner: System
    """The system whose states come first."""

    @property
    @abc.abstractmethod
    def parameter_indices(self) -> tuple[tuple[int, ...], ...]:
        """For every column the indices of the inner parameters that vary together."""

    @property
    def input_indices(self) -> tuple[int, ...]:
        """The indices of the inner inputs that depend on the columns; none by default.

        Their derivatives by every column, input by input, are further inputs behind those of the
        inner system.
        """
        return ()

    @property
    @abc.abstractmethod
    def observed_names(self) -> tuple[str, ...]:
        """Inner states and outputs that are returned as outputs."""

    @property
    @abc.abstractmethod
    def output_names(self) -> tuple[str, ...]:
        """Observed values, the derivatives of each, and their time derivatives."""


def check_system(what: str, candidate: object) -> None:
    """Raise ParameterError for anything that is not a System, such as a muscle or a class."""
    if not isinstance(candidate, System):
        raise ParameterError(
            f"{what}: {one_line(candidate)} is no plant; give Plant(muscle, circuit, mechanism)."
        )


def state_vector(system: System, state: Mapping[str, float]) -> Array:
    """The values (n,) of a state, in the order of the system's states.

    Raises ParameterError for an unknown or missing name, a value that is no finite number, and a
    value below the lower bound of its state, such as a negative air mass.
    """
    names = [s.name for s in system.states]
    if not isinstance(state, Mapping):
        raise ParameterError(
            f"the initial state is {abridged(state)}; give a value for each name, as"
            " plant.state_at(...) and find_equilibrium(...) do."
        )
    if len(state) != len(names) or any(name not in state for name in names):
        for name in (n for n in state if n not in names):
            raise ParameterError(
                f"the plant has no state '{one_line(name)}'{alternatives(name, names)} "
                "plant.state_at(pressure=...) gives the state with a pressure."
            )
        missing = ", ".join(name for name in names if name not in state)
        raise ParameterError(
            f"the initial state lacks {missing}; use plant.state_at(pressure=...) or"
            " find_equilibrium."
        )
    values = np.array(
        [as_float(f"the initial state's {name}", state[name]) for name in names], dtype=float
    )
    if not np.isfinite(values).all():
        raise ParameterError(
            "the initial state must be finite; it is"
            f" {dict(zip(names, values.tolist(), strict=True))}."
        )
    for i in np.flatnonzero(values < np.asarray(system.state_lower_bounds)):
        raise ParameterError(
            f"the initial state's {names[i]} is {values[i]:.4g} {system.states[i].unit}; it must"
            " not be negative. Use plant.state_at(pressure=...)."
        )
    return values
