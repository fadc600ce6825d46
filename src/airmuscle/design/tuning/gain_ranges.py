"""GainRange: the range of one gain, and its logarithmic scale for the optimiser."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core.annotation import abridged
from ...core.arrays import Array
from ...core.errors import ParameterError, suggestion
from ...core.tree import Leaf, leaves
from ...engine.loop.controller import Controller

DIGITS = 5
"""Significant digits of a gain, so that a file contains exactly the gains that were simulated (chosen)."""


@dataclasses.dataclass(frozen=True)
class GainRange:
    """The range of one gain [SI]: logarithmic where both bounds have the same sign, otherwise linear."""

    path: str
    low: float
    high: float

    @property
    def logarithmic(self) -> bool:
        """Whether the optimiser varies the logarithm of the gain: neither bound is 0 and their signs are equal."""
        return self.low * self.high > 0

    def to_unit(self, values: Array) -> Array:
        """Gains (E,) as coordinates within 0 and 1."""
        if not self.logarithmic:
            return (values - self.low) / (self.high - self.low)
        return np.asarray(np.log(values / self.low) / math.log(self.high / self.low))

    def from_unit(self, coordinates: Array) -> Array:
        """Coordinates (E,) within 0 and 1 as gains [SI] with five significant digits."""
        if self.logarithmic:
            inside = self.low * (self.high / self.low) ** coordinates
        else:
            inside = self.low + (self.high - self.low) * coordinates
        return np.clip(rounded(inside), self.low, self.high)


def gain_ranges(controller: Controller, bounds: Any) -> tuple[GainRange, ...]:
    """The ranges of the tuned gains from bounds [SI] by path.

    Raises ParameterError for an unknown path, for bounds that are not a pair, not finite, not in order or outside the
    declared range of the parameter.
    """
    if not isinstance(bounds, Mapping) or not bounds:
        what = "empty" if isinstance(bounds, Mapping) else abridged(bounds)
        raise ParameterError(f'bounds: they are {what}; give a range for each gain, {{"gain": (0.1, 10.0)}}.')
    known = {leaf.path: leaf for leaf in leaves(controller)}
    for path in bounds:
        if path not in known:
            raise ParameterError(
                f"bounds: {type(controller).__name__} has no parameter '{path}'; there are {', '.join(known)}."
                f"{suggestion(str(path), known)}"
            )
    return tuple(_range(known[path], pair) for path, pair in bounds.items())


def _range(leaf: Leaf, pair: Any) -> GainRange:
    declared, where = leaf.declared, f"bounds: '{leaf.path}' ({leaf.declared.symbol}, {leaf.declared.meaning})"
    try:
        low, high = (float(bound) for bound in pair)
    except (TypeError, ValueError):
        raise ParameterError(
            f"{where} is {abridged(pair)}; give two numbers, (minimum, maximum), in SI units."
        ) from None
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise ParameterError(f"{where} is {low:g} to {high:g}; the minimum must be below the maximum, both finite.")
    smallest, greatest = declared.bounds
    if low < smallest or high > greatest:
        raise ParameterError(f"{where} is {low:g} to {high:g}; allowed range: {smallest:g} to {greatest:g}.")
    return GainRange(leaf.path, low, high)


def rounded(values: Array) -> Array:
    """Numbers (E,) with DIGITS significant digits."""
    return np.array([float(f"{value:.{DIGITS - 1}e}") for value in np.ravel(values).tolist()]).reshape(np.shape(values))


def to_gains(ranges: Sequence[GainRange], coordinates: Array) -> Array:
    """Coordinates (E, D) within 0 and 1 as gains (E, D) [SI]."""
    return np.column_stack([each.from_unit(coordinates[:, i]) for i, each in enumerate(ranges)])


def to_coordinates(ranges: Sequence[GainRange], gains: Mapping[str, float]) -> Array | None:
    """The coordinates (D,) of a set of gains; None where one of them is outside its range."""
    values = [gains[each.path] for each in ranges]
    if not all(each.low <= value <= each.high for each, value in zip(ranges, values, strict=True)):
        return None
    return np.array([float(each.to_unit(np.array(v))) for each, v in zip(ranges, values, strict=True)])
