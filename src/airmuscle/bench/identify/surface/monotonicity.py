"""Monotonicity violations of a static law: regions where force or contraction has a slope of the wrong sign."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ....core import autodiff
from ....core.arrays import Array

Range = tuple[float, float]
_ROUNDING = 1e-9
"""Slopes below this fraction of the maximum slope are rounding errors; chosen."""


@dataclasses.dataclass(frozen=True)
class MonotonicityRule:
    """A forbidden sign of the slope of the `quantity` that a law gives, with respect to one of its arguments."""

    description: str
    """A violation of the rule in words."""
    quantity: str
    argument: int
    """0 pressure, 1 the second argument."""
    sign: float
    """Sign of a slope that violates the rule."""


@dataclasses.dataclass(frozen=True)
class MonotonicityViolation:
    """One connected region of a validity range where a law violates a rule."""

    rule: MonotonicityRule
    pressure: Range
    """Limits of the region in gauge pressure [Pa]."""
    second_argument: Range
    """Limits of the region in contraction [1], or in force [N] for a law that gives contraction."""
    area_fraction: float
    """Fraction of the validity range that the region covers [1]."""
    worst_point: tuple[float, float]
    """Gauge pressure [Pa] and second argument at the maximum violation."""
    worst_slope: float
    """The slope there [SI]."""

    def __str__(self) -> str:
        (p0, p1), (low, high) = self.pressure, (self._format_second(v) for v in self.second_argument)
        share = f"{100 * self.area_fraction:.1f} %" if self.area_fraction >= 5e-4 else "less than 0.1 %"
        return (
            f"{self.rule.description} between {p0 / 1e3:.4g} and {p1 / 1e3:.4g} kPa, {low} and {high} "
            f"({share} of the validity range), most at {self.worst_point[0] / 1e3:.4g} kPa and "
            f"{self._format_second(self.worst_point[1])}"
        )

    def _format_second(self, value: float) -> str:
        return f"{100 * value:.2f} %" if self.rule.quantity == "force" else f"{value:.0f} N"


def find_violations(
    law: Any, rules: Sequence[MonotonicityRule], pressure: Array, second_argument: Array
) -> tuple[MonotonicityViolation, ...]:
    """The regions where exact slopes at grid points violate one of the rules, largest first.

    `pressure` [Pa] and `second_argument` (contraction [1] or force [N]) are grids, shape (N, M) each.
    """
    violations: list[MonotonicityViolation] = []
    for rule in rules:
        slope = autodiff.derivative(law, rule.quantity, pressure, second_argument, wrt=rule.argument)
        excess = rule.sign * np.asarray(slope)
        significant = np.where(excess > _ROUNDING * np.abs(excess).max(), excess, 0.0)
        violations += _connected_regions(rule, significant, pressure, second_argument)
    return tuple(sorted(violations, key=lambda v: -v.area_fraction))


def _connected_regions(
    rule: MonotonicityRule, excess: Array, pressure: Array, second_argument: Array
) -> list[MonotonicityViolation]:
    """The connected regions where `excess` is positive."""
    from scipy import ndimage

    labels, count = ndimage.label(excess > 0)
    regions = []
    for label in range(1, count + 1):
        inside = labels == label
        worst = np.unravel_index(int(np.argmax(np.where(inside, excess, -np.inf))), excess.shape)
        limits, second_limits = ((float(v[inside].min()), float(v[inside].max())) for v in (pressure, second_argument))
        worst_point = (float(pressure[worst]), float(second_argument[worst]))
        worst_slope = rule.sign * float(excess[worst])
        regions.append(
            MonotonicityViolation(rule, limits, second_limits, float(inside.mean()), worst_point, worst_slope)
        )
    return regions
