"""Controllers: what looks at a plant at sampling instants, and says what its inputs are to be until the next."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import Any, NamedTuple

RELATIVE = ("u", "y", "u/y")
"""Units of a controller's parameters that follow from where it stands: u that of the input which it commands, y that of
the column which it measures. In Python such a number is SI; a file gives it in any unit that fits: `"0.4 1/bar"`."""


class Measurement(NamedTuple):
    """What a controller is given at a sampling instant, by name and in SI: the columns that it measures, their set
    points, and the least and greatest value of each input that it commands (of one with a driver, 0 and 1)."""

    columns: Mapping[str, float]
    setpoints: Mapping[str, float]
    ranges: Mapping[str, tuple[float, float]]


class Controller(abc.ABC):
    """A sampled controller: a frozen model with a memory that is a value, so that the same run is the same twice."""

    @property
    @abc.abstractmethod
    def measured_columns(self) -> tuple[str, ...]:
        """The states and outputs of the plant that it measures."""

    @property
    @abc.abstractmethod
    def setpoints(self) -> tuple[str, ...]:
        """What it is told to follow; a set point named as a column is in that column's unit."""

    @property
    @abc.abstractmethod
    def inputs(self) -> tuple[str, ...]:
        """The inputs of the plant that it commands."""

    @abc.abstractmethod
    def init(self) -> Any:
        """The memory before the first sample."""

    @abc.abstractmethod
    def step(self, memory: Any, measurement: Measurement, dt: float) -> tuple[Mapping[str, float], Any]:
        """The command of every input until the next sample, `dt` [s] later, and the memory to give to that one.

        What lies beyond the range of an input is cut off afterwards; a controller that integrates must know of it.
        """


def relative_unit(unit: str, measured: str, commanded: str) -> str:
    """A declared unit, where it is one of RELATIVE with the units y and u put in: `u/y` is `1/Pa`, say."""
    if unit == "u/y":
        if measured in ("1", commanded):
            return commanded if measured == "1" else "1"
        return f"{commanded}/({measured})" if set(measured) & set("/ ") else f"{commanded}/{measured}"
    return {"u": commanded, "y": measured}.get(unit, unit)
