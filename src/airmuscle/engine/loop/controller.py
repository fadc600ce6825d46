"""Controllers (interface): from measured columns to commanded inputs, and the units of their
signals and parameters.
"""

import abc
from collections.abc import Mapping
from typing import Any, NamedTuple

from ...core import Parameter, Value, parameters, parts_of
from ...core.declaration import forwarded

RELATIVE = ("u", "y", "u/y", "u/s")
"""Units of a controller's parameters that follow from the loop: u is the unit of the commanded
input, y that of the measured column. In Python such a number is SI; a file gives it in any unit
that fits: `"0.4 1/bar"`."""


class Measurement(NamedTuple):
    """Input of a controller at a sampling instant, by name and in SI: the measured columns, their
    set points, and the range (minimum, maximum) of every commanded input; of one with a driver 0 to
    1."""

    columns: Mapping[str, Value]
    setpoints: Mapping[str, Value]
    ranges: Mapping[str, tuple[Value, Value]]


class SignalRelated(abc.ABC):
    """A model with parameters whose units follow from the signals that it names."""

    @abc.abstractmethod
    def unit_of(self, declared: Parameter, index: int, units: Mapping[str, str]) -> str:
        """The unit of item `index` of a declared parameter; `units` are those of the signals by
        name, '' if unknown.

        Raises KeyError for a signal that is not among them.
        """


class Controller(SignalRelated):
    """A sampled controller: a frozen model with a memory that is a value, so that runs are
    reproducible.
    """

    @property
    @abc.abstractmethod
    def measured_columns(self) -> tuple[str, ...]:
        """The measured states and outputs of the plant."""

    @property
    @abc.abstractmethod
    def setpoints(self) -> tuple[str, ...]:
        """The set points; one that is named as a column has that column's unit."""

    @property
    @abc.abstractmethod
    def inputs(self) -> tuple[str, ...]:
        """The commanded inputs of the plant."""

    @abc.abstractmethod
    def init(self) -> Any:
        """The memory before the first sample."""

    @abc.abstractmethod
    def step(
        self, memory: Any, measurement: Measurement, dt: float
    ) -> tuple[Mapping[str, float], Any]:
        """The command of every input until the next sample, `dt` [s] later, and the memory for that
        sample.

        Commands are limited to the ranges of the inputs afterwards, for which integral action must
        account.
        """

    @property
    def signal_units(self) -> Mapping[str, str]:
        """Units of the signals that this controller names and that are no columns of a plant, by
        name.
        """
        return {}

    def unit_of(self, declared: Parameter, index: int, units: Mapping[str, str]) -> str:
        """The unit of a parameter: u is that of the first commanded input, y that of the first
        measured column.
        """
        if declared.unit not in RELATIVE:
            return declared.unit
        measured = units[self.measured_columns[0]] or "1" if "y" in declared.unit else "1"
        commanded = units[self.inputs[0]] or "1" if "u" in declared.unit else "1"
        return relative_unit(declared.unit, measured, commanded)

    def notes(self, memory: Any) -> tuple[str, ...]:
        """Remarks on a run that ended with this memory, for the notes of its recording; none by
        default.
        """
        return ()


def relative_unit(unit: str, measured: str, commanded: str) -> str:
    """A declared unit, with the units y and u inserted where it is one of RELATIVE: `u/y` is
    `1/Pa`, say.
    """
    if unit == "u/y":
        if measured in ("1", commanded):
            return commanded if measured == "1" else "1"
        return (
            f"{commanded}/({measured})" if set(measured) & set("/ ") else f"{commanded}/{measured}"
        )
    if unit == "u/s":
        return "1/s" if commanded == "1" else f"({commanded})/s"
    return {"u": commanded, "y": measured}.get(unit, unit)


class MultivariableController(Controller):
    """A controller that leads the columns `controlled` to their set points, from the columns
    `measured`.
    """

    measured: tuple[str, ...]
    controlled: tuple[str, ...]
    commanded: tuple[str, ...]

    measured_columns = forwarded("measured")
    setpoints = forwarded("controlled")
    inputs = forwarded("commanded")


def failure_notes(owner: str, program: str, failures: int) -> tuple[str, ...]:
    """The note of a predictive controller on the samples at which its program had no solution; none
    without them.
    """
    if not failures:
        return ()
    return (
        (
            f"{owner}: the {program} had no solution at {failures} samples; the next input of the"
            " last plan was applied. Make the limits of columns soft (a finite slack_weight) or"
            " wider."
        ),
    )


def named_signal_units(controller: Any) -> dict[str, str]:
    """Units of the signals that a controller and the laws inside it name, and that are no columns
    of a plant.
    """
    laws = [part for _, part in parts_of(controller) if isinstance(part, Controller)]
    return {name: unit for law in laws for name, unit in law.signal_units.items()}


def parameter_units(controller: Any, units: Mapping[str, str]) -> dict[str, str]:
    """The unit of every number of a controller by its path, those inside it included.

    `units` are those of the columns and inputs of the plant by name; units of further signals are
    added. It is "1" where the unit of a signal is not known.
    """
    named = named_signal_units(controller)
    known = {**named, **{name: unit or named.get(name, "") for name, unit in units.items()}}
    unit_of_each: dict[str, str] = {}
    for path, part in parts_of(controller):
        for declared in parameters(part):
            name = f"{path}.{declared.name}" if path else declared.name
            value = getattr(part, declared.name)
            keys = (
                [f"{name}[{i}]" for i in range(len(value))] if isinstance(value, tuple) else [name]
            )
            for i, key in enumerate(keys):
                try:
                    unit_of_each[key] = unit_of(part, declared, i, known)
                except KeyError:
                    unit_of_each[key] = "1"
    return unit_of_each


def unit_of(part: Any, declared: Parameter, index: int, units: Mapping[str, str]) -> str:
    """The unit of item `index` of a declared parameter of a controller or of a model inside it.

    Raises KeyError for a signal whose unit is not given.
    """
    return (
        part.unit_of(declared, index, units) if isinstance(part, SignalRelated) else declared.unit
    )
