"""What a controller of one output commands: an input, or two that work against each other."""

from __future__ import annotations

from collections.abc import Mapping

from ..core.declaration import model
from ..core.errors import ParameterError


@model
class SplitRange:
    """Split range: a command u > 0 goes to one input, -u for u < 0 to another, as with a valve to fill and one to
    discharge; each is zero while the other is not. u reaches from minus the one's greatest value to the other's."""

    positive: str
    negative: str

    def check(self) -> None:
        if self.positive == self.negative:
            raise ParameterError(f"SplitRange: both sides are '{self.positive}'; name two inputs.")


Commanded = str | SplitRange


def inputs_of(commanded: Commanded) -> tuple[str, ...]:
    """The inputs that are commanded."""
    return (commanded,) if isinstance(commanded, str) else (commanded.positive, commanded.negative)


def range_of(commanded: Commanded, ranges: Mapping[str, tuple[float, float]]) -> tuple[float, float]:
    """The least and greatest command, from those of the inputs."""
    if isinstance(commanded, str):
        return ranges[commanded]
    return -ranges[commanded.negative][1], ranges[commanded.positive][1]


def commands(commanded: Commanded, value: float) -> dict[str, float]:
    """A command as values of the inputs."""
    if isinstance(commanded, str):
        return {commanded: value}
    return {commanded.positive: max(value, 0.0), commanded.negative: max(-value, 0.0)}
