"""Split-range control: one controller output to one or two inputs."""

from __future__ import annotations

from collections.abc import Mapping

from ...core import ops
from ...core.declaration import model
from ...core.errors import ParameterError
from ...core.ops import Value


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


def range_of(commanded: Commanded, ranges: Mapping[str, tuple[Value, Value]]) -> tuple[Value, Value]:
    """The range of a controller output, from those of the inputs."""
    if isinstance(commanded, str):
        return ranges[commanded]
    return -ranges[commanded.negative][1], ranges[commanded.positive][1]


def commands(commanded: Commanded, output: Value) -> dict[str, Value]:
    """The values of the inputs for a controller output."""
    if isinstance(commanded, str):
        return {commanded: output}
    return {commanded.positive: ops.maximum(output, 0.0), commanded.negative: ops.maximum(-output, 0.0)}
