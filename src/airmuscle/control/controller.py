"""Controller (interface): a sampled controller, from measured columns to commanded inputs."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import Any, NamedTuple

from ..core.ops import Value

RELATIVE = ("u", "y", "u/y")
"""Units of a controller's parameters that follow from the loop: u is the unit of the commanded input, y that of the
measured column. In Python such a number is SI; a file gives it in any unit that fits: `"0.4 1/bar"`."""


class Measurement(NamedTuple):
    """Input of a controller at a sampling instant, by name and in SI: the measured columns, their set points, and the
    range (minimum, maximum) of every commanded input; of one with a driver 0 to 1."""

    columns: Mapping[str, Value]
    setpoints: Mapping[str, Value]
    ranges: Mapping[str, tuple[Value, Value]]


class Controller(abc.ABC):
    """A sampled controller: a frozen model with a memory that is a value, so that runs are reproducible."""

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
    def step(self, memory: Any, measurement: Measurement, dt: float) -> tuple[Mapping[str, float], Any]:
        """The command of every input until the next sample, `dt` [s] later, and the memory for that sample.

        Commands are limited to the ranges of the inputs afterwards; a controller with integral action must account for
        it.
        """

    def notes(self, memory: Any) -> tuple[str, ...]:
        """Remarks on a run that ended with this memory, for the notes of its recording; none by default."""
        return ()


def relative_unit(unit: str, measured: str, commanded: str) -> str:
    """A declared unit, with the units y and u inserted where it is one of RELATIVE: `u/y` is `1/Pa`, say."""
    if unit == "u/y":
        if measured in ("1", commanded):
            return commanded if measured == "1" else "1"
        return f"{commanded}/({measured})" if set(measured) & set("/ ") else f"{commanded}/{measured}"
    return {"u": commanded, "y": measured}.get(unit, unit)
