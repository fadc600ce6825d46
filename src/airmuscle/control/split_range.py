"""Split-range control: one controller output to one or two inputs."""

from __future__ import annotations

from collections.abc import Mapping

from ..core.declaration import model
from ..core.errors import ParameterError


@model
class SplitRange:
    """Split range: a positive output u goes to one input, -u of a negative one to another, such as a fill and a
    discharge valve; the other input is zero. u is between minus the maximum of the one and the maximum of the other."""

    positive: str
    negative: str

    def check(self) -> None:
        if self.positive == self.negative:
            raise ParameterError(f"SplitRange: both inputs are '{self.positive}'; name two inputs.")


Commanded = str | SplitRange


def inputs_of(commanded: Commanded) -> tuple[str, ...]:
    """The commanded inputs."""
    return (commanded,) if isinstance(commanded, str) else (commanded.positive, commanded.negative)


def range_of(commanded: Commanded, ranges: Mapping[str, tuple[float, float]]) -> tuple[float, float]:
    """The range of a controller output, from those of the inputs."""
    if isinstance(commanded, str):
        return ranges[commanded]
    return -ranges[commanded.negative][1], ranges[commanded.positive][1]


def commands(commanded: Commanded, output: float) -> dict[str, float]:
    """The values of the inputs for a controller output."""
    if isinstance(commanded, str):
        return {commanded: output}
    opposite = -output
    return {
        commanded.positive: 0.0 if output < 0.0 else output,
        commanded.negative: 0.0 if opposite < 0.0 else opposite,
    }
